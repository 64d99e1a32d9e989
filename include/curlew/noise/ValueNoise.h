// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/math/Range.h"
#include "curlew/noise/CubicLattice.h"

namespace curlew {

template <int N>
struct ValueNoiseOptions {
    Vec<int, N> period{}; ///< Tiles with this period along each axis, in cells; 0: the published noise's own 256.
    uint64_t seed = 0;    ///< 0 is the published function; other seeds give independent fields.
};

/// Value noise on the lattice of whole numbers, N = 1, 2, 3: Flick, "Noise Derivatives" (Catlike Coding), the methods
/// Value1D to Value3D. A value from {0, 1/255, ..., 1} at each vertex, blended with quintic fades.
///
/// C², of wavelength 2 (3D) to 3 (1D), values within [0, 1] (all of it, about the mean 1/2): the bound is sharp,
/// rounding included. Its gradient is zero at all vertices. Value and gradient are as published, the Hessian is ours.
/// Of a period above 256 the hash still sees indices modulo 256: parts of a tile that are 256 apart look alike. With
/// period 1 there is but one vertex along that axis, and the noise does not depend on it.
/// The lattice cell is taken off in double, so T = float loses nothing far from the origin (|x| up to 2^51); against
/// T = double it is accurate to 5e-6 (value), 2e-5 (gradient), 1e-4 (Hessian).
/// Immutable after construction, safe to share between threads.
template <int N>
class ValueNoise {
    static_assert(1 <= N && N <= 3);

  public:
    using Options = ValueNoiseOptions<N>;
    static constexpr int kDimension = N;
    static constexpr int kOwnPeriod = 256; ///< Where no other is asked for.
    static constexpr double kBound = 1;

    /// Throws ValueError for a negative period.
    explicit ValueNoise(const ValueNoiseOptions<N>& options = {})
        : mLattice(options.period, kOwnPeriod, options.seed), mHash(options.seed) {}

    /// T may be lanes.
    template <int Order, class T>
    Jet<T, N, Order> at(const Vec<Rebind<T, double>, N>& x) const;

    Range range() const { return {0, 1}; }
    double bound() const { return kBound; }

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
