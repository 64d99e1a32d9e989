// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/base/Error.h"
#include "curlew/flow/Domain.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace curlew::app {

/// Throws ValueError if the wall of a domain is so far from the origin that float positions cannot resolve its layer.
/// Points that are closer to the wall than the rounding error of their position count as beyond it (classify).
template <int N>
void requireResolution(const DomainN<N>& domain) {
    if (!domain.wall || !domain.box.finite()) return;
    double sum = 0, squares = 0;
    for (int axis = 0; axis < N; ++axis) {
        const double farthest = std::max(std::abs(domain.box.lower[axis]), std::abs(domain.box.upper[axis]));
        sum += farthest;
        squares += farthest * farthest;
    }
    constexpr double kRoundingErrors = 4; // minimum number in the layer
    const double needed = kRoundingErrors * kPositionRounding * sum, width = domain.wall->width;
    if (width >= needed) return;
    throw ValueError(
        fmt::format("the wall is {:.2g} units from the origin, where float positions are too coarse for its layer of "
                    "{:.3g}; move it towards the origin, or choose a layer of at least {:.2g}",
                    std::sqrt(squares), width, 1.05 * needed));
}

} // namespace curlew::app
