// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/field/ScalarField.h"

#include <cstring>
#include <vector>

namespace curlew::test {

/// Returns `count` coordinates, `step` apart.
inline std::vector<double> coordinates(double first, double step, size_t count) {
    std::vector<double> made(count);
    for (size_t k = 0; k < count; ++k) made[k] = first + static_cast<double>(k) * step;
    return made;
}

/// Returns at how many positions of a lattice the bits of a jet differ from those at single positions.
template <class T, int Order>
size_t differing(const ScalarField& field, const PointLattice& lattice) {
    const auto on = field.onLattice<T, Order>(lattice);
    size_t count = 0;
    lattice.forEachBatch([&](const LatticeBatch& batch) {
        JetBatch<T, Order> jets;
        on(batch, jets);
        const PointBatch& points = batch.points();
        for (int i = 0; i < points.size; ++i) {
            const auto together = jets[i], alone = field.at<Order, T>(points[i]);
            count += std::memcmp(&together, &alone, sizeof(alone)) != 0;
        }
    });
    return count;
}
inline size_t differing(const ScalarField& field, const PointLattice& lattice) {
    return differing<double, 0>(field, lattice) + differing<float, 1>(field, lattice);
}

} // namespace curlew::test
