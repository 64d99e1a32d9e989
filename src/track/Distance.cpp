// SPDX-License-Identifier: Apache-2.0
#include "curlew/track/Distance.h"

#include "curlew/base/Error.h"
#include "curlew/base/Memory.h"
#include "curlew/base/PacedMonitor.h"
#include "curlew/base/Parallel.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace curlew {

namespace {

struct Sums {
    size_t pairs = 0;
    double sum = 0, squares = 0, max = 0;

    void add(double distance) {
        ++pairs;
        sum += distance;
        squares += distance * distance;
        max = std::max(max, distance);
    }
    Sums& operator+=(const Sums& other) {
        pairs += other.pairs;
        sum += other.sum;
        squares += other.squares;
        max = std::max(max, other.max);
        return *this;
    }
};

Distance distanceOf(const Sums& sums, const char* what, size_t unmatched) {
    if (sums.pairs == 0) throw ValueError(fmt::format("the two sets have no {} with the same id", what));
    const auto count = static_cast<double>(sums.pairs);
    return {sums.pairs, sums.sum / count, std::sqrt(sums.squares / count), sums.max, unmatched};
}

/// Returns pairs of id and index, sorted by id.
std::vector<std::pair<int64_t, size_t>> placesOf(const std::vector<int64_t>& ids, const Monitor& monitor) {
    std::vector<std::pair<int64_t, size_t>> places(ids.size());
    for (size_t k = 0; k < ids.size(); ++k) places[k] = {ids[k], k};
    std::sort(places.begin(), places.end(), [ask = PacedMonitor(monitor)](const auto& p, const auto& q) {
        ask();
        return p < q;
    });
    for (size_t k = 1; k < places.size(); ++k)
        if (places[k].first == places[k - 1].first)
            throw ValueError(fmt::format("the id {} occurs twice", places[k].first));
    return places;
}

/// Returns pairs of indices with the same id.
std::vector<std::pair<size_t, size_t>> pairsOf(const std::vector<int64_t>& a, const std::vector<int64_t>& b,
                                               const Monitor& monitor) {
    std::vector<std::pair<size_t, size_t>> pairs;
    const size_t most = std::min(a.size(), b.size());
    requireMemory(static_cast<double>(a.size() + b.size() + most) * sizeof pairs[0],
                  fmt::format("the pairs of {} and {} elements", a.size(), b.size()), "compare fewer");
    const auto first = placesOf(a, monitor), second = placesOf(b, monitor);
    pairs.reserve(most);
    auto other = second.begin();
    for (const auto& [id, place] : first) {
        while (other != second.end() && other->first < id) ++other;
        if (other != second.end() && other->first == id) pairs.emplace_back(place, other->second);
    }
    return pairs;
}

double squaredDistance(const Vec3d& p, const Vec3d& a, const Vec3d& b) {
    const Vec3d edge = b - a, from = p - a;
    const double squared = dot(edge, edge), part = squared > 0 ? std::clamp(dot(from, edge) / squared, 0.0, 1.0) : 0;
    const Vec3d apart = from - edge * part;
    return dot(apart, apart);
}

double distanceTo(const Curves& c, size_t curve, const Vec3d& p) {
    const size_t begin = c.start[curve], end = c.start[curve + 1];
    double least = squaredDistance(p, c.position(begin), c.position(begin));
    for (size_t v = begin; v + 1 < end; ++v)
        least = std::min(least, squaredDistance(p, c.position(v), c.position(v + 1)));
    if (c.closed(curve)) least = std::min(least, squaredDistance(p, c.position(end - 1), c.position(begin)));
    return std::sqrt(least);
}

} // namespace

Distance distanceBetween(const Points& a, const Points& b, const Monitor& monitor) {
    const auto pairs = pairsOf(a.id, b.id, monitor);
    const Sums sums = parallelSum(
        pairs.size(), 4096,
        [&](size_t begin, size_t end) {
            Sums mine;
            for (size_t k = begin; k < end; ++k) {
                const auto [p, q] = pairs[k];
                mine.add(length(Vec3d{{a.x[p] - b.x[q], a.y[p] - b.y[q], a.z[p] - b.z[q]}}));
            }
            return mine;
        },
        monitor);
    return distanceOf(sums, "point", a.size() + b.size() - 2 * pairs.size());
}

Distance distanceBetween(const Curves& a, const Curves& b, const Monitor& monitor) {
    const auto pairs = pairsOf(a.id, b.id, monitor);
    const Sums sums = parallelSum(
        pairs.size(), 1,
        [&](size_t begin, size_t end) {
            Sums mine;
            for (size_t k = begin; k < end; ++k) {
                const auto [p, q] = pairs[k];
                if (b.start[q] == b.start[q + 1]) continue; // its seed is outside the domain
                for (size_t v = a.start[p]; v < a.start[p + 1]; ++v) mine.add(distanceTo(b, q, a.position(v)));
            }
            return mine;
        },
        monitor);
    return distanceOf(sums, "curve", a.size() + b.size() - 2 * pairs.size());
}

} // namespace curlew
