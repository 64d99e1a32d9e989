// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/noise/CubicLattice.h"

namespace curlew {

/// The set of gradients that a hash selects from in 3D. Both consist of the 12 directions to the edges of a cube, some
/// of them twice.
enum class PerlinGradients {
    catlike,  ///< As in the Catlike Coding tutorial.
    reference ///< As in Ken Perlin's reference implementation of improved noise (2002).
};

template <int N>
struct PerlinNoiseOptions {
    Vec<int, N> period{}; ///< Tiles with this period along each axis, in cells; 0: the published noise's own 256.
    PerlinGradients gradients = PerlinGradients::catlike; ///< `reference` exists for N = 3.
    uint64_t seed = 0; ///< 0 is the published function; other seeds give independent fields.
};

/// Perlin's gradient noise on the integer lattice, N = 1, 2, 3, in the version of Flick, "Noise Derivatives" (Catlike
/// Coding), methods Perlin1D to Perlin3D, or in Perlin's own of 2002. Each vertex has a ramp with one of 2, 8 or 12
/// gradients. The ramps are blended with quintic fades.
///
/// C², with a wavelength of about 1.5 (2 pi rms value / rms gradient); zero at all vertices. Value and gradient are as
/// published; the Hessian is ours. If the period exceeds 256, the hash still takes indices modulo 256, so parts of a
/// tile that are 256 cells apart look alike. The lattice cell is subtracted in double, so T = float loses no accuracy
/// far from the origin (|x| up to 2^51). Compared with T = double it is accurate to 5e-6 (value), 2e-5 (gradient), 1e-4
/// (Hessian). Immutable after construction; safe to share between threads.
template <int N>
class PerlinNoise {
    static_assert(1 <= N && N <= 3);

  public:
    using Options = PerlinNoiseOptions<N>;
    static constexpr int kDimension = N;
    static constexpr int kOwnPeriod = 256; ///< The period if none is requested.
    /// The maximum over all fields with such gradients, up to rounding. N = 1, 2: it is reached in the middle of a cell
    /// whose ramps all rise towards it. There the mean squared distance to the corners, weighted as in the blend, has
    /// its maximum N/4, so with gradients of length g no value exceeds g sqrt(N)/2. N = 3: the blend of the largest
    /// ramps that these gradients allow has its maximum 1.036353811... at (0.35526, 0.48149, 0.5) and its mirror images
    /// (largest observed value: 1.0196).
    static constexpr double kBound = N == 3 ? 1.0364 : 1;

    /// Throws ValueError if a period is negative, or if reference gradients are requested for N other than 3.
    explicit PerlinNoise(const PerlinNoiseOptions<N>& options = {});

    /// T may be lanes.
    template <int Order, class T>
    Jet<T, N, Order> at(const Vec<Rebind<T, double>, N>& x) const;

    double maxAbs() const { return kBound; }

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
    // Indexed by the table position of a hash, and scaled by the published scale of the noise.
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
