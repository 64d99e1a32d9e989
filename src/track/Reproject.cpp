#include "curlew/track/Reproject.h"

#include "curlew/base/Error.h"
#include "curlew/field/Dimensions.h"
#include "curlew/math/MinimumNorm.h"

#include <algorithm>
#include <numeric>

namespace curlew {

namespace {

/// The move along the gradient to the iso-surface, to first order; none where the gradient vanishes.
template <int N>
Vec<double, N> newtonMove(const Vec<double, N>& gradient, double residual) {
    const double squared = dot(gradient, gradient);
    return squared > 0 ? gradient * (-residual / squared) : Vec<double, N>{};
}

/// The smallest v with J v = -r. The functions that are farthest off, by their tolerance, come first: they win where
/// the gradients are nearly parallel.
template <int N, size_t M>
Vec<double, N> gaussNewtonMove(const std::array<Jet<double, N, 1>, M>& jets, const std::array<double, M>& residual,
                               const std::array<double, M>& tolerance) {
    std::array<size_t, M> order;
    std::iota(order.begin(), order.end(), size_t{0});
    std::sort(order.begin(), order.end(), [&](size_t a, size_t b) {
        return std::abs(residual[a]) * tolerance[b] > std::abs(residual[b]) * tolerance[a];
    });
    std::array<Vec<double, N>, M> J;
    std::array<double, M> r;
    for (size_t k = 0; k < M; ++k) {
        J[k] = jets[order[k]].gradient;
        r[k] = -residual[order[k]];
    }
    return minimumNorm(J, r);
}

template <int N>
Vec<double, N> limited(const Vec<double, N>& move, double limit) {
    const double size = length(move);
    return size > limit ? move * (limit / size) : move;
}

} // namespace

template <int N>
void reproject(const FlowN<N>& flow, PointBatchN<N>& points, const TrackBatchN<N>& track,
               const std::array<double, kBatch>& limit, const ReprojectOptionsN<N>& options,
               ReprojectedBatchN<N>& result) {
    constexpr size_t kPotentials = FlowN<N>::kPotentials;
    if (options.method != Reprojection::none && !flow.hasTracks())
        throw ValueError("this flow is a sum and has no tracks to be put back onto; move points without reprojection");
    // The points still to be corrected, and where they belong.
    PointBatchN<N> active = points;
    std::array<size_t, kBatch> lane;
    std::iota(lane.begin(), lane.end(), size_t{0});
    typename FlowN<N>::template Jets<double> potentials;
    VecBatchN<double, N> velocity;
    for (int iteration = 0; active.size > 0; ++iteration) {
        flow.eval(active, potentials, velocity);
        PointBatchN<N> rest;
        std::array<size_t, kBatch> restLane;
        for (int i = 0; i < active.size; ++i) {
            const size_t k = lane[static_cast<size_t>(i)];
            std::array<Jet<double, N, 1>, kPotentials> jets;
            std::array<double, kPotentials> residual;
            bool converged = true;
            for (size_t p = 0; p < kPotentials; ++p) {
                jets[p] = potentials[p][i];
                result.residual[p][k] = residual[p] = jets[p].value - track[p][k];
                converged = converged && std::abs(residual[p]) <= options.tolerance[p];
            }
            result.iterations[k] = iteration;
            result.converged[k] = converged;
            result.velocity.set(static_cast<int>(k), velocity[i]);
            points.set(static_cast<int>(k), active[i]);
            if (converged || iteration == options.iterations || options.method == Reprojection::none) continue;
            const Vec<double, N> move = options.method == Reprojection::newton
                                            ? newtonMove(jets[0].gradient, residual[0])
                                            : gaussNewtonMove(jets, residual, options.tolerance);
            restLane[static_cast<size_t>(rest.size)] = k;
            rest.push(active[i] + limited(move, limit[k]));
        }
        // Newton takes one function after the other, each where the one before has left the point.
        for (size_t p = 1; p < kPotentials && options.method == Reprojection::newton && rest.size > 0; ++p) {
            flow.potentials()[p].eval(rest, potentials[p]);
            for (int i = 0; i < rest.size; ++i) {
                const Jet<double, N, 1> jet = potentials[p][i];
                const size_t k = restLane[static_cast<size_t>(i)];
                rest.set(i, rest[i] + limited(newtonMove(jet.gradient, jet.value - track[p][k]), limit[k]));
            }
        }
        active = rest;
        lane = restLane;
    }
}

#define CURLEW_INSTANTIATE(N)                                                        \
    template void reproject(const FlowN<N>&, PointBatchN<N>&, const TrackBatchN<N>&, \
                            const std::array<double, kBatch>&, const ReprojectOptionsN<N>&, ReprojectedBatchN<N>&);
CURLEW_FOR_FLOW_DIMENSIONS(CURLEW_INSTANTIATE)
#undef CURLEW_INSTANTIATE

} // namespace curlew
