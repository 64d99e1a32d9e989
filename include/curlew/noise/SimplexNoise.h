// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/base/Random.h"
#include "curlew/noise/RadialKernel.h"
#include "curlew/noise/SimplexVertex.h"

#include <array>
#include <bit>
#include <cstdint>

namespace curlew {

/// Which vertices of the lattice a SimplexNoise sums, up to which distance r, and how it scales the sum.
enum class SimplexKernel {
    smooth,              ///< All vertices within r; r² = 1/2 for N <= 5, 3/4 for N = 6 and 7. Within ±1.
    corners,             ///< The corners of the simplex, r² = 1/2. Within ±1. Zero in places for N = 6 and 7.
    published,           ///< The corners, r² = 15/16 N/(N+1) (N = 2: 1/2). Jumps at the faces of simplices for N >= 3.
    publishedContinuous, ///< The corners, r² = 1/2, scaled as `published`.
};

struct SimplexOptions {
    int power = 4; ///< Of the kernel (r² - |d|²)^power: 3 gives a C² noise, 4 a C³ one. Published kernels have 4.
    SimplexKernel kernel = SimplexKernel::smooth; ///< The published ones are there to compare with.
    uint64_t seed = 0; ///< 0 has the published gradient at each vertex; other seeds give independent fields.
};

/// Bob Jenkins's one-at-a-time hash of the three low bytes, as the program has it: in 64 bits, nothing cut off. Word is
/// uint64_t, or several of them at once.
template <class Word>
requires(sizeof(Word) >= sizeof(uint64_t)) constexpr Word simplexHash(const Word& word) {
    Word hash(0);
    for (int byte = 0; byte < 3; ++byte) {
        hash += (word >> (8 * byte)) & Word(255);
        hash += hash << 10;
        hash = hash ^ (hash >> 6);
    }
    hash += hash << 3;
    hash = hash ^ (hash >> 11);
    return hash + (hash << 15);
}

/// Simplex noise in N = 2 … 7 dimensions, of wavelength about 1 (Perlin 2001; Gustavson 2005), with the lattice, the
/// gradients and for seed 0 the hash of github.com/Craig-Macomber/N-dimensional-simplex-noise ("the program" below: its
/// seed 12345, and of its two shuffles of the gradients the first, seeded one only).
///
/// Σ (r² - |d|²)^power (g·d) over lattice vertices, d from the vertex to x, g the gradient that the vertex was dealt.
/// The height of a vertex over the opposite face is √(1/2) for every N, so up to r² = 1/2 the corners of the simplex
/// alone give a continuous noise. From N = 6 on that leaves gaps, because a point can be √(N(N+2) / (12 (N+1))) away
/// from all vertices (Conway and Sloane 1988: the covering radius of the lattice A*). There `smooth` reaches further
/// and sums all vertices within reach. Root mean square of the default noise for N = 2 … 7: 0.54, 0.39, 0.25, 0.16,
/// 0.14, 0.10.
///
/// The program's hash repeats soon. In skewed coordinates the vertices c and c + (32, -1, 0 …) have the same gradient,
/// from 5D on also c and c + (0, -1, 0, 0, 2 …): so with seed 0 the noise is the same again after 27 to 29 in 2D to 4D,
/// and already after 2.2 in 5D to 7D. Other seeds have a hash of their own, of 64 bits: hundreds in 7D, more in fewer.
///
/// The lattice cell is taken off in double: T = float loses nothing far from the origin (|x| up to 2^50); against
/// T = double it is accurate to 2e-6 (value), 1e-5 (gradient), 1e-4 (Hessian). What is not finite gives NaN.
/// Immutable after construction, safe to share between threads.
template <int N>
class SimplexNoise {
    static_assert(N >= 2 && N <= 7);

  public:
    using Options = SimplexOptions;
    static constexpr int kDimension = N;

    /// Throws ValueError for a power that the kernel does not have.
    explicit SimplexNoise(const SimplexOptions& options = {});

