#include "NoiseModels.h"
#include "curlew/field/Kernels.h"

namespace curlew {

CURLEW_MODEL_KERNELS(detail::Octaves<SimplexNoise<2>>)
CURLEW_MODEL_KERNELS(detail::Octaves<SimplexNoise<3>>)
CURLEW_MODEL_KERNELS(detail::Octaves<SimplexNoise<4>>)
CURLEW_MODEL_KERNELS(detail::Octaves<SimplexNoise<5>>)
CURLEW_MODEL_KERNELS(detail::Octaves<SimplexNoise<6>>)
CURLEW_MODEL_KERNELS(detail::Octaves<SimplexNoise<7>>)

} // namespace curlew
