// SPDX-License-Identifier: Apache-2.0
#include "NoiseModels.h"
#include "curlew/field/Kernels.h"

// Kernels of the noises in four and more dimensions.
namespace curlew {

#define CURLEW_OCTAVES(...) CURLEW_MODEL_KERNELS(detail::Octaves<__VA_ARGS__>)
#define CURLEW_NOISE(name, Noise, lowest, highest, summary) CURLEW_NOISE_ABOVE_3(CURLEW_OCTAVES, Noise, highest)
CURLEW_NOISES(CURLEW_NOISE)

} // namespace curlew
