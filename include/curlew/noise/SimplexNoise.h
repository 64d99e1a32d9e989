#pragma once

#include "curlew/base/Random.h"
#include "curlew/noise/RadialKernel.h"

#include <array>
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

/// Bob Jenkins's one-at-a-time hash of the three low bytes, as the program has it: in 64 bits, nothing cut off.
constexpr uint64_t simplexHash(uint64_t word) {
    uint64_t hash = 0;
    for (int byte = 0; byte < 3; ++byte) {
        hash += (word >> (8 * byte)) & 255;
        hash += hash << 10;
        hash ^= hash >> 6;
    }
    hash += hash << 3;
    hash ^= hash >> 11;
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

    template <int Order, class T>
    Jet<T, N, Order> at(const Vec<double, N>& x) const;

    /// |value| never exceeds it, whatever the gradients (to rounding).
    double bound() const { return mBound; }

  private:
    static constexpr int kVertices = N <= 5 ? N + 1 : 4 * (N + 1); ///< That can be near a point of a simplex.
    static constexpr int kGradients = N << (N - 1);

    // Of the lattice: y = x + skew Σx has the vertices at integer points (Gustavson 2005), x = y - unskew Σy.
    static double skew() { return (std::sqrt(N + 1.0) - 1) / N; }
    static double unskew() { return (1 - 1 / std::sqrt(N + 1.0)) / N; }

    /// A coordinate of a vertex, modulo 2^64. Beyond 2^62, and for NaN, there is no lattice left: any number will do.
    static uint64_t whole(double c) {
        return std::abs(c) < 0x1p62 ? static_cast<uint64_t>(static_cast<int64_t>(c)) : 0;
    }
    /// The gradient of a vertex, not normalised: of components ±1, and one 0.
    const Vec<int8_t, N>& gradient(uint64_t index) const {
        return mGradients[(mPublishedHash ? simplexHash(index) : mixBits(index)) % kGradients];
    }

    template <class T>
    const std::array<Vec<T, kVertices>, N>& vertices() const {
        if constexpr (std::is_same_v<T, float>)
            return mVerticesFloat;
        else
            return mVertices;
    }

    int mPower;
    bool mPublishedHash;
    uint64_t mIndex;                  // of the vertex at 0 before it is hashed
    std::array<uint64_t, N> mSteps{}; // what a step along each axis adds to it
    double mRadius2 = 0, mScale = 0, mBound = 0;
    Vec<double, N> mTranslation{}; // of the lattice, from the seed
    // Those near a simplex whose coordinates, from its lowest corner, fall from the first axis to the last.
    std::array<Vec<int8_t, N>, kVertices> mOffsets;  // skewed, by vertex
    std::array<Vec<double, kVertices>, N> mVertices; // in space, by axis
    std::array<Vec<float, kVertices>, N> mVerticesFloat;
    std::array<Vec<int8_t, N>, kGradients> mGradients;
};

template <int N>
template <int Order, class T>
Jet<T, N, Order> SimplexNoise<N>::at(const Vec<double, N>& x) const {
    // The cell of the skewed lattice that x is in, and where.
    const Vec<double, N> moved = x + mTranslation;
    double sum = 0;
    for (const double c : moved.c) sum += c;
    const double skewed = sum * skew();
    uint64_t cell = mIndex;
    Vec<double, N> r;
    double sumR = 0;
    for (int i = 0; i < N; ++i) {
        const double y = moved[i] + skewed, low = std::floor(y);
        r[i] = y - low;
        sumR += r[i];
        cell += whole(low) * mSteps[static_cast<size_t>(i)];
    }
    // Place of each axis when r is sorted, the largest first: it tells the simplex within the cell. In sorted axes all
    // simplices are the same.
    std::array<size_t, N> rank{};
    for (int i = 0; i < N; ++i)
        for (int j = i + 1; j < N; ++j) {
            const bool less = r[i] < r[j];
            rank[static_cast<size_t>(i)] += less;
            rank[static_cast<size_t>(j)] += !less;
        }
    Vec<T, N> sorted;
    for (size_t i = 0; i < N; ++i) sorted.c[rank[i]] = static_cast<T>(r.c[i] - unskew() * sumR);

    Vec<T, kVertices> kernel; // r² - |d|² of all vertices
    kernel.c.fill(static_cast<T>(mRadius2));
    for (size_t i = 0; i < N; ++i)
        for (int v = 0; v < kVertices; ++v) {
            const T d = sorted.c[i] - vertices<T>()[i][v];
            kernel[v] -= d * d;
        }
    Jet<T, N, Order> noise;
    for (int v = 0; v < kVertices; ++v) {
        if (kernel[v] <= T(0)) continue; // NaN goes on
        uint64_t index = cell;
        Vec<T, N> d, g;
        for (size_t i = 0; i < N; ++i) {
            index += static_cast<uint64_t>(mOffsets[static_cast<size_t>(v)].c[rank[i]]) * mSteps[i];
            d.c[i] = sorted.c[rank[i]] - vertices<T>()[rank[i]][v];
        }
        const Vec<int8_t, N>& dealt = gradient(index);
        for (int i = 0; i < N; ++i) g[i] = static_cast<T>(dealt[i]);
        if (mPower == 4)
            addRadialKernel<4>(noise, static_cast<T>(mRadius2), g, d);
        else
            addRadialKernel<3>(noise, static_cast<T>(mRadius2), g, d);
    }
    return noise * static_cast<T>(mScale);
}

extern template class SimplexNoise<2>;
extern template class SimplexNoise<3>;
extern template class SimplexNoise<4>;
extern template class SimplexNoise<5>;
extern template class SimplexNoise<6>;
extern template class SimplexNoise<7>;

} // namespace curlew
