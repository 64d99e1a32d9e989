// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/noise/PsrdLattice.h"
#include "curlew/noise/RadialKernel.h"

#include <array>
#include <cstdint>
#include <type_traits>

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
    /// How alpha rotates the gradients. Both cost the same here; in the original, `fast` is cheaper.
    enum class Rotation {
        standard, ///< Each about its own axis, starting at a point of a spherical Fibonacci spiral.
        fast      ///< Each in the plane perpendicular to such a point (FASTROTATION). Another noise, even at alpha = 0.
    };
    enum class Grid {
        axis,  ///< Tiles with any period. Slices at integer or half-integer x, y or z show the grid.
        perlin ///< Perlin's grid, to which such slices are oblique (PERLINGRID). Tiles with multiples of 3.
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
/// C² (in 2D C³), with a wavelength of about 1 and values within ±kBound. The Hessian is exact; the published second
/// derivatives in 3D scale the diagonal by 35.0 instead of 39.5. The lattice cell is subtracted in double, so T = float
/// loses no accuracy far from the origin (|x| up to 2^31). Compared with T = double it is accurate to 1e-6 (value),
/// 6e-6 (gradient), 1e-4 (Hessian). Immutable after construction; safe to share between threads.
template <int N>
class PsrdN {
    static_assert(N == 2 || N == 3);

  public:
    using Options = PsrdOptionsN<N>;
    static constexpr int kDimension = N;
    /// The value in the middle of a simplex edge if all gradients pointed in the worst direction: in 2D 10.9 · 0.55⁴,
    /// in 3D 39.5 · √3/2 · (5/16)³. The noise comes within 0.3 % of it.
    static constexpr double kBound = N == 2 ? 0.9975 : 1.0440;

    /// Throws ValueError if a period is negative or alpha is not finite.
    explicit PsrdN(const PsrdOptionsN<N>& options = {});

    /// T may be lanes.
    template <int Order, class T>
    Jet<T, N, Order> at(const Vec<Rebind<T, double>, N>& x) const;

    double maxAbs() const { return kBound; }

    /// Returns the exact tiling period along each axis; 0 if no period was requested. It is the least common multiple
    /// of the requested period and the lattice's own period. In 2D, an odd period along y is doubled; on Perlin's grid,
    /// a period that is not a multiple of 3 is tripled (both as published). Every other period is kept. Without a
    /// period the noise repeats with its hash, after 289 times the lattice's own period.
    Vec<int64_t, N> tilingPeriod() const;

  private:
    // Hashes are integers modulo 289, represented by |h| <= 144. All operations on them are exact in float: the
    // permutations take sums of a hash, a vertex, its corner and a shift, which are at most 449.
    static constexpr int kHashes = 289, kMaxHash = 144;
    /// h -> (quadratic h² + linear h) modulo 289. It is a bijection if 17 divides `quadratic` but not `linear`.
    struct Permutation {
        float quadratic, linear;
        template <class T>
        T operator()(const T& h) const {
            return centred(mulAdd(h, T(quadratic), T(linear)) * h);
        }
    };
    /// Reduces integers modulo kHashes to the smallest absolute value. In float they are below 6.92e6, so that the
    /// product may be rounded first, as in shaders.
    template <class T>
    static T centred(const T& i) {
        return negMulAdd(nearestProduct(i, static_cast<T>(1.0 / kHashes)), T(kHashes), i);
    }
    // A corner at distance d contributes kScale (kReach - d²)^kPower times the ramp of its gradient (Table 2).
    static constexpr int kPower = N == 2 ? 4 : 3;
    static constexpr double kReach = N == 2 ? 0.8 : 0.5;
    static constexpr double kScale = N == 2 ? 10.9 : 39.5;

    /// Calls f with an object of the lattice type.
    template <class F>
    auto onLattice(const F& f) const {
        if constexpr (N == 2)
            return f(PsrdLattice2{});
        else
            return mOptions.grid == PsrdOptions::Grid::perlin ? f(PsrdPerlinLattice3{}) : f(PsrdLattice3{});
    }
    /// Everything that the noise at a position depends on.
    template <class T>
    struct Cell {
        Vec<T, N> fraction; ///< Position relative to the base vertex, in simplex coordinates, in [0, 1).
        /// For each pair of axes 01, 02, 12: whether the fraction along the second is at least that along the first.
        std::array<MaskOf<T>, N*(N - 1) / 2> later;
        Vec<Rebind<T, double>, N> base;    ///< The base vertex in simplex coordinates; used if the noise tiles.
        Vec<Rebind<T, float>, N> hashable; ///< The base vertex as the hash takes it; used if the noise does not tile.
    };
    /// The row in the table of gradients for each corner.
    template <class T>
    using Places = std::array<Indices<T>, N + 1>;
    template <class Lattice, bool Tiles, class T>
    Cell<T> cellOf(const Vec<Rebind<T, double>, N>& x) const;
    /// Returns the offset of the k-th corner from the base vertex, in simplex coordinates.
    template <class T>
    static Vec<T, N> offset(const Cell<T>& cell, int k);
    template <class Lattice, bool Tiles, class T>
    Places<T> placesOf(const Cell<T>& cell) const;
    template <class T>
    Vec<T, N> gradientAt(const Indices<T>& places) const {
        return {rowsAt<T, size_t{N}>(table<T>(), places)};
    }
    /// gradient(k) returns the gradient of the k-th corner.
    template <class Lattice, int Order, class T, class Gradient>
    static Jet<T, N, Order> sumOfCorners(const Cell<T>& cell, const Gradient& gradient);
    /// Wraps a vertex into the period. Coordinates are integers.
    template <class Lattice, class T>
    Vec<T, N> wrapped(const Vec<T, N>& vertex) const;

    /// The axis that the hash uses at each step.
    static constexpr int hashedAxis(int step) { return N == 2 ? step : N - 1 - step; }

    template <class T>
    const Row<NumberOf<T>>* table() const {
        if constexpr (std::is_same_v<NumberOf<T>, float>)
            return mGradientsFloat.data();
        else
            return mGradients.data();
    }

    PsrdOptionsN<N> mOptions;
    bool mTiles = false;
    // The period times the lattice's kUnits, and its divisor: the same, but 1 where the period is 0.
    Vec<double, N> mPeriod, mDivisor;
    Vec<double, N> mTranslation{}; // of the lattice, from the seed
    Vec<float, N> mShift{};        // of the hash, from the seed
    std::array<Permutation, N> mPermutations;
    // Indexed by hash, starting at the lowest, -kMaxHash.
    std::array<Row<double>, kHashes> mGradients;
    std::array<Row<float>, kHashes> mGradientsFloat;
};
using Psrd2 = PsrdN<2>;
using Psrd3 = PsrdN<3>;

template <int N>
template <class Lattice, class T>
Vec<T, N> PsrdN<N>::wrapped(const Vec<T, N>& vertex) const {
    // In these units vertices have integer coordinates, so all of this is exact.
    Vec<T, N> k = Lattice::units(vertex);
    for (int axis = 0; axis < N; ++axis)
        // Elsewhere a quotient may be rounded below the integer.
        k[axis] = kSymbolic<T> && mPeriod[axis] > 0
                      ? floorMod(k[axis], mPeriod[axis], 1 / mPeriod[axis])
                      : negMulAdd(T(mPeriod[axis]), floor(k[axis] / T(mDivisor[axis])), k[axis]);
    return Lattice::vertexAt(k);
}

template <int N>
template <class Lattice, bool Tiles, class T>
typename PsrdN<N>::template Cell<T> PsrdN<N>::cellOf(const Vec<Rebind<T, double>, N>& x) const {
    using Position = Rebind<T, double>;
    using Hash = Rebind<T, float>;
    // Subtracts multiples of the lattice's own period first. Positions a period apart are then identical from here on,
    // even where simplex coordinates must be rounded.
    Vec<Position, N> tile, rest;
    for (int axis = 0; axis < N; ++axis) {
        const Position repeat(Lattice::kRepeat[axis]);
        tile[axis] = floor(x[axis] / repeat) * repeat;
        rest[axis] = x[axis] - tile[axis] + Position(mTranslation[axis]);
    }
    const Vec<Position, N> u = Lattice::toSimplex(rest), tileBase = Lattice::toSimplex(tile);
    Cell<T> cell;
    for (int axis = 0; axis < N; ++axis) {
        const Position low = floor(u[axis]);
        cell.fraction[axis] = convertTo<T>(u[axis] - low);
        cell.base[axis] = low + tileBase[axis];
        if constexpr (Tiles) continue;
        // GPUs are slow in double. All noises of a frequency share the tiles, which are reduced once.
        const Hash vertex = kSymbolic<T> ? convertTo<Hash>(low) + convertTo<Hash>(centred(tileBase[axis]))
                                         : convertTo<Hash>(centred(cell.base[axis]));
        cell.hashable[axis] = vertex + Hash(mShift[axis]);
    }
    const Vec<T, N>& r = cell.fraction;
    cell.later[0] = r[1] >= r[0];
    if constexpr (N == 3) {
        cell.later[1] = r[2] >= r[0];
        cell.later[2] = r[2] >= r[1];
    }
    return cell;
}

template <int N>
template <class T>
Vec<T, N> PsrdN<N>::offset(const Cell<T>& cell, int k) {
    // From the base vertex, the corners follow the axes in the order of their fractions, largest first (the paper,
    // Table 1, steps 2 and 3).
    const auto one = [](const auto& where) { return select(where, T(1), T(0)); };
    const auto oneUnless = [](const auto& where) { return select(where, T(0), T(1)); };
    if (k == 0) return {};
    if constexpr (N == 2) {
        const auto& later = cell.later[0];
        return k == 1 ? Vec<T, N>{{oneUnless(later), one(later)}} : Vec<T, N>{{T(1), T(1)}};
    } else {
        const auto& [xy, xz, yz] = cell.later;
        if (k == 1) return {{oneUnless(xy | xz), one(xy & !yz), one(xz & yz)}};
        if (k == 2) return {{oneUnless(xy & xz), oneUnless(yz & !xy), one(xz | yz)}};
        return {{T(1), T(1), T(1)}};
    }
}

template <int N>
template <class Lattice, bool Tiles, class T>
typename PsrdN<N>::template Places<T> PsrdN<N>::placesOf(const Cell<T>& cell) const {
    using Position = Rebind<T, double>;
    using Hash = Rebind<T, float>;
    // Without a period, the first step of the hash sees only two different coordinates.
    Hash first, step;
    if constexpr (!Tiles) {
        const Hash& low = cell.hashable[hashedAxis(0)];
        first = mPermutations[0](low);
        step = mPermutations[0](low + Hash(1)) - first;
    }
    Places<T> places;
    unrolled<N + 1>([&](auto k) {
        const Vec<T, N> from = offset(cell, k);
        Vec<Hash, N> vertex;
        Hash hash;
        if constexpr (Tiles) {
            Vec<Position, N> corner;
            for (int axis = 0; axis < N; ++axis) corner[axis] = cell.base[axis] + convertTo<Position>(from[axis]);
            corner = wrapped<Lattice>(corner);
            for (int axis = 0; axis < N; ++axis)
                vertex[axis] = convertTo<Hash>(centred(corner[axis])) + Hash(mShift[axis]);
            hash = mPermutations[0](vertex[hashedAxis(0)]);
        } else {
            vertex = cell.hashable;
            hash = first;
            if constexpr (k > 0) {
                for (int axis = 0; axis < N; ++axis) vertex[axis] += convertTo<Hash>(from[axis]);
                hash = mulAdd(convertTo<Hash>(from[hashedAxis(0)]), step, hash);
            }
        }
        for (int s = 1; s < N; ++s) hash = mPermutations[static_cast<size_t>(s)](hash + vertex[hashedAxis(s)]);
        places[k] = indicesOf(hash + Hash(kMaxHash), kHashes - 1);
    });
    return places;
}

template <int N>
template <class Lattice, int Order, class T, class Gradient>
Jet<T, N, Order> PsrdN<N>::sumOfCorners(const Cell<T>& cell, const Gradient& gradient) {
    // The sum with its derivatives (the paper, Table 2).
    const auto unit = static_cast<T>(1.0 / Lattice::kUnits);
    const Vec<T, N> x0 = Lattice::units(cell.fraction) * unit;
    Jet<T, N, Order> sum;
    unrolled<N + 1>([&](auto k) {
        Vec<T, N> d = x0;
        if constexpr (k > 0) {
            const Vec<T, N> corner = Lattice::cornerUnits(offset(cell, k), k);
            for (int axis = 0; axis < N; ++axis) d[axis] = negMulAdd(corner[axis], unit, d[axis]);
        }
        addRadialKernel(sum, kPower, static_cast<T>(kReach), gradient(k), d);
    });
    return sum * static_cast<T>(kScale);
}

template <int N>
template <int Order, class T>
Jet<T, N, Order> PsrdN<N>::at(const Vec<Rebind<T, double>, N>& x) const {
    return onLattice([&](auto lattice) {
        using Lattice = decltype(lattice);
        const auto jet = [&]<bool Tiles>(std::bool_constant<Tiles>) {
            const Cell<T> cell = cellOf<Lattice, Tiles, T>(x);
            const Places<T> places = placesOf<Lattice, Tiles>(cell);
            return sumOfCorners<Lattice, Order>(cell, [&](size_t k) { return gradientAt<T>(places[k]); });
        };
        return mTiles ? jet(std::true_type{}) : jet(std::false_type{});
    });
}

} // namespace curlew
