// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/math/Interval.h"
#include "curlew/noise/CubicLattice.h"

namespace curlew {

template <int N>
struct ValueNoiseOptions {
    Vec<int, N> period{}; ///< Tiles with this period along each axis, in cells; 0: the published noise's own 256.
    uint64_t seed = 0;    ///< 0 is the published function; other seeds give independent fields.
};

/// Value noise on the integer lattice, N = 1, 2, 3: Flick, "Noise Derivatives" (Catlike Coding), methods Value1D to
/// Value3D. Each vertex has a value from {0, 1/255, ..., 1}. The values are blended with quintic fades.
///
/// C², with a wavelength of 2 (3D) to 3 (1D). Values fill [0, 1] with a mean of 1/2; the bound is sharp and also holds
/// with rounding. The gradient is zero at all vertices. Value and gradient are as published; the Hessian is ours. If
/// the period exceeds 256, the hash still takes indices modulo 256, so parts of a tile that are 256 cells apart look
/// alike. If the period is 1, there is only one vertex along that axis, and the noise does not depend on that
/// coordinate. The lattice cell is subtracted in double, so T = float loses no accuracy far from the origin (|x| up to
/// 2^51). Compared with T = double it is accurate to 5e-6 (value), 2e-5 (gradient), 1e-4 (Hessian). Immutable after
/// construction; safe to share between threads.
template <int N>
class ValueNoise {
    static_assert(1 <= N && N <= 3);

  public:
    using Options = ValueNoiseOptions<N>;
    static constexpr int kDimension = N;
    static constexpr int kOwnPeriod = 256; ///< The period if none is requested.
    static constexpr double kBound = 1;

    /// Throws ValueError if a period is negative.
    explicit ValueNoise(const ValueNoiseOptions<N>& options = {})
        : mLattice(options.period, kOwnPeriod, options.seed), mHash(options.seed) {}

    /// T may be lanes.
    template <int Order, class T>
    Jet<T, N, Order> at(const Vec<Rebind<T, double>, N>& x) const;

    Interval range() const { return {0, 1}; }
    double maxAbs() const { return kBound; }

  private:
    CubicLattice<N> mLattice;
    PermutationHash mHash;
};

template <int N>
template <int Order, class T>
Jet<T, N, Order> ValueNoise<N>::at(const Vec<Rebind<T, double>, N>& x) const {
    const auto cell = mLattice.cell(x);
    const auto places = mHash.places(cell);
    return blendCorners<Order>(cell.template position<T>(),
                               [&](size_t k) { return Jet<T, N, 0>(convertTo<T>(mHash.at(places[k]))); }) *
           static_cast<T>(1.0 / 255);
}

} // namespace curlew
