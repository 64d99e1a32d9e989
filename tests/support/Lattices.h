// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/field/ScalarField.h"

#include <bit>
#include <vector>

namespace curlew::test {

/// Returns `count` coordinates, `step` apart.
inline std::vector<double> coordinates(double first, double step, size_t count) {
    std::vector<double> made(count);
    for (size_t k = 0; k < count; ++k) made[k] = first + static_cast<double>(k) * step;
    return made;
}

/// Returns at how many positions of a lattice the bits of the values differ from those at single positions.
inline size_t differing(const ScalarField& field, const PointLattice& lattice) {
    std::vector<double> values(lattice.size(), -1);
    field.eval(lattice, values);
    size_t n = 0, count = 0;
    for (const double x : lattice.coordinates[0])
        for (const double y : lattice.coordinates[1])
            for (const double z : lattice.coordinates[2])
                count += std::bit_cast<uint64_t>(values[n++]) !=
                         std::bit_cast<uint64_t>(field.at<0>(Vec3d{{x, y, z}}).value);
    return count;
}

} // namespace curlew::test