    /// T may be lanes.
    template <int Order, class T>
    Jet<T, N, Order> at(const Vec<Rebind<T, double>, N>& x) const;

    /// |value| never exceeds it, whatever the gradients (to rounding).
    double bound() const { return mBound; }

  private:
    static constexpr int kGradients = N << (N - 1), kRows = N <= 4 ? 1 : 2; ///< Rows of 4 for each gradient.

    /// The cell of the skewed lattice that a position is in, and where in it. P: double or lanes of it.
    template <class P>
    struct Cell {
        Rebind<P, uint64_t> index; ///< Of its lowest corner, before it is hashed.
        Vec<P, N> x;               ///< From there, in space.
        /// Place of each axis in the order of the skewed coordinates, the largest first: it tells the simplex within
        /// the cell. In sorted axes all simplices are the same.
        Vec<P, N> rank;
    };
    template <class P>
    Cell<P> cell(const Vec<P, N>& x) const;

    /// The gradient of a vertex, not normalised: of components ±1, and one 0.
    template <class T>
    Vec<T, N> gradient(const Rebind<T, uint64_t>& index) const;

    /// Adds what a vertex contributes at a distance d from it.
    template <int Order, class T>
    void add(Jet<T, N, Order>& sum, const Rebind<T, uint64_t>& index, const Vec<T, N>& d) const {
        if constexpr (kLanes<T> == 1) { // out of reach it would add zeros; lanes rarely all are
            T w = static_cast<T>(mRadius2);
            for (int i = 0; i < N; ++i) w = negMulAdd(d[i], d[i], w);
            if (w <= T(0)) return; // NaN goes on
        }
        const Vec<T, N> g = gradient<T>(index);
        if (mPower == 4)
            addRadialKernel<4>(sum, static_cast<T>(mRadius2), g, d);
        else
            addRadialKernel<3>(sum, static_cast<T>(mRadius2), g, d);
    }
    /// Of the N + 1 corners of the simplex.
    template <int Order, class T>
    Jet<T, N, Order> sumOfCorners(const Cell<Rebind<T, double>>& cell) const;
    /// Of all vertices within reach.
    template <int Order, class T>
    Jet<T, N, Order> sumOfVertices(const Cell<Rebind<T, double>>& cell) const;

    static constexpr int kNear = N <= 5 ? 0 : NearVertex<N>::kCount;
    /// The bits of those within reach of a position, and perhaps of some that are just beyond.
    template <class P>
    std::array<uint32_t, size_t{kLanes<P>}> verticesInReach(const Cell<P>& cell) const;

    /// The lattice in numbers of type T.
    template <class T>
    struct Lattice {
        /// The coordinates of corner k, along the axes of rank below k, and along the others.
        std::array<T, N + 1> along, beside;
        /// Of near vertices: corner, step, sign, shift. The last one is out of reach of all.
        std::array<Row<T>, kNear + 1> near;
    };
    template <class T>
    const Lattice<NumberOf<T>>& lattice() const {
        if constexpr (std::is_same_v<NumberOf<T>, float>)
            return mLatticeFloat;
        else
            return mLattice;
    }
    template <class T>
    Lattice<T> makeLattice() const;

