// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/field/ScalarField.h"
#include "curlew/math/LaneKernels.h"

// NOLINTBEGIN(bugprone-macro-parentheses): the arguments are template arguments
#define CURLEW_MODEL_KERNEL(T, Order, ...)                                        \
    template void curlew::runOnLanes<CURLEW_SIMD, curlew::ModelKernel<Order>, T>( \
        const __VA_ARGS__&, const PointBatchN<__VA_ARGS__::kDimension>&,          \
        JetBatchN<T, __VA_ARGS__::kDimension, Order>&);
/// For files named *Kernels.cpp: instantiates a model of a field for lanes, with derivatives up to order 1 in float and
/// 2 in double.
#define CURLEW_MODEL_KERNELS(...)               \
    CURLEW_MODEL_KERNEL(float, 0, __VA_ARGS__)  \
    CURLEW_MODEL_KERNEL(float, 1, __VA_ARGS__)  \
    CURLEW_MODEL_KERNEL(double, 0, __VA_ARGS__) \
    CURLEW_MODEL_KERNEL(double, 1, __VA_ARGS__) \
    CURLEW_MODEL_KERNEL(double, 2, __VA_ARGS__)
// NOLINTEND(bugprone-macro-parentheses)
