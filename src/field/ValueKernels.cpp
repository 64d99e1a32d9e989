#include "NoiseModels.h"
#include "curlew/field/Kernels.h"

namespace curlew {

CURLEW_MODEL_KERNELS(detail::Octaves<ValueNoise<1>>)
CURLEW_MODEL_KERNELS(detail::Octaves<ValueNoise<2>>)
CURLEW_MODEL_KERNELS(detail::Octaves<ValueNoise<3>>)

} // namespace curlew
