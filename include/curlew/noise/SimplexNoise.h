// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/base/Random.h"
#include "curlew/math/Symbol.h"
#include "curlew/noise/RadialKernel.h"
#include "curlew/noise/SimplexVertex.h"

#include <array>
#include <bit>
#include <cstdint>

namespace curlew {

/// The lattice vertices that a SimplexNoise sums, its radius r, and the scale of the sum.
enum class SimplexKernel {
    smooth,              ///< All vertices within r; r² = 1/2 for N <= 5, 3/4 for N = 6 and 7. Within ±1.
    corners,             ///< The corners of the simplex, r² = 1/2. Within ±1. Zero in places for N = 6 and 7.
    published,           ///< The corners, r² = 15/16 N/(N+1) (N = 2: 1/2). Jumps at simplex faces for N >= 3.
    publishedContinuous, ///< The corners, r² = 1/2, scaled as `published`.
};

struct SimplexOptions {
    int power = 4; ///< Of the kernel (r² - |d|²)^power. 3: the noise is C²; 4: C³. Published kernels require 4.
    SimplexKernel kernel = SimplexKernel::smooth; ///< The published kernels serve for comparison.
    uint64_t seed = 0; ///< 0 selects the published gradient at each vertex; other seeds give independent fields.
};

/// Bob Jenkins's one-at-a-time hash of the three low bytes, as in the program that SimplexNoise cites: in 64 bits,
/// without truncation. Word is uint64_t, or lanes of it.
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

/// Simplex noise in N = 2 … 7 dimensions with a wavelength of about 1 (Perlin 2001; Gustavson 2005). The lattice, the
/// gradients and, for seed 0, the hash are those of github.com/Craig-Macomber/N-dimensional-simplex-noise ("the
/// program" below) with its seed 12345. The program shuffles its gradients twice; only the first shuffle, which is
/// seeded, is used here.
///
/// Computes Σ (r² - |d|²)^power (g·d) over lattice vertices, where d is the vector from the vertex to x and g the
/// gradient of the vertex. The height of a vertex over the opposite face is √(1/2) for every N, so if r² <= 1/2, the
/// corners of the simplex alone give a continuous noise. From N = 6 on that leaves gaps, because a point can be
/// √(N(N+2) / (12 (N+1))) away from all vertices (Conway and Sloane 1988: the covering radius of the lattice A*). There
/// `smooth` has a larger radius and sums all vertices within it. The rms of the default noise for N = 2 … 7 is 0.54,
/// 0.39, 0.25, 0.16, 0.14, 0.10.
///
/// The program's hash repeats after a short distance. In skewed coordinates, the vertices c and c + (32, -1, 0 …) have
/// the same gradient; from 5D on, so do c and c + (0, -1, 0, 0, 2 …). With seed 0 the noise therefore repeats after 27
/// to 29 units in 2D to 4D, and after only 2.2 units in 5D to 7D. Other seeds use a separate 64-bit hash, which repeats
/// after hundreds of units in 7D and later in fewer dimensions.
///
/// The lattice cell is subtracted in double, so T = float loses no accuracy far from the origin (|x| up to 2^50).
/// Compared with T = double it is accurate to 2e-6 (value), 1e-5 (gradient), 1e-4 (Hessian). Positions that are not
/// finite give NaN. Immutable after construction; safe to share between threads.
template <int N>
class SimplexNoise {
    static_assert(N >= 2 && N <= 7);

  public:
    using Options = SimplexOptions;
    static constexpr int kDimension = N;

    /// Throws ValueError if the kernel does not support the power.
    explicit SimplexNoise(const SimplexOptions& options = {});

    /// T may be lanes.
    template <int Order, class T>
    Jet<T, N, Order> at(const Vec<Rebind<T, double>, N>& x) const;

    /// Returns a bound of |value| for any choice of gradients, up to rounding.
    double maxAbs() const { return mBound; }

  private:
    static constexpr int kGradients = N << (N - 1), kRows = N <= 4 ? 1 : 2; ///< kRows rows of 4 numbers per gradient.

    /// The cell of the skewed lattice that contains a position, and the position in it. P is double or lanes of double.
    template <class P>
    struct Cell {
        Rebind<P, uint64_t> index; ///< Index of its lowest corner, not yet hashed.
        Vec<P, N> x;               ///< Position relative to that corner, in space.
        /// Rank of each axis by skewed coordinate, largest first. It identifies the simplex within the cell: with
        /// sorted axes all simplices are the same.
        Vec<P, N> rank;
    };
    template <class P>
    Cell<P> cell(const Vec<P, N>& x) const;

    /// Returns the gradient of a vertex, not normalised: one component is 0, the others are ±1.
    template <class T>
    Vec<T, N> gradient(const Rebind<T, uint64_t>& index) const;

