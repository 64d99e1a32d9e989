// SPDX-License-Identifier: Apache-2.0
#include "curlew/noise/SimplexNoise.h"

#include "curlew/base/Error.h"

#include <fmt/format.h>

#include <bit>
#include <random>
#include <vector>

namespace curlew {

namespace {

/// Seeds std::mt19937 like CPython's random.seed(key) for a key of more than 32 bits: init_by_array of Matsumoto and
/// Nishimura's mt19937ar (2002).
struct ArraySeed {
    using result_type = uint32_t; // NOLINT: a name of the standard library
    uint64_t key = 0;

    template <class Iterator>
    void generate(Iterator begin, Iterator end) const {
        const auto n = static_cast<size_t>(end - begin);
        std::vector<uint32_t> state(n, 19650218);
        const auto mixed = [&](size_t i, uint32_t factor) { return (state[i - 1] ^ (state[i - 1] >> 30)) * factor; };
        for (size_t i = 1; i < n; ++i) state[i] = mixed(i, 1812433253) + static_cast<uint32_t>(i);
        size_t i = 1;
        const auto next = [&] {
            if (++i < n) return;
            state[0] = state[n - 1];
            i = 1;
        };
        for (size_t k = 0; k < n; ++k, next()) { // adds each half of the key and its index
            const auto half = static_cast<uint32_t>(k % 2);
            state[i] = (state[i] ^ mixed(i, 1664525)) + static_cast<uint32_t>(key >> (32 * half)) + half;
        }
        for (size_t k = 1; k < n; ++k, next()) state[i] = (state[i] ^ mixed(i, 1566083941)) - static_cast<uint32_t>(i);
        state[0] = uint32_t{1} << 31;
        std::copy(state.begin(), state.end(), begin);
    }
};

/// Shuffles like random.Random(key).shuffle(items) of CPython 3.2 and later: Fisher-Yates from the end. A random number
/// below n takes as many top bits as n has, and is drawn again if it is too large.
template <class Items>
void shuffleLikePython(Items& items, uint64_t key) {
    ArraySeed seed{key};
    std::mt19937 random(seed);
    for (size_t i = items.size() - 1; i > 0; --i) {
        size_t j = i + 1;
        while (j > i) j = random() >> (32 - std::bit_width(i + 1));
        std::swap(items[i], items[j]);
    }
}

/// Returns 1 / sup Σ (r² - |d|²)^power |d| over space, so that no value exceeds 1 with unit gradients. The suprema come
/// from gradient ascent from 300 starts in the simplex (numerical, not proven). They lie on a shortest edge, except for
/// N = 2, power 3: there, in the middle of a triangle. A search at these places gave all digits; the last are rounded
/// down.
double unitFactor(int dimensions, int power, bool corners) {
    constexpr std::array<std::array<double, 6>, 2> kCorners{
        {{32.990773983039539, 37.837227241611295, 41.408666249996, 44.149951224206, 46.310292907372, 47.074013308004},
         {99.204334582718658, 107.65348539728194, 108.567826464029, 108.709495580450, 108.731608286431,
          108.734143222732}}};
    constexpr std::array<std::array<double, 2>, 2> kWide{
        {{7.02544295365181, 7.13015784651847}, {13.11416018015006, 13.42147359344655}}}; // N = 6, 7; r² = 3/4
    const auto p = static_cast<size_t>(power - 3), n = static_cast<size_t>(dimensions);
    return corners ? kCorners[p][n - 2] : kWide[p][n - 6];
}

} // namespace

template <int N>
template <class T>
auto SimplexNoise<N>::makeLattice() const -> Lattice<T> {
    Lattice<T> lattice;
    for (size_t k = 0; k < size_t{kCorners}; ++k) {
        const double beside = -mUnskew * static_cast<double>(k);
        lattice.along[k] = static_cast<T>(1 + beside);
        lattice.beside[k] = static_cast<T>(beside);
    }
    for (int k = 0; k < kNear; ++k) {
        const NearVertex<N> v(k);
        lattice.near[static_cast<size_t>(k)] = {{static_cast<T>(v.corner), static_cast<T>(v.step),
                                                 static_cast<T>(v.sign), static_cast<T>(v.shift(mUnskew))}};
    }
    lattice.near[kNear] = {{T(0), T(N + 1), T(0), T(1000)}};
    return lattice;
}

template <int N>
SimplexNoise<N>::SimplexNoise(const SimplexOptions& options)
    : mPower(options.power), mPublishedHash(options.seed == 0) {
    const bool published =
        options.kernel == SimplexKernel::published || options.kernel == SimplexKernel::publishedContinuous;
    if (options.power != 4 && (published || options.power != 3))
        throw ValueError(fmt::format("simplex noise has no power {}; {}", options.power,
                                     published ? "the published noise has power 4" : "give 3 or 4"));

    const bool corners = N <= 5 || options.kernel != SimplexKernel::smooth;
    // r² = 3/4, because up to this value 4 (N+1) candidate vertices suffice and hardly any empty regions remain. For N
    // = 7 and power 4 the gradient is below 1 % of its rms in 10^-6 of space; with r² = 2/3 in 0.5 %, with 0.7 in 0.03
    // %, and with 4/5, which needs half as many vertices again, nowhere.
    mRadius2 = corners ? 0.5 : 0.75;
    const double length = std::sqrt(N - 1.0), factor = unitFactor(N, options.power, corners);
    mScale = factor / length;
    mBound = 1;
    if (published) {
        // By N, computed as in unitFactor, with the corners of one simplex only.
        constexpr std::array<double, 6> kBounds{1.1390632, 1.3368931, 1.2390073, 1.3553886, 1.4912974, 1.6156194};
        const double scale = std::pow(N - 1.0, -3.5) * 100 + 13;
        mScale = scale / length;
        mBound = scale / factor;
        if (options.kernel == SimplexKernel::published) {
            if (N > 2) mRadius2 = 15.0 / 16 * N / (N + 1);
            mBound = kBounds[N - 2];
        }
    }

    mCornersOnly = corners;
    mLattice = makeLattice<double>();
    mLatticeFloat = makeLattice<float>();
    for (int k = 0; k < kNear; ++k) {
        const NearVertex<N> v(k);
        double square = 0;
        for (int r = 0; r < N; ++r) {
            const double p = v.shift(mUnskew) + (r < v.corner) + (r == v.step ? v.sign : 0);
            square += p * p;
        }
        mTilts[static_cast<size_t>(k)] = static_cast<float>(v.tilt(mUnskew));
        mSquares[static_cast<size_t>(k)] = static_cast<float>(square);
    }

    // The gradients in the program's order before the shuffle: by the position of the 0, then by the signs of the
    // others, lowest bit first.
    std::array<Vec<int8_t, N>, kGradients> gradients;
    for (size_t k = 0; k < kGradients; ++k) {
        const size_t zero = k >> (N - 1);
        size_t signs = k;
        for (size_t i = 0; i < N; ++i) {
            gradients[k].c[i] = static_cast<int8_t>(i == zero ? 0 : signs % 2 ? 1 : -1);
            if (i != zero) signs /= 2;
        }
    }
    // Seeds other than 0 use another hash and not only another start index of the published one: that would leave the
    // fields correlated, in 2D by up to 0.1. They also translate the lattice. Otherwise all fields would share their
    // vertices, where they are 0 and have gradients in a few directions only.
    mIndex = mPublishedHash ? simplexHash(uint64_t{12345}) : randomBits(options.seed, 0, 1);
    for (uint64_t i = 0; i < N; ++i) {
        mSteps[i] = mPublishedHash ? uint64_t{1} << (5 * i % 16) : randomBits(options.seed, i, 2) | 1;
        if (!mPublishedHash) mTranslation.c[i] = std::floor(4096 * randomUniform(options.seed, i, 3)) / 4096;
    }
    shuffleLikePython(gradients, mIndex);
    for (size_t k = 0; k < kGradients; ++k)
        for (size_t i = 0; i < N; ++i) {
            const size_t row = k + i / 4 * kGradients;
            mGradients[row].c[i % 4] = gradients[k].c[i];
        }
}

template class SimplexNoise<2>;
template class SimplexNoise<3>;
template class SimplexNoise<4>;
template class SimplexNoise<5>;
template class SimplexNoise<6>;
template class SimplexNoise<7>;

} // namespace curlew
