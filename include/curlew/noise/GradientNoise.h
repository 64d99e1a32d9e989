// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/noise/CubicLattice.h"

namespace curlew {

template <int N>
struct GradientNoiseOptions {
    Vec<int, N> period{}; ///< Tiles with this period along each axis, in cells; 0: does not tile.
    uint64_t seed = 0;    ///< 0 is the published function; other seeds give independent fields.
};

/// Gradient noise on the integer lattice with an integer hash, N = 2, 3, as in the image warps of Bærentzen et al.,
/// "Improving Curl Noise" (2025); the hash is that of Quilez's gradient noises. Each vertex has a ramp with a gradient
/// anywhere in the cube [-1, 1]^N. The ramps are blended with quintic fades and not scaled further.
///
/// C², with a wavelength of about 1.5 (2 pi rms value / rms gradient); zero at all vertices. If it does not tile, it
/// repeats after 2^28 cells, because the hash depends on the lowest 28 bits of a vertex only. The lattice cell is
/// subtracted in double, so T = float loses no accuracy far from the origin (|x| up to 2^51). Compared with T = double
/// it is accurate to 5e-6 (value), 2e-5 (gradient), 1e-4 (Hessian). Immutable after construction; safe to share between
/// threads.
template <int N>
class GradientNoise {
    static_assert(N == 2 || N == 3);

  public:
    using Options = GradientNoiseOptions<N>;
    static constexpr int kDimension = N;
    /// At an offset d from its vertex, a ramp is at most |d|_1. The blend of |d|_1 over the corners is the sum over the
    /// axes of s (1 - fade) + (1 - s) fade = 1/2 - 2 (s - 1/2) (fade - 1/2) <= 1/2. Only 2^N gradients at corners of
    /// the cube reach this bound; the largest observed values are 0.89 (N = 2) and 0.87 (N = 3).
    static constexpr double kBound = 0.5 * N;

    /// Throws ValueError if a period is negative.
    explicit GradientNoise(const GradientNoiseOptions<N>& options = {});

    /// T may be lanes.
    template <int Order, class T>
    Jet<T, N, Order> at(const Vec<Rebind<T, double>, N>& x) const;

    double maxAbs() const { return kBound; }

  private:
    CubicLattice<N> mLattice;
    std::array<uint32_t, N> mOffset{}; // added to the vertices before they are hashed; from the seed
};

template <int N>
template <int Order, class T>
Jet<T, N, Order> GradientNoise<N>::at(const Vec<Rebind<T, double>, N>& x) const {
    // One row per component of the gradient. In 2D, these are the first two components of the 3D gradient at the vertex
    // (i, j, 0).
    constexpr std::array<std::array<uint32_t, 3>, 3> kMix{{{127, 311, 74}, {269, 183, 246}, {113, 271, 124}}};
    constexpr uint32_t kMask = 0x0fffffff;
    using Word = Rebind<T, uint32_t>;
    const auto cell = mLattice.cell(x);
    const Vec<T, N> s = cell.template position<T>();
    // The terms that the lower and the upper corners along each axis add to the hashed number.
    std::array<std::array<std::array<Word, N>, 2>, N> terms;
    unrolled<N>([&](auto axis) {
        const auto& [low, high] = cell.index[axis];
        const auto wordAt = [&](const auto& index) { return convertTo<Word>(wordOf(index)) + Word(mOffset[axis]); };
        for (size_t c = 0; c < N; ++c) {
            const Word mix(kMix[c][axis]);
            auto& [lower, upper] = terms[axis];
            lower[c] = wordAt(low) * mix;
            upper[c] = mLattice.wrapsAsWords(axis) ? lower[c] + mix : wordAt(high) * mix;
        }
    });
    return blendCorners<Order>(s, [&](size_t k) {
        Vec<T, N> gradient;
        for (size_t c = 0; c < N; ++c) {
            Word n = terms[0][k & 1][c];
            for (size_t axis = 1; axis < N; ++axis) n += terms[axis][k >> axis & 1][c];
            n = n ^ (n << 13);
            n = n * (n * n * Word(15731) + Word(789221)) + Word(1376312589);
            gradient.c[c] = mulAdd(convertTo<T>(n & Word(kMask)), static_cast<T>(2.0 / kMask), T(-1));
        }
        return cornerRamp<std::min(Order, 1)>(gradient, s, k);
    });
}

} // namespace curlew