    // Of the lattice: y = x + skew Σx has the vertices at integer points (Gustavson 2005), x = y - unskew Σy.
    double mSkew = (std::sqrt(N + 1.0) - 1) / N, mUnskew = (1 - 1 / std::sqrt(N + 1.0)) / N;
    int mPower;
    bool mPublishedHash;
    uint64_t mIndex;                  // of the vertex at 0 before it is hashed
    std::array<uint64_t, N> mSteps{}; // what a step along each axis adds to it
    bool mCornersOnly;
    double mRadius2 = 0, mScale = 0, mBound = 0;
    Vec<double, N> mTranslation{}; // of the lattice, from the seed
    Lattice<double> mLattice;
    Lattice<float> mLatticeFloat;
    std::array<float, kNear> mSquares, mTilts; // of near vertices: |p|² and the tilt
    std::array<Row<float>, kGradients * kRows> mGradients;
};

template <int N>
template <class P>
auto SimplexNoise<N>::cell(const Vec<P, N>& x) const -> Cell<P> {
    Vec<P, N> moved, r;
    for (int i = 0; i < N; ++i) moved[i] = x[i] + P(mTranslation[i]);
    P sum = moved[0], sumR(0);
    for (int i = 1; i < N; ++i) sum += moved[i];
    const P skewed = sum * P(mSkew);
    Cell<P> cell;
    cell.index = Rebind<P, uint64_t>(mIndex);
    for (int i = 0; i < N; ++i) {
        const P y = moved[i] + skewed, low = floor(y);
        r[i] = y - low;
        sumR += r[i];
        // Further out, and for NaN, there is no lattice left: any number will do.
        const P whole = min(max(low, P(-0x1p51)), P(0x1p51));
        cell.index += wordOf(whole) * Rebind<P, uint64_t>(mSteps[static_cast<size_t>(i)]);
    }
    for (int i = 0; i < N; ++i)
        for (int j = i + 1; j < N; ++j) {
            const P later = select(r[i] < r[j], P(1), P(0));
            cell.rank[i] += later;
            cell.rank[j] += P(1) - later;
        }
    for (int i = 0; i < N; ++i) cell.x[i] = r[i] - P(mUnskew) * sumR;
    return cell;
}

template <int N>
template <class T>
Vec<T, N> SimplexNoise<N>::gradient(const Rebind<T, uint64_t>& index) const {
    using Word = Rebind<T, uint64_t>;
    using P = Rebind<T, double>;
    using F = Rebind<T, float>;
    const Word hash = mPublishedHash ? simplexHash(index) : mixedWord(index);
    // Modulo the number of gradients, in double: the high half first brought to where the low one is, then exact.
    constexpr auto kHigh = static_cast<double>((uint64_t{1} << 32) % kGradients);
    const P folded = mulAdd(convertTo<P>(hash >> 32), P(kHigh), convertTo<P>(hash & Word(0xffffffff)));
    const P place = floorMod(folded, kGradients, 1.0 / kGradients);
    const auto places = indicesOf(convertTo<F>(place), kGradients - 1);
    Vec<T, N> g;
    unrolled<kRows>([&](auto row) {
        constexpr size_t kFirst = 4 * row, kCount = std::min(size_t{N} - kFirst, size_t{4});
        const auto part = rowsAt<F, kCount>(mGradients.data() + row * kGradients, places);
        for (size_t k = 0; k < kCount; ++k) g.c[kFirst + k] = convertTo<T>(part[k]);
    });
    return g;
}

template <int N>
template <int Order, class T>
Jet<T, N, Order> SimplexNoise<N>::sumOfCorners(const Cell<Rebind<T, double>>& cell) const {
    using P = Rebind<T, double>;
    using Word = Rebind<T, uint64_t>;
    Vec<T, N> x, rank;
    for (int i = 0; i < N; ++i) {
        x[i] = convertTo<T>(cell.x[i]);
        rank[i] = convertTo<T>(cell.rank[i]);
    }
    Jet<T, N, Order> sum;
    unrolled<N + 1>([&](auto k) { // from the lowest corner the others follow the axes by their rank
        Word index = cell.index;
        Vec<T, N> d;
        for (size_t i = 0; i < N; ++i) {
            if constexpr (k > 0) index += select(cell.rank.c[i] < P(int{k}), Word(mSteps[i]), Word(0));
            const T along(lattice<T>().along[k]), beside(lattice<T>().beside[k]);
            d.c[i] = x.c[i] - (k == 0 ? beside : k == N ? along : select(rank.c[i] < T(int{k}), along, beside));
        }
        add(sum, index, d);
    });
    return sum;
}

template <int N>
template <class P>
auto SimplexNoise<N>::verticesInReach(const Cell<P>& cell) const -> std::array<uint32_t, size_t{kLanes<P>}> {
    using F = Rebind<P, float>;
    using Bits = Rebind<P, uint32_t>;
    Vec<F, N + 1> sorted;
    F reach(static_cast<float>(mRadius2) + 1e-5F), sum(0); // all roundings cost less
    for (int i = 0; i < N; ++i) {
        const F x = convertTo<F>(cell.x[i]), rank = convertTo<F>(cell.rank[i]);
        for (int r = 0; r < N; ++r) sorted[r] = select(rank == F(r), x, sorted[r]);
        reach = negMulAdd(x, x, reach);
        sum += x;
    }
    sorted[N] = -sum;
    Bits bits(0);
    F corner(0); // the product of it and the position
    unrolled<kNear>([&](auto k) {
        constexpr NearVertex<N> kVertex(k);
        if constexpr (k > 0 && kVertex.sign == 0) corner += sorted[kVertex.corner - 1];
        F product = corner;
        if constexpr (kVertex.sign > 0) product += sorted[kVertex.step];
        if constexpr (kVertex.sign < 0) product -= sorted[kVertex.step];
        // r² - |x - p|²
        const F w = mulAdd(F(2), mulAdd(sum, F(mTilts[k]), product), reach - F(mSquares[k]));
        bits += select(w <= F(0), Bits(0), Bits(uint32_t{1} << k)); // NaN is within reach
    });
    std::array<uint32_t, size_t{kLanes<P>}> inReach;
    store(bits, inReach.data());
    return inReach;
}

template <int N>
template <int Order, class T>
Jet<T, N, Order> SimplexNoise<N>::sumOfVertices(const Cell<Rebind<T, double>>& cell) const {
    using P = Rebind<T, double>;
    using Word = Rebind<T, uint64_t>;
    Vec<T, N> x, rank;
    uint64_t all = 0;
    for (int i = 0; i < N; ++i) {
        x[i] = convertTo<T>(cell.x[i]);
        rank[i] = convertTo<T>(cell.rank[i]);
        all += mSteps[static_cast<size_t>(i)];
    }
    auto inReach = verticesInReach(cell); // of 28 or 32, about 5
    Jet<T, N, Order> sum;
    for (;;) { // each lane the next one of its own
        Indices<T> next;
        uint32_t any = 0;
        for (size_t lane = 0; lane < inReach.size(); ++lane) {
            uint32_t& left = inReach[lane];
            any |= left;
            next[lane] = left == 0 ? uint32_t{kNear} : static_cast<uint32_t>(std::countr_zero(left));
            left &= left - 1;
        }
        if (any == 0) return sum;
        const auto [corner, step, sign, shift] = rowsAt<T, 4>(lattice<T>().near.data(), next);
        const T below = shift + T(1), at = select(step < corner, below, shift) + sign;
        const P cornerP = convertTo<P>(corner), stepP = convertTo<P>(step);
        Word index = cell.index, stepped = select(stepP == P(N), Word(-all), Word(0));
        Vec<T, N> d;
        for (int i = 0; i < N; ++i) {
            const Word one(mSteps[static_cast<size_t>(i)]);
            index += select(cell.rank[i] < cornerP, one, Word(0));
            stepped += select(cell.rank[i] == stepP, one, Word(0));
            d[i] = x[i] - select(rank[i] == step, at, select(rank[i] < corner, below, shift));
        }
        index += select(convertTo<P>(sign) < P(0), Word(0) - stepped, stepped);
        add(sum, index, d);
    }
}

template <int N>
template <int Order, class T>
Jet<T, N, Order> SimplexNoise<N>::at(const Vec<Rebind<T, double>, N>& x) const {
    const auto cell = this->cell(x);
    const T scale(static_cast<NumberOf<T>>(mScale));
    if constexpr (kNear > 0)
        if (!mCornersOnly) return sumOfVertices<Order, T>(cell) * scale;
    return sumOfCorners<Order, T>(cell) * scale;
}

extern template class SimplexNoise<2>;
extern template class SimplexNoise<3>;
extern template class SimplexNoise<4>;
extern template class SimplexNoise<5>;
extern template class SimplexNoise<6>;
extern template class SimplexNoise<7>;

} // namespace curlew
