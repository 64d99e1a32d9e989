// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/noise/CubicLattice.h"

namespace curlew {

/// Which gradients a hash picks in 3D. Both sets are the 12 directions to the edges of a cube, some of them twice.
enum class PerlinGradients {
    catlike,  ///< Of the tutorial.
    reference ///< Of Ken Perlin's reference implementation of improved noise (2002).
};

template <int N>
struct PerlinNoiseOptions {
    Vec<int, N> period{}; ///< Tiles with this period along each axis, in cells; 0: the published noise's own 256.
    PerlinGradients gradients = PerlinGradients::catlike; ///< `reference` exists for N = 3.
    uint64_t seed = 0; ///< 0 is the published function; other seeds give independent fields.
};

/// Perlin's gradient noise on the lattice of whole numbers, N = 1, 2, 3, in the version of Flick, "Noise Derivatives"
/// (Catlike Coding), the methods Perlin1D to Perlin3D, or in Perlin's own of 2002. A ramp at each vertex, with one of
/// 2, 8 or 12 gradients, blended with quintic fades.
///
/// C², of wavelength about 1.5 (2 pi rms value / rms gradient), zero at all vertices. Value and gradient are as
/// published, the Hessian is ours. Of a period above 256 the hash still sees indices modulo 256: parts of a tile that
/// are 256 apart look alike. The lattice cell is taken off in double, so T = float loses nothing far from the origin
/// (|x| up to 2^51); against T = double it is accurate to 5e-6 (value), 2e-5 (gradient), 1e-4 (Hessian). Immutable
/// after construction, safe to share between threads.
template <int N>
class PerlinNoise {
    static_assert(1 <= N && N <= 3);

  public:
    using Options = PerlinNoiseOptions<N>;
    static constexpr int kDimension = N;
    static constexpr int kOwnPeriod = 256; ///< Where no other is asked for.
    /// The largest value of all fields with such gradients, but for rounding. N = 1, 2: in the middle of a cell whose
    /// ramps all rise towards it. There the mean of the squared distances to the corners, weighted as in the blend, is
    /// largest, N/4; so with gradients of length g no value exceeds g sqrt(N)/2. N = 3: of the greatest ramps that
    /// these gradients allow the sum is largest, 1.036353811..., at (0.35526, 0.48149, 0.5) and its mirror images
    /// (seen: 1.0196).
    static constexpr double kBound = N == 3 ? 1.0364 : 1;

    /// Throws ValueError for a negative period, and for reference gradients unless N = 3.
    explicit PerlinNoise(const PerlinNoiseOptions<N>& options = {});

    /// T may be lanes.
    template <int Order, class T>
    Jet<T, N, Order> at(const Vec<Rebind<T, double>, N>& x) const;

    double bound() const { return kBound; }

  private:
    template <class T>
    const Row<NumberOf<T>>* gradients() const {
        if constexpr (std::is_same_v<NumberOf<T>, float>)
            return mGradientsFloat.data();
        else
            return mGradients.data();
    }

    CubicLattice<N> mLattice;
    PermutationHash mHash;
    // By the place where a hash is looked up, times the published scale of the noise.
    std::array<Row<double>, PermutationHash::kSize> mGradients;
    std::array<Row<float>, PermutationHash::kSize> mGradientsFloat;
};

template <int N>
template <int Order, class T>
Jet<T, N, Order> PerlinNoise<N>::at(const Vec<Rebind<T, double>, N>& x) const {
    const auto cell = mLattice.cell(x);
    const Vec<T, N> s = cell.template position<T>();
    const auto places = mHash.places(cell);
    return blendCorners<Order>(s, [&](size_t k) {
        const auto index = wrappedIndicesOf(places[k], PermutationHash::kSize - 1);
        const Vec<T, N> gradient{rowsAt<T, size_t{N}>(gradients<T>(), index)};
        return cornerRamp<std::min(Order, 1)>(gradient, s, k);
    });
}

} // namespace curlew