    /// Adds the contribution of a vertex at the offset d of the position from it.
    template <int Order, class T>
    void add(Jet<T, N, Order>& sum, const Rebind<T, uint64_t>& index, const Vec<T, N>& d) const {
        if constexpr (std::floating_point<T>) { // a vertex out of reach would add zeros; lanes are rarely all out of
                                                // reach
            T w = static_cast<T>(mRadius2);
            for (int i = 0; i < N; ++i) w = negMulAdd(d[i], d[i], w);
            if (w <= T(0)) return; // false for NaN, which must be passed on
        }
        if constexpr (kSymbolic<T>) {
            const auto contribution = [this](const Rebind<T, uint64_t>& vertex, const Vec<T, N>& offset) {
                Jet<T, N, Order> jet;
                addContribution(jet, vertex, offset);
                return jet;
            };
            sum += outlined<Jet<T, N, Order>>("vertex", contribution, index, d);
        } else {
            addContribution(sum, index, d);
        }
    }
    template <int Order, class T>
    void addContribution(Jet<T, N, Order>& sum, const Rebind<T, uint64_t>& index, const Vec<T, N>& d) const {
        addRadialKernel(sum, mPower, static_cast<T>(mRadius2), gradient<T>(index), d);
    }
    /// Sums over the N + 1 corners of the simplex. N <= 5, where kernels with r² = 1/2 reach no other vertex.
    template <int Order, class T>
    Jet<T, N, Order> sumOfCorners(const Cell<Rebind<T, double>>& cell) const;
    /// Sums over the vertices within reach: all of them, or only the corners. N >= 6.
    template <int Order, class T>
    Jet<T, N, Order> sumOfVertices(const Cell<Rebind<T, double>>& cell) const;

    static constexpr int kNear = N <= 5 ? 0 : NearVertex<N>::kCount, kCorners = kNear > 0 ? 0 : N + 1;
    /// Returns a bit mask of the near vertices to sum: those within reach of a position, or only the corners among
    /// them. It may include some that are just beyond.
    template <class P>
    std::array<uint32_t, size_t{kLanes<P>}> verticesInReach(const Cell<P>& cell) const;

    /// The lattice in numbers of type T.
    template <class T>
    struct Lattice {
        /// The coordinates of corner k: `along` the axes of rank below k, and `beside` them.
        std::array<T, kCorners> along, beside;
        /// One row per near vertex: corner, step, sign, shift. The last row is out of reach of every position.
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

    // The lattice: y = x + skew Σx maps its vertices to integer points (Gustavson 2005), and x = y - unskew Σy back.
    double mSkew = (std::sqrt(N + 1.0) - 1) / N, mUnskew = (1 - 1 / std::sqrt(N + 1.0)) / N;
    int mPower;
    bool mPublishedHash;
    uint64_t mIndex;                  // index of the vertex at 0, not yet hashed
    std::array<uint64_t, N> mSteps{}; // what a step along each axis adds to the index
    bool mCornersOnly;
    double mRadius2 = 0, mScale = 0, mBound = 0;
    Vec<double, N> mTranslation{}; // of the lattice; from the seed
    Lattice<double> mLattice;
    Lattice<float> mLatticeFloat;
    std::array<float, kNear> mSquares, mTilts; // of near vertices: |p|² and tilt
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
        // Farther out, and for NaN, doubles do not resolve the lattice: any index will do.
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
    using F = Rebind<T, float>;
    const Rebind<T, uint64_t> hash = mPublishedHash ? simplexHash(index) : mixedWord(index);
    const auto places = indicesOf(remainderOf<F>(hash, kGradients), kGradients - 1);
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
    unrolled<N + 1>([&](auto k) { // from the lowest corner, the others follow along the axes by rank
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
    F reach(static_cast<float>(mRadius2) + 1e-5F), sum(0); // 1e-5 exceeds the sum of all rounding errors
    for (int i = 0; i < N; ++i) {
        const F x = convertTo<F>(cell.x[i]), rank = convertTo<F>(cell.rank[i]);
        for (int r = 0; r < N; ++r) sorted[r] = select(rank == F(r), x, sorted[r]);
        reach = negMulAdd(x, x, reach);
        sum += x;
    }
    sorted[N] = -sum;
    Bits bits(0);
    F corner(0); // dot product of the corner and the position
    unrolled<kNear>([&](auto k) {
        constexpr NearVertex<N> kVertex(k);
        if constexpr (k > 0 && kVertex.sign == 0) corner += sorted[kVertex.corner - 1];
        F product = corner;
        if constexpr (kVertex.sign > 0) product += sorted[kVertex.step];
        if constexpr (kVertex.sign < 0) product -= sorted[kVertex.step];
        // r² - |x - p|²
        const F w = mulAdd(F(2), mulAdd(sum, F(mTilts[k]), product), reach - F(mSquares[k]));
        bits += select(w <= F(0), Bits(0), Bits(uint32_t{1} << k)); // NaN counts as within reach
    });
    if (mCornersOnly) bits = bits & Bits(0x11111111); // one of four
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
    Jet<T, N, Order> sum;
    const auto addVertex = [&](const T& corner, const T& step, const T& sign, const T& shift) {
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
    };
    if constexpr (kSymbolic<T>) { // those out of reach add zero
        for (size_t k = 0; k < size_t{kNear}; k += mCornersOnly ? 4 : 1) {
            const auto& [corner, step, sign, shift] = lattice<T>().near[k].c;
            addVertex(T(corner), T(step), T(sign), T(shift));
        }
        return sum;
    } else {
        auto inReach = verticesInReach(cell); // about 5 of 28 or 32
        for (;;) {                            // each pass takes the next vertex of every lane
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
            addVertex(corner, step, sign, shift);
        }
    }
}

template <int N>
template <int Order, class T>
Jet<T, N, Order> SimplexNoise<N>::at(const Vec<Rebind<T, double>, N>& x) const {
    const auto cell = this->cell(x);
    const T scale(static_cast<NumberOf<T>>(mScale));
    if constexpr (kNear > 0)
        return sumOfVertices<Order, T>(cell) * scale;
    else
        return sumOfCorners<Order, T>(cell) * scale;
}

extern template class SimplexNoise<2>;
extern template class SimplexNoise<3>;
extern template class SimplexNoise<4>;
extern template class SimplexNoise<5>;
extern template class SimplexNoise<6>;
extern template class SimplexNoise<7>;

} // namespace curlew
