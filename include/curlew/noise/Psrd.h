#pragma once

#include "curlew/noise/PsrdLattice.h"
#include "curlew/noise/RadialKernel.h"

#include <array>
#include <cstdint>

namespace curlew {

template <int N>
struct PsrdOptionsN;

template <>
struct PsrdOptionsN<2> {
    Vec<int, 2> period = {}; ///< Per axis, in lattice units; 0: does not tile. See Psrd2::tilingPeriod().
    double alpha = 0;        ///< Rotation of the gradients, radians ("flow noise"); 2 pi is a full turn.
    uint64_t seed = 0;       ///< 0 is the published function; other seeds give independent fields.
};

template <>
struct PsrdOptionsN<3> {
    /// How alpha turns the gradients. Both cost the same here; `fast` is what the original has as the cheaper one.
    enum class Rotation {
        standard, ///< Each about an axis of its own, from a point of a spherical Fibonacci spiral.
        fast      ///< Each in the plane perpendicular to such a point: another noise, at alpha = 0 too (FASTROTATION).
    };
    enum class Grid {
        axis,  ///< Tiles with any period. Slices in planes of whole or half x, y or z show the grid.
        perlin ///< Perlin's, where such planes are oblique (PERLINGRID). Tiles with multiples of 3.
    };
    Vec<int, 3> period = {}; ///< Per axis, in lattice units; 0: does not tile. See Psrd3::tilingPeriod().
    double alpha = 0;        ///< Rotation of the gradients, radians ("flow noise"); 2 pi is a full turn.
    Rotation rotation = Rotation::standard;
    Grid grid = Grid::axis;
    uint64_t seed = 0; ///< 0 is the published function; other seeds give independent fields.
};
using PsrdOptions = PsrdOptionsN<3>;

/// Tiling simplex noise in 2D and 3D with rotating gradients: psrdnoise of Gustavson and McEwan 2021 ("the paper"
/// below), with both grids and both rotations of the published psrddnoise3.glsl.
///
/// C² (in 2D C³), of wavelength about 1, values within ±kBound. The Hessian is the true one: the published second
/// derivatives in 3D scale the diagonal by 35.0 instead of 39.5.
/// The lattice cell is taken off in double, so T = float loses nothing far from the origin (|x| up to 2^31): against
/// T = double it is accurate to 1e-6 (value), 6e-6 (gradient), 1e-4 (Hessian).
/// Immutable after construction, safe to share between threads.
template <int N>
class PsrdN {
    static_assert(N == 2 || N == 3);

  public:
    using Options = PsrdOptionsN<N>;
    static constexpr int kDimension = N;
    /// What gradients that all point the worst way would give, at the middle of a simplex's edge: in 2D 10.9 · 0.55⁴,
    /// in 3D 39.5 · √3/2 · (5/16)³. The noise comes within 0.3 % of it.
    static constexpr double kBound = N == 2 ? 0.9975 : 1.0440;

    /// Throws ValueError for a negative period, and an alpha that is not finite.
    explicit PsrdN(const PsrdOptionsN<N>& options = {});

    template <int Order, class T>
    Jet<T, N, Order> at(const Vec<double, N>& x) const;

    double bound() const { return kBound; }

    /// What it tiles with along each axis, exactly; 0 where no period was asked for. It is the least common multiple of
    /// the period and the lattice's own: in 2D an odd period along y tiles with twice as much, on Perlin's grid one
    /// that is no multiple of 3 with three times as much (both as published). Every other period is what it says.
    /// Without a period the hash repeats, every 289 times the lattice's own.
    Vec<int64_t, N> tilingPeriod() const;

  private:
    static constexpr int kHashes = 289;
    // A corner at distance d counts with kScale (kReach - d²)^kPower times the ramp of its gradient (Table 2).
    static constexpr int kPower = N == 2 ? 4 : 3;
    static constexpr double kReach = N == 2 ? 0.8 : 0.5;
    static constexpr double kScale = N == 2 ? 10.9 : 39.5;
    using LatticePoint = std::array<size_t, N>;

    /// Calls f with the lattice, as a type.
    template <class F>
    auto onLattice(const F& f) const {
        if constexpr (N == 2)
            return f(PsrdLattice2{});
        else
            return mOptions.grid == PsrdOptions::Grid::perlin ? f(PsrdPerlinLattice3{}) : f(PsrdLattice3{});
    }
    template <class Lattice, int Order, class T>
    Jet<T, N, Order> sumOfCorners(const Vec<double, N>& x) const;

    /// Hash of a lattice vertex given in simplex coordinates, each within [0, kHashes).
    size_t hash(const LatticePoint& i) const;
    /// The vertex, reduced to its period and then to [0, kHashes).
    template <class Lattice>
    LatticePoint reduce(Vec<double, N> vertex) const;

    template <class T>
    const std::array<Vec<T, N>, kHashes>& gradients() const {
        if constexpr (std::is_same_v<T, float>)
            return mGradientsFloat;
        else
            return mGradients;
    }

