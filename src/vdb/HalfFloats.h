// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "DenseBox.h"
#include "curlew/base/Error.h"
#include "curlew/vdb/Openvdb.h"

#include <openvdb/tools/Count.h>

#include <algorithm>
#include <cmath>

namespace curlew {

inline constexpr double kLargestHalf = 65504; ///< The largest 16-bit float.

/// Returns the greatest magnitude of the finite active values of a grid of floats or vectors, or of their components.
inline double largestValue(const openvdb::GridBase& grid) {
    double most = 0;
    const auto see = [&](double value) {
        if (std::isfinite(value)) most = std::max(most, std::abs(value));
    };
    grid.apply<openvdb::TypeList<openvdb::FloatGrid, openvdb::DoubleGrid>>([&](const auto& typed) {
        const auto range = openvdb::tools::minMax(typed.tree());
        see(static_cast<double>(range.min()));
        see(static_cast<double>(range.max()));
    });
    grid.apply<openvdb::TypeList<openvdb::Vec3SGrid, openvdb::Vec3DGrid>>([&](const auto& typed) {
        for (auto value = typed.cbeginValueOn(); value; ++value)
            for (int axis = 0; axis < 3; ++axis) see(static_cast<double>((*value)[axis]));
    });
    return most;
}

/// Returns whether to write a grid as 16-bit floats: if that is `asked` for, or its metadata says so and its values
/// fit. Throws ValueError if it is asked for and values would become infinite.
inline bool writesHalf(const openvdb::GridBase& grid, bool asked) {
    if (!asked && !grid.saveFloatAsHalf()) return false;
    const double most = largestValue(grid);
    if (most > kLargestHalf && asked)
        throw ValueError(fmt::format("{} has values up to {:.3g}, but 16-bit floats end at {}; leave out half=1",
                                     titleOf(grid), most, kLargestHalf));
    return most <= kLargestHalf;
}

} // namespace curlew
