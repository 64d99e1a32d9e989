// SPDX-License-Identifier: Apache-2.0
#include "NoiseModels.h"
#include "curlew/field/Kernels.h"

// Kernels of the noises in three dimensions. Those of fewer and of more dimensions are in files of their own, so they
// compile in parallel.
namespace curlew {

#define CURLEW_OCTAVES(...) CURLEW_MODEL_KERNELS(detail::Octaves<__VA_ARGS__>)
#define CURLEW_NOISE(name, Noise, lowest, highest, summary) CURLEW_OCTAVES(Noise<3>)
CURLEW_NOISES(CURLEW_NOISE)

} // namespace curlew