    PsrdOptionsN<N> mOptions;
    bool mTiles = false;
    // The period in the lattice's units, and what to divide by for it: the same, but 1 where it is 0.
    Vec<double, N> mPeriod, mDivisor;
    Vec<double, N> mTranslation{}; // of the lattice, and
    std::array<int, N> mShift{};   // of the hash, from the seed
    std::array<uint16_t, kHashes> mFirstPermutation;
    std::array<uint16_t, 2 * kHashes> mPermutation;
    std::array<Vec<double, N>, kHashes> mGradients;
    std::array<Vec<float, N>, kHashes> mGradientsFloat;
};
using Psrd2 = PsrdN<2>;
using Psrd3 = PsrdN<3>;

template <int N>
size_t PsrdN<N>::hash(const LatticePoint& i) const {
    if constexpr (N == 2)
        return mPermutation[mFirstPermutation[i[0]] + i[1]];
    else
        return mPermutation[mPermutation[mFirstPermutation[i[2]] + i[1]] + i[0]];
}

template <int N>
template <class Lattice>
typename PsrdN<N>::LatticePoint PsrdN<N>::reduce(Vec<double, N> vertex) const {
    if (mTiles) {
        // Wrap in space, in units of which vertices have a whole number, so all of this is exact.
        Vec<double, N> k = Lattice::units(vertex);
        for (int axis = 0; axis < N; ++axis) k[axis] -= mPeriod[axis] * std::floor(k[axis] / mDivisor[axis]);
        vertex = Lattice::vertexAt(k);
    }
    LatticePoint reduced;
    for (int axis = 0; axis < N; ++axis) {
        const double n = vertex[axis] + mShift[static_cast<size_t>(axis)];
        double r = n - kHashes * std::floor(n * (1.0 / kHashes));
        // The rounded reciprocal can be off by one period next to a multiple of it. Beyond 2^50, and for NaN, there is
        // no lattice left: any index in range will do.
        if (r < 0) r += kHashes;
        if (r >= kHashes) r -= kHashes;
        reduced[static_cast<size_t>(axis)] = r >= 0 && r < kHashes ? static_cast<size_t>(r) : 0;
    }
    return reduced;
}

template <int N>
template <class Lattice, int Order, class T>
Jet<T, N, Order> PsrdN<N>::sumOfCorners(const Vec<double, N>& x) const {
    // First take off the lattice's own period. So positions a period apart are the same ones from here on, even where
    // simplex coordinates have to be rounded.
    Vec<double, N> tile, rest;
    for (int axis = 0; axis < N; ++axis) {
        const double repeat = Lattice::kRepeat[axis];
        tile[axis] = repeat * std::floor(x[axis] / repeat);
        rest[axis] = x[axis] - tile[axis] + mTranslation[axis];
        const double carry = rest[axis] >= repeat ? repeat : 0;
        tile[axis] += carry;
        rest[axis] -= carry;
    }
    const Vec<double, N> u = Lattice::toSimplex(rest);
    Vec<double, N> base;
    for (int axis = 0; axis < N; ++axis) base[axis] = std::floor(u[axis]);
    const Vec<double, N> r = u - base;
    base += Lattice::toSimplex(tile);
    // Which simplex it is depends on the order of the fractions: from the base its corners follow the axes, the one of
    // the largest fraction first (the paper, Table 1, steps 2 and 3).
    std::array<int, N> rank{};
    for (size_t i = 0; i < N; ++i)
        for (size_t j = i + 1; j < N; ++j) {
            const int later = r.c[j] >= r.c[i];
            rank[i] += later;
            rank[j] += 1 - later;
        }
    std::array<Vec<T, N>, N + 1> offsets; // of the corners from the base, simplex coordinates
    std::array<size_t, N + 1> hashes;
    for (size_t k = 0; k <= N; ++k) {
        Vec<double, N> offset;
        for (int axis = 0; axis < N; ++axis) {
            offset[axis] = rank[static_cast<size_t>(axis)] < static_cast<int>(k);
            offsets[k][axis] = static_cast<T>(offset[axis]);
        }
        hashes[k] = hash(reduce<Lattice>(base + offset));
    }
    // Sum over the corners (the paper, Table 2), with its derivatives.
    Vec<T, N> x0;
    for (int axis = 0; axis < N; ++axis) x0[axis] = static_cast<T>(Lattice::units(r)[axis] * (1.0 / Lattice::kUnits));
    Jet<T, N, Order> sum;
    for (size_t k = 0; k <= N; ++k) {
        const Vec<T, N> d = x0 - Lattice::units(offsets[k]) * T(1.0 / Lattice::kUnits);
        addRadialKernel<kPower>(sum, T(kReach), gradients<T>()[hashes[k]], d);
    }
    return sum * T(kScale);
}

template <int N>
template <int Order, class T>
Jet<T, N, Order> PsrdN<N>::at(const Vec<double, N>& x) const {
    return onLattice([&](auto lattice) { return sumOfCorners<decltype(lattice), Order, T>(x); });
}

} // namespace curlew
