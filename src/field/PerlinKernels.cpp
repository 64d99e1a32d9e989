#include "NoiseModels.h"
#include "curlew/field/Kernels.h"

namespace curlew {

CURLEW_MODEL_KERNELS(detail::Octaves<PerlinNoise<1>>)
CURLEW_MODEL_KERNELS(detail::Octaves<PerlinNoise<2>>)
CURLEW_MODEL_KERNELS(detail::Octaves<PerlinNoise<3>>)

} // namespace curlew
