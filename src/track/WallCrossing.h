// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/flow/Domain.h"

#include <algorithm>
#include <cmath>

namespace curlew {

/// Whether the straight way between two points meets the wall: by sphere tracing (Hart 1996). It sees a part of the
/// wall that is thicker than 1/64 of the way.
template <int N>
bool meetsWall(const WallN<N>& wall, const Vec<double, N>& from, const Vec<double, N>& to) {
    const double chord = length(to - from), least = chord / 64; // of a step: near the wall it would take too many
    const auto distance = [&](double way) {
        return wall.sdf.distance.template at<0>(from + (to - from) * (way / chord)).value;
    };
    const double begin = distance(0), side = begin < 0 ? -1 : 1;
    for (double clear = side * begin, way = 0;;) {
        way += std::max(clear / wall.sdf.steepness, least);
        if (way >= chord) return false;
        clear = side * distance(way);
        if (clear < least / 4) return true;
    }
}

/// Rejects steps that lead from one side of a thin part of the wall to its other side: the wall faces the other way
/// where they end, and lies between. `before`, `after`: the distances from the wall at both ends.
template <int N>
void rejectCrossings(const DomainN<N>& domain, const PointBatchN<N>& from, const PointBatchN<N>& to,
                     const std::array<double, kBatch>& before, const std::array<double, kBatch>& after,
                     std::array<bool, kBatch>& accepted) {
    if (!domain.wall) return;
    const WallN<N>& wall = *domain.wall;
    PointBatchN<N> begins, ends;
    std::array<size_t, kBatch> owner;
    for (int i = 0; i < from.size; ++i) {
        const auto k = static_cast<size_t>(i);
        // A way that is shorter does not reach the wall.
        const double reach = wall.sdf.steepness * length(to[i] - from[i]);
        if (!accepted[k] || std::abs(before[k]) + std::abs(after[k]) > reach) continue;
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
