// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/math/Jet.h"
#include "curlew/noise/CubicLattice.h"

#include <numbers>

namespace curlew {

template <int N>
struct SineNoiseOptions {
    Vec<int, N> period{}; ///< Tiles with this period along each axis; 0: does not tile.
    int waves = 8;        ///< 1 … 64.
    uint64_t seed = 0;    ///< Different seeds give independent fields; 0 is not special.
};

/// A sum of plane waves, (1/M) Σ sin(2 pi (phase_m + nu_m · x)) for m = 0 … M - 1, in N = 1 … 7 dimensions. It is C^∞,
/// so numerical methods applied to it converge at their full order. It is not taken from a publication.
///
/// The wave numbers |nu_m| = 3/4 + (m + r)/(2 M) are about 1 per unit of length. Phases and all r are uniform in [0,
/// 1). The directions are spread, so that even a few waves look isotropic. Each is the one of 32 random directions that
/// is farthest from those before. Then 100 sweeps of steepest descent reduce the sum of the fourth powers of all
/// cosines between them. That sum is minimal exactly for sets whose second and fourth moments are those of the uniform
/// distribution (projective 2-designs; Welch 1974). Along an axis with a period p, the wave vectors are rounded to
/// multiples of 1/p. If all components become zero, the one that was largest relative to 1/p is set to ±1/p. Periods of
/// one or two leave only a few different waves.
///
/// Values are within ±1, with a mean square of 1/(2 M) for M waves (largest observed with 8: ±0.97). Positions are
/// reduced to periods, and arguments to one turn, in double, so T = float loses no accuracy far from the origin.
/// Compared with T = double it is accurate to 5e-7 (value), 5e-6 (gradient), 5e-5 (Hessian). Immutable after
/// construction; safe to share between threads.
template <int N>
class SineNoise {
    static_assert(1 <= N && N <= 7);

  public:
    using Options = SineNoiseOptions<N>;
    static constexpr int kDimension = N;
    static constexpr double kBound = 1;
    static constexpr int kMaxWaves = 64;

    /// Throws ValueError if a period is negative or `waves` is out of range.
    explicit SineNoise(const SineNoiseOptions<N>& options = {});

    /// T may be lanes.
    template <int Order, class T>
    Jet<T, N, Order> at(const Vec<Rebind<T, double>, N>& x) const;

    double maxAbs() const { return kBound; }

  private:
    SineNoiseOptions<N> mOptions;
    std::array<Vec<double, N>, kMaxWaves> mWaves; // wave vectors nu, cycles per unit of length
    std::array<double, kMaxWaves> mPhases{};      // cycles
};

template <int N>
template <int Order, class T>
Jet<T, N, Order> SineNoise<N>::at(const Vec<Rebind<T, double>, N>& x) const {
    using Position = Rebind<T, double>;
    Vec<Position, N> wrapped = x;
    for (int axis = 0; axis < N; ++axis)
        if (const double p = mOptions.period[axis]; p > 0) {
            // Integer part and fraction separately: positions a period apart become bit for bit the same.
            const Position whole = floor(x[axis]);
            wrapped[axis] = floorMod(whole, p, 1 / p) + (x[axis] - whole);
        }
    constexpr double kTurn = 2 * std::numbers::pi;
    Jet<T, N, Order> sum;
    for (size_t m = 0; m < static_cast<size_t>(mOptions.waves); ++m) {
        Position cycles(mPhases[m]);
        for (int i = 0; i < N; ++i) cycles = mulAdd(Position(mWaves[m][i]), wrapped[i], cycles);
        const T argument = convertTo<T>(Position(kTurn) * (cycles - floor(cycles + Position(0.5))));
        const T sine = sin(argument);
        sum.value += sine;
        if constexpr (Order >= 1) {
            const T cosine = cos(argument);
            Vec<T, N> k;
            for (int i = 0; i < N; ++i) k[i] = static_cast<T>(kTurn * mWaves[m][i]);
            for (int i = 0; i < N; ++i) sum.gradient[i] = mulAdd(k[i], cosine, sum.gradient[i]);
            if constexpr (Order >= 2)
                for (int i = 0; i < N; ++i)
                    for (int j = i; j < N; ++j) sum.hessian(i, j) = negMulAdd(k[i] * k[j], sine, sum.hessian(i, j));
            if constexpr (Order >= 3)
                sum.forTriples([&](int i, int j, int l) { sum.third(i, j, l) -= k[i] * k[j] * k[l] * cosine; });
        }
    }
    return sum * static_cast<T>(1.0 / mOptions.waves);
}

} // namespace curlew
