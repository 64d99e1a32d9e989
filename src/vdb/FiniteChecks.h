// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/base/Error.h"

#include <fmt/format.h>

#include <cmath>
#include <string_view>

namespace curlew {

/// Throws ValueError if a position or a velocity of points or curves is not finite. `what` names an element: "point".
template <class PointsOrCurves>
void requireFinite(const PointsOrCurves& p, std::string_view what) {
    const auto check = [&](const auto& values, std::string_view property) {
        for (size_t n = 0; n < values.size(); ++n)
            if (!std::isfinite(values[n]))
                throw ValueError(
                    fmt::format("{} {} has a {} that is not finite; other programs cannot read it", what, n, property));
    };
    for (const auto* values : {&p.x, &p.y, &p.z}) check(*values, "position");
    for (const auto* values : {&p.vx, &p.vy, &p.vz}) check(*values, "velocity");
}

} // namespace curlew
