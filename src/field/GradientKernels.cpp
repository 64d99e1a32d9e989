#include "NoiseModels.h"
#include "curlew/field/Kernels.h"

namespace curlew {

CURLEW_MODEL_KERNELS(detail::Octaves<GradientNoise<2>>)
CURLEW_MODEL_KERNELS(detail::Octaves<GradientNoise<3>>)

} // namespace curlew
