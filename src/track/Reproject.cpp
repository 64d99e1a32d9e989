// SPDX-License-Identifier: Apache-2.0
#include "curlew/track/Reproject.h"

#include "TrackKernels.h"
#include "curlew/base/Require.h"
#include "curlew/field/Dimensions.h"

#include <algorithm>
#include <numeric>

namespace curlew {

namespace {

/// The points of a batch that still need corrections, packed.
template <int N>
struct Pending {
    PointBatchN<N> points;
    TrackBatchN<N> track;
    std::array<double, kBatch> limit;
    std::array<size_t, kBatch> lane; ///< Their indices in the batch.

    /// Keeps the points for which stays(i) holds.
    template <class Stays>
    void keep(const Stays& stays) {
        int count = 0;
        for (int i = 0; i < points.size; ++i) {
            const auto from = static_cast<size_t>(i), to = static_cast<size_t>(count);
            if (!stays(from)) continue;
            if (from != to) {
                points.set(count, points[i]);
                for (auto& values : track) values[to] = values[from];
                limit[to] = limit[from];
                lane[to] = lane[from];
            }
            ++count;
        }
        points.size = count;
    }
};

/// Packs the jets of the points for which done(i) does not hold.
template <int N, class Done>
void packJets(JetBatchN<double, N, 1>& jets, int size, const Done& done) {
    size_t to = 0;
    for (size_t i = 0; i < static_cast<size_t>(size); ++i) {
        if (done(i)) continue;
        for (auto& values : jets.c) values[to] = values[i];
        ++to;
    }
}

/// Takes a Newton step for potential `p` that leaves those from `firstKept` to p - 1 as they are.
template <int N>
void correctOne(const typename FlowN<N>::template Jets<double>& jets, size_t p, size_t firstKept,
                const std::array<double, kBatch>& residual, Pending<N>& pending) {
    runKernel<NewtonKernel<N>, double>(jets, std::as_const(p), std::as_const(firstKept), residual,
                                       std::as_const(pending.limit), pending.points);
}

/// Corrects a batch of which some points want one correction, and none must be evaluated again, which is usual within
/// adaptive steps. Returns false and does nothing for others.
template <int N>
bool correctAtOnce(PointBatchN<N>& points, const TrackBatchN<N>& track, const std::array<double, kBatch>& limit,
                   const ReprojectOptionsN<N>& options, const std::array<Correction, kBatch>& wanted,
                   const FlowBatchN<N>& here, ReprojectedBatchN<N>& result) {
    const auto size = static_cast<size_t>(points.size);
    const auto end = wanted.begin() + points.size;
    if (options.method != Reprojection::gaussNewton || std::find(wanted.begin(), end, Correction::once) == end)
        return false;
    Residuals<N> residuals;
    runKernel<ResidualKernel<N>, double>(here.potentials, std::as_const(points.size), track, options, residuals);
    for (size_t i = 0; i < size; ++i)
        if (wanted[i] == Correction::fully && residuals.converged[i] == 0) return false;
    result.velocity = here.velocity;
    result.residual = residuals.value;
    result.iterations.fill(0);
    for (size_t i = 0; i < size; ++i) result.converged[i] = residuals.converged[i] != 0;
    PointBatchN<N> corrected = points;
    runKernel<GaussNewtonKernel<N>, double>(here.potentials, std::as_const(residuals.value), limit, options, corrected);
    for (size_t i = 0; i < size; ++i)
        if (wanted[i] == Correction::once && residuals.converged[i] == 0)
            for (size_t axis = 0; axis < N; ++axis) points.c[axis][i] = corrected.c[axis][i];
    return true;
}

} // namespace

void ReprojectionOptions::validate(bool hasTracks) const {
    requirePositive(tolerance, "tolerance");
    if (iterations < 1) throw ValueError(fmt::format("{} iterations; give at least 1", iterations));
    if (maxSubdivisions < 0 || maxSubdivisions > 20)
        throw ValueError(fmt::format("{} subdivisions of a step; give 0 to 20", maxSubdivisions));
    if (method != Reprojection::none && !hasTracks)
        throw ValueError("this flow has no tracks to reproject onto; choose no reprojection");
}

template <int N>
ReprojectOptionsN<N> inUnitsOf(const FlowRmsN<N>& rms, const ReprojectionOptions& options) {
    ReprojectOptionsN<N> absolute{.method = options.method, .iterations = options.iterations};
    for (size_t q = 0; q < rms.potentials.size(); ++q) absolute.tolerance[q] = options.tolerance * rms.potentials[q];
    return absolute;
}

template <int N>
void reproject(const FlowN<N>& flow, PointBatchN<N>& points, const TrackBatchN<N>& track,
               const std::array<double, kBatch>& limit, const ReprojectOptionsN<N>& options,
               ReprojectedBatchN<N>& result) {
    if (points.size == 0) return;
    FlowBatchN<N> here;
    flow.eval(points, here.potentials, here.velocity);
    std::array<Correction, kBatch> all;
    all.fill(Correction::fully);
    reproject(flow, points, track, limit, options, all, here, result);
}

template <int N>
void reproject(const FlowN<N>& flow, PointBatchN<N>& points, const TrackBatchN<N>& track,
               const std::array<double, kBatch>& limit, const ReprojectOptionsN<N>& options,
               const std::array<Correction, kBatch>& wanted, FlowBatchN<N>& here, ReprojectedBatchN<N>& result) {
    if (options.method != Reprojection::none && !flow.hasTracks())
        throw ValueError("this flow has no tracks to reproject onto; move points without reprojection");
    if (correctAtOnce(points, track, limit, options, wanted, std::as_const(here), result)) return;
    Pending<N> pending{points, track, limit, {}};
    std::iota(pending.lane.begin(), pending.lane.end(), size_t{0});
    auto& potentials = here.potentials;
    Residuals<N> residuals;
    for (int iteration = 0; pending.points.size > 0; ++iteration) {
        if (iteration > 0) flow.eval(pending.points, potentials, here.velocity);
        runKernel<ResidualKernel<N>, double>(std::as_const(potentials), std::as_const(pending.points.size),
                                             std::as_const(pending.track), options, residuals);
        const bool last = iteration == options.iterations || options.method == Reprojection::none;
        const auto done = [&](size_t i) {
            return last || residuals.converged[i] != 0 || wanted[pending.lane[i]] != Correction::fully;
        };
        const auto blind = [&](size_t i) {
            return !last && residuals.converged[i] == 0 && wanted[pending.lane[i]] == Correction::once;
        };
        int left = 0, blindly = 0;
        for (int i = 0; i < pending.points.size; ++i) {
            const auto from = static_cast<size_t>(i);
            left += !done(from);
            blindly += blind(from);
            if (!done(from)) continue;
            const size_t to = pending.lane[from];
            for (size_t p = 0; p < track.size(); ++p) result.residual[p][to] = residuals.value[p][from];
            result.iterations[to] = iteration;
            result.converged[to] = residuals.converged[from] != 0;
            result.velocity.set(static_cast<int>(to), here.velocity[i]);
            points.set(static_cast<int>(to), pending.points[i]);
        }
        if (left + blindly == 0) return;
        if (options.method == Reprojection::newton)
            correctOne<N>(potentials, 0, 0, residuals.value[0], pending);
        else
            runKernel<GaussNewtonKernel<N>, double>(std::as_const(potentials), std::as_const(residuals.value),
                                                    std::as_const(pending.limit), options, pending.points);
        for (int i = 0; i < pending.points.size && blindly > 0; ++i)
            if (blind(static_cast<size_t>(i)))
                points.set(static_cast<int>(pending.lane[static_cast<size_t>(i)]), pending.points[i]);
        if (left == 0) return;
        if (left < pending.points.size) {
            if (options.method == Reprojection::newton) packJets(potentials[0], pending.points.size, done);
            pending.keep([&](size_t i) { return !done(i); });
        }
        // Newton corrects one potential after the other, each from where the previous one has moved the point. The
        // first pass is ICN Eq. 12. Repeated, that would converge only linearly, by the squared cosine of the angle
        // between the gradients, so later passes keep what they have corrected.
        for (size_t p = 1; p < track.size() && options.method == Reprojection::newton; ++p) {
            flow.potentials()[p].eval(pending.points, potentials[p]);
            for (size_t i = 0; i < static_cast<size_t>(pending.points.size); ++i)
                residuals.value[p][i] = potentials[p].c[0][i] - pending.track[p][i];
            correctOne<N>(potentials, p, iteration == 0 ? p : 0, residuals.value[p], pending);
        }
    }
}

#define CURLEW_INSTANTIATE(N)                                                                                       \
    template ReprojectOptionsN<N> inUnitsOf(const FlowRmsN<N>&, const ReprojectionOptions&);                        \
    template void reproject(const FlowN<N>&, PointBatchN<N>&, const TrackBatchN<N>&,                                \
                            const std::array<double, kBatch>&, const ReprojectOptionsN<N>&, ReprojectedBatchN<N>&); \
    template void reproject(const FlowN<N>&, PointBatchN<N>&, const TrackBatchN<N>&,                                \
                            const std::array<double, kBatch>&, const ReprojectOptionsN<N>&,                         \
                            const std::array<Correction, kBatch>&, FlowBatchN<N>&, ReprojectedBatchN<N>&);
CURLEW_FOR_FLOW_DIMENSIONS(CURLEW_INSTANTIATE)
#undef CURLEW_INSTANTIATE

} // namespace curlew
