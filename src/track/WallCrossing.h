// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/flow/Domain.h"

#include <algorithm>
#include <cmath>

namespace curlew {

/// Returns whether the segment between two points crosses the wall, by sphere tracing (Hart 1996). Detects parts of the
/// wall that are thicker than 1/64 of the segment.
template <int N>
bool meetsWall(const WallN<N>& wall, const Vec<double, N>& from, const Vec<double, N>& to) {
    // the minimum step, because near the wall steps would become too many
    const double chord = length(to - from), shortest = chord / 64;
    const auto distance = [&](double travelled) {
        return wall.sdf.distance.template at<0>(from + (to - from) * (travelled / chord)).value;
    };
    const double begin = distance(0), side = begin < 0 ? -1 : 1;
    for (double clear = side * begin, travelled = 0;;) {
        travelled += std::max(clear / wall.sdf.lipschitz, shortest);
        if (travelled >= chord) return false;
        clear = side * distance(travelled);
        if (clear < shortest / 4) return true;
    }
}

/// Rejects steps that cross a thin part of the wall to its other side: at the two ends the wall faces opposite
/// directions, and the wall lies between them. `chord`: lengths of the steps; `before`, `after`: distances from the
/// wall at the ends.
template <int N>
void rejectCrossings(const DomainN<N>& domain, const PointBatchN<N>& from, const PointBatchN<N>& to,
                     const std::array<double, kBatch>& chord, const std::array<double, kBatch>& before,
                     const std::array<double, kBatch>& after, std::array<bool, kBatch>& accepted) {
    if (!domain.wall) return;
    const WallN<N>& wall = *domain.wall;
    PointBatchN<N> begins, ends;
    std::array<size_t, kBatch> owner;
    for (int i = 0; i < from.size; ++i) {
        const auto k = static_cast<size_t>(i);
        // A shorter step does not reach the wall.
        if (!accepted[k] || std::abs(before[k]) + std::abs(after[k]) > wall.sdf.lipschitz * chord[k]) continue;
        owner[static_cast<size_t>(begins.size)] = k;
        begins.push(from[i]);
        ends.push(to[i]);
    }
    if (begins.size == 0) return;
    JetBatchN<double, N, 1> begin, end;
    wall.sdf.distance.eval(begins, begin);
    wall.sdf.distance.eval(ends, end);
    for (int i = 0; i < begins.size; ++i)
        if (dot(begin[i].gradient, end[i].gradient) < 0 && meetsWall(wall, begins[i], ends[i]))
            accepted[owner[static_cast<size_t>(i)]] = false;
}

} // namespace curlew
