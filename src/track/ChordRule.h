#pragma once

#include "curlew/flow/Domain.h"

namespace curlew {

/// Takes back moves near the wall that are longer than its width, or whose chord leads through it: a point of it lies
/// beyond the wall by more than 1/16 of its length. `distance` is that to the wall at `from`; taken[i] becomes false.
template <int N>
void checkChords(const DomainN<N>& domain, const PointBatchN<N>& from, const PointBatchN<N>& to,
                 const std::array<double, kBatch>& distance, std::array<bool, kBatch>& taken) {
    if (!domain.wall) return;
    const WallN<N>& wall = *domain.wall;
    constexpr int kSamples = 3;
    PointBatchN<N> samples;
    std::array<int, kBatch> owner;
    const auto judge = [&] {
        JetBatchN<double, N, 0> d;
        wall.sdf.distance.eval(samples, d);
        for (size_t s = 0; s < static_cast<size_t>(samples.size); ++s) {
            const auto i = static_cast<size_t>(owner[s]);
            // On which side the chord has to stay: for `both`, the side on which it began.
            const Side side = wall.side != Side::both ? wall.side : distance[i] < 0 ? Side::inside : Side::outside;
            if (!(beyondWall(side, d.c[0][s]) <= length(to[owner[s]] - from[owner[s]]) / 16)) taken[i] = false;
        }
        samples.size = 0;
    };
    for (int i = 0; i < from.size; ++i) {
        if (!taken[static_cast<size_t>(i)]) continue;
        const Vec<double, N> move = to[i] - from[i];
        const double chord = length(move);
        if (std::abs(distance[static_cast<size_t>(i)]) > chord) continue;
        if (chord > wall.width) {
            taken[static_cast<size_t>(i)] = false;
            continue;
        }
        if (samples.size + kSamples > kBatch) judge();
        for (int k = 1; k <= kSamples; ++k) {
            owner[static_cast<size_t>(samples.size)] = i;
            samples.push(from[i] + move * (double(k) / (kSamples + 1)));
        }
    }
    judge();
}

} // namespace curlew
