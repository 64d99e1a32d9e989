// SPDX-License-Identifier: Apache-2.0
#include "AlgebraModels.h"
#include "BoundModel.h"
#include "FunctionModel.h"
#include "MapModels.h"
#include "curlew/field/Kernels.h"
#include "curlew/field/ShapeModels.h"

namespace curlew {

using namespace detail;

CURLEW_MODEL_KERNELS(Constant<3>)
CURLEW_MODEL_KERNELS(Ramp<3>)
CURLEW_MODEL_KERNELS(Binary<3, Sum>)
CURLEW_MODEL_KERNELS(Binary<3, Difference>)
CURLEW_MODEL_KERNELS(Binary<3, Product>)
CURLEW_MODEL_KERNELS(Binary<3, Quotient>)
CURLEW_MODEL_KERNELS(Binary<3, SmoothMin>)
CURLEW_MODEL_KERNELS(Unary<3, Scaled>)
CURLEW_MODEL_KERNELS(Unary<3, Clip>)
CURLEW_MODEL_KERNELS(Unary<3, FunctionMap>)
CURLEW_MODEL_KERNELS(Bounded<3>)
template void runOnLanes<CURLEW_SIMD, BlendKernel, double>(const Bounded<3>&, const PointBatch&, JetBatch<double, 0>&);
CURLEW_MODEL_KERNELS(LayerRamp<3>)
CURLEW_MODEL_KERNELS(Affine<3, 3>)

#define CURLEW_SHAPE_KERNELS(Shape) CURLEW_MODEL_KERNELS(Formula<3, shapes::Shape>)
CURLEW_SHAPES(CURLEW_SHAPE_KERNELS)

} // namespace curlew
