// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/math/MinimumNorm.h"
#include "curlew/track/Reproject.h"
#include "curlew/track/Stepper.h"

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
        size_t first = 0;
        while (weights[first] == 0 && first + 1 < weights.size()) ++first;
        for (int i = 0; i < size; i += kLanes<T>) {
            Vec<T, N> total = stages[first].template lanes<T>(i) * T(weights[first]);
            for (size_t k = first + 1; k < weights.size(); ++k) {
                if (weights[k] == 0) continue;
                const Vec<T, N> part = stages[k].template lanes<T>(i);
                for (int axis = 0; axis < N; ++axis) total[axis] = mulAdd(part[axis], T(weights[k]), total[axis]);
            }
            sum.set(i, total);
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

/// Returns p + move, with the move clamped to the limit's length.
template <class T, int N>
Vec<T, N> movedWithin(const T& limit, const Vec<T, N>& p, const Vec<T, N>& move) {
    const T size = length(move), scale = select(size > limit, limit / size, T(1));
    Vec<T, N> moved;
    for (int k = 0; k < N; ++k) moved[k] = mulAdd(move[k], scale, p[k]);
    return moved;
}

/// Takes a Gauss-Newton step for all potentials at once: the smallest v with J v = -r. The potentials with the largest
/// residuals, relative to their tolerance, come first: they take precedence where gradients are nearly parallel.
template <int N>
struct GaussNewtonKernel {
    template <class T, class Jets>
    static void run(const Jets& jets, const TrackBatchN<N>& residual, const std::array<double, kBatch>& limit,
                    const ReprojectOptionsN<N>& options, PointBatchN<N>& points) {
        for (int i = 0; i < points.size; i += kLanes<T>) {
            const auto n = static_cast<size_t>(i);
            constexpr size_t kM{N - 1};
            std::array<Vec<T, N>, kM> J;
            std::array<T, kM> r, off;
            for (size_t p = 0; p < kM; ++p) {
                J[p] = jets[p].template lanes<T>(i).gradient;
                r[p] = -load<T>(&residual[p][n]);
                off[p] = abs(r[p]) / T(options.tolerance[p]);
            }
            for (size_t end = kM - 1; end > 0; --end)
                for (size_t p = 0; p < end; ++p) order(off[p] < off[p + 1], p, J, r, off);
            points.set(i, movedWithin(load<T>(&limit[n]), points.template lanes<T>(i), minimumNorm(J, r)));
        }
    }

  private:
    template <class Mask, class T, size_t M>
    static void order(const Mask& wrong, size_t p, std::array<Vec<T, N>, M>& J, std::array<T, M>& r,
                      std::array<T, M>& off) {
        const auto swapWhere = [&](T& a, T& b) {
            const T kept = a;
            a = select(wrong, b, a);
            b = select(wrong, kept, b);
        };
        for (int k = 0; k < N; ++k) swapWhere(J[p][k], J[p + 1][k]);
        swapWhere(r[p], r[p + 1]);
        swapWhere(off[p], off[p + 1]);
    }
};

/// Takes a Newton step for one potential: along its gradient to the iso-surface, to first order. Does not move the
/// point where the gradient vanishes.
template <int N>
struct NewtonKernel {
    template <class T>
    static void run(const JetBatchN<double, N, 1>& jets, const std::array<double, kBatch>& residual,
                    const std::array<double, kBatch>& limit, PointBatchN<N>& points) {
        for (int i = 0; i < points.size; i += kLanes<T>) {
            const auto n = static_cast<size_t>(i);
            const Vec<T, N> gradient = jets.template lanes<T>(i).gradient;
            const T squared = dot(gradient, gradient), r = load<T>(&residual[n]);
            const T along = select(squared > T(0), -r / squared, T(0));
            points.set(i, movedWithin(load<T>(&limit[n]), points.template lanes<T>(i), gradient * along));
        }
    }
};

} // namespace curlew
