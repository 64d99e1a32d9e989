// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/flow/Domain.h"

#include <cmath>
#include <optional>

namespace curlew::detail {

/// Returns the point of the wall that Newton's method along the gradient of its distance finds from p. Returns nullopt
/// if p is too far from the wall, or the search fails or leaves the box.
inline std::optional<Vec3d> ontoWall(const Wall& wall, const Box& box, Vec3d p) {
    constexpr int kMaxIterations = 30;
    for (int k = 0; k < kMaxIterations; ++k) {
        const auto d = wall.sdf.distance.at<1>(p);
        if (k == 0 && std::abs(d.value) > std::max(wall.width, 0.5 * wall.sdf.reach)) return {};
        if (std::abs(d.value) < 1e-13 * (1 + length(p))) return box.contains(p) ? std::optional(p) : std::nullopt;
        const double squared = dot(d.gradient, d.gradient);
        if (!(squared > 1e-6)) return {};
        p -= d.gradient * (d.value / squared);
    }
    return {};
}

} // namespace curlew::detail
