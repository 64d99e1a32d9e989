// SPDX-License-Identifier: Apache-2.0
#include "NoiseModels.h"
#include "curlew/field/Kernels.h"

// Kernels of the noises in one and two dimensions.
namespace curlew {

#define CURLEW_OCTAVES(...) CURLEW_MODEL_KERNELS(detail::Octaves<__VA_ARGS__>)
#define CURLEW_NOISE(name, Noise, lowest, highest, summary) CURLEW_NOISE_BELOW_3(CURLEW_OCTAVES, Noise, lowest)
CURLEW_NOISES(CURLEW_NOISE)

} // namespace curlew
