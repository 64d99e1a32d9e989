// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/track/Reproject.h"
#include "curlew/track/StepRule.h"

namespace curlew {

template <int N>
struct MoveKernel {
    template <class T>
    static void run(const PointBatchN<N>& from, const VecBatchN<double, N>& velocity, const double& fraction,
                    const std::array<double, kBatch>& dt, PointBatchN<N>& to) {
        to.size = from.size;
        for (int i = 0; i < from.size; i += kLanes<T>) {
            const T h = T(fraction) * load<T>(&dt[static_cast<size_t>(i)]);
            Vec<T, N> p = from.template lanes<T>(i);
            const Vec<T, N> v = velocity.template lanes<T>(i);
            for (int k = 0; k < N; ++k) p[k] = mulAdd(v[k], h, p[k]);
            to.set(i, p);
        }
    }
};

template <int N>
struct CombineKernel {
    template <class T>
    static void run(const int& size, const std::array<double, Tableau::kMaxStages>& weights, const StagesN<N>& stages,
                    VecBatchN<double, N>& sum) {
        for (int i = 0; i < size; i += kLanes<T>)
            sum.set(i, weightedSum<T, N>(weights, [&](size_t k) { return stages[k].template lanes<T>(i); }));
    }
};

/// Computes the lengths of moves.
template <int N>
struct LengthKernel {
    template <class T>
    static void run(const PointBatchN<N>& from, const PointBatchN<N>& to, std::array<double, kBatch>& lengths) {
        for (int i = 0; i < from.size; i += kLanes<T>)
            store(length(to.template lanes<T>(i) - from.template lanes<T>(i)), &lengths[static_cast<size_t>(i)]);
    }
};

/// Computes the estimated errors of steps from the differences of two solutions, which are divided by dt. If the rms
/// speed is known (not 0), they are weighted as delays where the flow is slower than that.
template <int N>
struct StepErrorKernel {
    static constexpr double kMostWeight = 1024; ///< It is unbounded at a stagnation point.

    template <class T>
    static void run(const int& size, const VecBatchN<double, N>& difference, const std::array<double, kBatch>& dt,
                    const VecBatchN<double, N>& first, const VecBatchN<double, N>& last, const double& rmsSpeed,
                    std::array<double, kBatch>& error) {
        for (int i = 0; i < size; i += kLanes<T>) {
            const auto n = static_cast<size_t>(i);
            T here = abs(load<T>(&dt[n])) * length(difference.template lanes<T>(i));
            if (rmsSpeed > 0) {
                const T speed = min(length(first.template lanes<T>(i)), length(last.template lanes<T>(i)));
                const T weight = select(speed * T(kMostWeight) > T(rmsSpeed), T(rmsSpeed) / speed, T(kMostWeight));
                here = here * max(weight, T(1));
            }
            store(here, &error[n]);
        }
    }
};

/// Computes whether points are at most `distance` from their tracks, to first order: 1, or 0, also if that is unknown.
template <int N>
struct NearTrackKernel {
    template <class T, class Jets>
    static void run(const Jets& jets, const int& size, const TrackBatchN<N>& track, const double& distance,
                    std::array<double, kBatch>& near) {
        for (int i = 0; i < size; i += kLanes<T>) {
            const auto n = static_cast<size_t>(i);
            T all(1);
            for (size_t q = 0; q < track.size(); ++q) {
                const auto jet = jets[q].template lanes<T>(i);
                const T off = jet.value - load<T>(&track[q][n]), slope = dot(jet.gradient, jet.gradient);
                all = select((slope > T(0)) & (off * off <= T(distance * distance) * slope), all, T(0));
            }
            store(all, &near[n]);
        }
    }
};

/// The residuals of a batch during reprojection.
template <int N>
struct Residuals {
    TrackBatchN<N> value;
    std::array<double, kBatch> converged; ///< 1 or 0.
};

/// Computes the potentials minus the track's values.
template <int N>
struct ResidualKernel {
    template <class T, class Jets>
    static void run(const Jets& jets, const int& size, const TrackBatchN<N>& track, const ReprojectOptionsN<N>& options,
                    Residuals<N>& residuals) {
        for (int i = 0; i < size; i += kLanes<T>) {
            const auto n = static_cast<size_t>(i);
            T converged(1);
            for (size_t p = 0; p < track.size(); ++p) {
                const T r = load<T>(&jets[p].c[0][n]) - load<T>(&track[p][n]);
                store(r, &residuals.value[p][n]);
                converged = select(abs(r) <= T(options.tolerance[p]), converged, T(0));
            }
            store(converged, &residuals.converged[n]);
        }
    }
};

/// Takes a Gauss-Newton step (StepRule.h).
template <int N>
struct GaussNewtonKernel {
    template <class T, class Jets>
    static void run(const Jets& jets, const TrackBatchN<N>& residual, const std::array<double, kBatch>& limit,
                    const ReprojectOptionsN<N>& options, PointBatchN<N>& points) {
        for (int i = 0; i < points.size; i += kLanes<T>) {
            const auto n = static_cast<size_t>(i);
            constexpr size_t kM{N - 1};
            std::array<Vec<T, N>, kM> J;
            std::array<T, kM> r;
            for (size_t p = 0; p < kM; ++p) {
                J[p] = jets[p].template lanes<T>(i).gradient;
                r[p] = -load<T>(&residual[p][n]);
            }
            points.set(i, gaussNewtonMoved(points.template lanes<T>(i), J, r, options.tolerance, load<T>(&limit[n])));
        }
    }
};

/// Takes a Newton step for potential `p`: by the smallest move to its iso-surface, to first order, that leaves the
/// potentials from `firstKept` to p - 1 as they are. Does not move the point where there is none.
template <int N>
struct NewtonKernel {
    template <class T, class Jets>
    static void run(const Jets& jets, const size_t& p, const size_t& firstKept,
                    const std::array<double, kBatch>& residual, const std::array<double, kBatch>& limit,
                    PointBatchN<N>& points) {
        constexpr double kParallel = 1e-6; // squared sine of an angle
        for (int i = 0; i < points.size; i += kLanes<T>) {
            const auto n = static_cast<size_t>(i);
            std::array<Vec<T, N>, size_t{N - 1}> J{}; // no move depends on a row of zeros
            std::array<T, size_t{N - 1}> r{};
            for (size_t k = firstKept; k <= p; ++k) J[k] = jets[k].template lanes<T>(i).gradient;
            r[p] = -load<T>(&residual[n]);
            points.set(i, movedWithin(load<T>(&limit[n]), points.template lanes<T>(i), minimumNorm(J, r, kParallel)));
        }
    }
};

} // namespace curlew
