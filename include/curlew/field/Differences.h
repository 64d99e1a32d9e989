// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/field/ScalarField.h"

namespace curlew {

/// Calls use(i, axis, derivative) for each point of the batch and each axis, with the central difference of the field's
/// values over ±h. Its error falls with h² where the field is C³; h is in world units.
template <int N, class Use>
void forCentralDifferences(const ScalarFieldN<N>& field, const PointBatchN<N>& points, double h, const Use& use) {
    for (int axis = 0; axis < N; ++axis) {
        PointBatchN<N> above = points, below = points;
        for (int i = 0; i < points.size; ++i) {
            above.c[static_cast<size_t>(axis)][static_cast<size_t>(i)] += h;
            below.c[static_cast<size_t>(axis)][static_cast<size_t>(i)] -= h;
        }
        JetBatchN<double, N, 0> up, down;
        field.eval(above, up);
        field.eval(below, down);
        for (int i = 0; i < points.size; ++i) use(i, axis, (up[i].value - down[i].value) / (2 * h));
    }
}

} // namespace curlew
