#include "NoiseModels.h"
#include "curlew/field/Kernels.h"

namespace curlew {

CURLEW_MODEL_KERNELS(detail::Octaves<Psrd2>)
CURLEW_MODEL_KERNELS(detail::Octaves<Psrd3>)

} // namespace curlew
