// SPDX-License-Identifier: Apache-2.0
#include "curlew/field/LayerFit.h"

#include "curlew/base/Random.h"
#include "curlew/base/Require.h"
#include "curlew/field/Dimensions.h"
#include "curlew/field/ForEachBatch.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace curlew {

namespace {

constexpr size_t kEnough = 2048, kMaxCandidates = size_t{1} << 17;
constexpr uint64_t kSeed = 0x6c61796572; // an arbitrary constant
constexpr int kSteps = 16;               ///< Over the width, or over half the shape where that is narrower.
constexpr double kMaxMissed = 0.75; ///< In steps. On the medial axis the depth rises by less than its slope predicts.

template <int N>
struct Depths {
    std::array<double, kBatch> depth{}, slope{};
    std::array<Vec<double, N>, kBatch> inwards{}; ///< Unit vectors.

    Depths(const SdfN<N>& sdf, const PointBatchN<N>& points) {
        JetBatchN<double, N, 1> jets;
        sdf.distance.eval(points, jets);
        for (int i = 0; i < points.size; ++i) {
            const auto jet = jets[i];
            const auto n = static_cast<size_t>(i);
            depth[n] = -jet.value;
            slope[n] = length(jet.gradient);
            if (slope[n] > 0) inwards[n] = jet.gradient * (-1 / slope[n]);
        }
    }
};

/// Returns the positions inside the shape among the next kBatch candidates.
template <int N>
PointBatchN<N> insideAmong(const SdfN<N>& sdf, size_t begin) {
    const auto size = sdf.bounds.size();
    PointBatchN<N> candidates, inside;
    for (size_t k = begin; k < begin + kBatch; ++k) {
        Vec<double, N> p;
        for (int axis = 0; axis < N; ++axis)
            p[axis] = sdf.bounds.lower[axis] + size[axis] * randomUniform(kSeed, k, static_cast<uint64_t>(axis));
        candidates.push(p);
    }
    JetBatchN<double, N, 0> d;
    sdf.distance.eval(candidates, d);
    for (int i = 0; i < candidates.size; ++i)
        if (d.c[0][static_cast<size_t>(i)] < 0) inside.push(candidates[i]);
    return inside;
}

/// Returns the step on the paths inwards.
template <int N>
double stepIn(const WallN<N>& wall) {
    double most = wall.width;
    const auto size = wall.sdf.bounds.size();
    for (int axis = 0; axis < N; ++axis) most = std::min(most, size[axis] / 2);
    return most / kSteps;
}

/// Follows the paths inwards from these positions until they end or reach the width; appends their depths to `reached`.
template <int N>
void follow(const WallN<N>& wall, const PointBatchN<N>& begin, double step, std::vector<double>& reached) {
    PointBatchN<N> points = begin;
    Depths<N> now(wall.sdf, points);
    std::array<bool, kBatch> ended{};
    std::array<double, kBatch> missed{}; // how much less the depth rose than its slope predicted, in total
    for (int k = 0; k < 2 * kSteps; ++k) {
        PointBatchN<N> next = points;
        for (int i = 0; i < points.size; ++i)
            if (!ended[static_cast<size_t>(i)]) next.set(i, points[i] + now.inwards[static_cast<size_t>(i)] * step);
        Depths<N> then(wall.sdf, next);
        for (int i = 0; i < points.size; ++i) {
            const auto n = static_cast<size_t>(i);
            missed[n] += now.slope[n] * step - (then.depth[n] - now.depth[n]);
            ended[n] = ended[n] || now.depth[n] >= wall.width || !(missed[n] < kMaxMissed * now.slope[n] * step);
            if (!ended[n]) continue;
            next.set(i, points[i]);
            then.depth[n] = now.depth[n];
            then.slope[n] = now.slope[n];
            then.inwards[n] = now.inwards[n];
        }
        points = next;
        now = then;
    }
    reached.insert(reached.end(), now.depth.begin(), now.depth.begin() + points.size);
}

} // namespace

template <int N>
LayerFit layerFit(const WallN<N>& wall) {
    requirePositive(wall.width, "width");
    LayerFit fit{.fitting = wall.width};
    if (!wall.sdf.bounds.finite()) return fit;
    const double step = stepIn(wall);
    std::vector<double> reached;
    for (size_t k = 0; k < kMaxCandidates && reached.size() < kEnough; k += kBatch)
        if (const auto inside = insideAmong(wall.sdf, k); inside.size > 0) follow(wall, inside, step, reached);
    if (reached.empty()) return fit;
    // A path may end up to one step short of the width.
    const auto stopped =
        std::count_if(reached.begin(), reached.end(), [&](double depth) { return depth < wall.width - step; });
    fit.unreached = static_cast<double>(stopped) / static_cast<double>(reached.size());
    if (fit.unreached <= kMaxUnreached) return fit;
    std::sort(reached.begin(), reached.end());
    fit.fitting = reached[static_cast<size_t>(kMaxUnreached * static_cast<double>(reached.size()))];
    return fit;
}

#define CURLEW_INSTANTIATE(N) template LayerFit layerFit(const WallN<N>&);
CURLEW_FOR_DIMENSIONS(CURLEW_INSTANTIATE)
#undef CURLEW_INSTANTIATE

} // namespace curlew
