// SPDX-License-Identifier: Apache-2.0
#include "AlgebraModels.h"
#include "BoundModel.h"
#include "FunctionModel.h"
#include "MapModels.h"
#include "curlew/field/Kernels.h"
#include "curlew/field/ShapeModels.h"

namespace curlew {

using namespace detail;

namespace {

template <class Combine>
using Binary3 = Binary<3, Combine>;
template <class Map>
using Unary3 = Unary<3, Map>;

} // namespace

// NOLINTBEGIN(bugprone-macro-parentheses): the arguments are template arguments and types
#define CURLEW_APPLY_KERNEL(T, Order, Model, ...)                                          \
    template void runOnLanes<CURLEW_SIMD, ApplyKernel<Order>, T>(const Model&, const int&, \
                                                                 JetBatch<T, Order>& __VA_OPT__(, ) __VA_ARGS__);
#define CURLEW_BINARY_KERNELS(Combine)                                         \
    CURLEW_MODEL_KERNELS(Binary3<Combine>)                                     \
    CURLEW_APPLY_KERNEL(float, 1, Binary3<Combine>, const JetBatch<float, 1>&) \
    CURLEW_APPLY_KERNEL(double, 0, Binary3<Combine>, const JetBatch<double, 0>&)
#define CURLEW_UNARY_KERNELS(Map)              \
    CURLEW_MODEL_KERNELS(Unary3<Map>)          \
    CURLEW_APPLY_KERNEL(float, 1, Unary3<Map>) \
    CURLEW_APPLY_KERNEL(double, 0, Unary3<Map>)
// NOLINTEND(bugprone-macro-parentheses)

CURLEW_BINARY_KERNELS(Sum)
CURLEW_BINARY_KERNELS(Difference)
CURLEW_BINARY_KERNELS(Product)
CURLEW_BINARY_KERNELS(Quotient)
CURLEW_BINARY_KERNELS(SmoothMin)
CURLEW_UNARY_KERNELS(Scaled)
CURLEW_UNARY_KERNELS(Clip)
CURLEW_UNARY_KERNELS(FunctionMap)
CURLEW_UNARY_KERNELS(LayerFade)
CURLEW_UNARY_KERNELS(LayerRamp)

#define CURLEW_BLEND_KERNEL(T, Order)                                                                  \
    template void runOnLanes<CURLEW_SIMD, BlendKernel<Order>, T>(const Bounded<3>&, const PointBatch&, \
                                                                 JetBatch<T, Order>&);
CURLEW_BLEND_KERNEL(float, 1)
CURLEW_BLEND_KERNEL(double, 0)
#undef CURLEW_BLEND_KERNEL

CURLEW_MODEL_KERNELS(Constant<3>)
CURLEW_MODEL_KERNELS(Ramp<3>)
CURLEW_MODEL_KERNELS(Bounded<3>)
CURLEW_MODEL_KERNELS(Affine<3, 3>)

#define CURLEW_SHAPE_KERNELS(Shape) CURLEW_MODEL_KERNELS(Formula<3, shapes::Shape>)
CURLEW_SHAPES(CURLEW_SHAPE_KERNELS)

} // namespace curlew
