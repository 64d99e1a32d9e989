#include "NoiseModels.h"
#include "curlew/field/Kernels.h"

namespace curlew {

CURLEW_MODEL_KERNELS(detail::Octaves<SineNoise<1>>)
CURLEW_MODEL_KERNELS(detail::Octaves<SineNoise<2>>)
CURLEW_MODEL_KERNELS(detail::Octaves<SineNoise<3>>)

} // namespace curlew
