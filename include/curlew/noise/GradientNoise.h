#pragma once

#include "curlew/noise/CubicLattice.h"

namespace curlew {

template <int N>
struct GradientNoiseOptions {
    Vec<int, N> period{}; ///< Tiles with this period along each axis, in cells; 0: does not tile.
    uint64_t seed = 0;    ///< 0 is the published function; other seeds give independent fields.
};

/// Gradient noise on the lattice of whole numbers with an integer hash, N = 2, 3, as in the image warps of Bærentzen et
/// al., "Improving Curl Noise" (2025); the hash is that of Quilez's gradient noises. At each vertex a ramp whose
/// gradient is anywhere in the cube [-1, 1]^N, blended with quintic fades, not scaled further.
///
/// C², of wavelength about 1.5 (2 pi rms value / rms gradient), zero at all vertices. Where it does not tile it repeats
/// after 2^28 cells: what the hash keeps depends on no higher bits of a vertex. The lattice cell is taken off in
/// double, so T = float loses nothing far from the origin (|x| up to 2^52); against T = double it is accurate to 5e-6
/// (value), 2e-5 (gradient), 1e-4 (Hessian). Immutable after construction, safe to share between threads.
template <int N>
class GradientNoise {
    static_assert(N == 2 || N == 3);

  public:
    using Options = GradientNoiseOptions<N>;
    static constexpr int kDimension = N;
    /// No ramp exceeds |d|_1 at a distance d from its vertex. The blend of these over the corners is the sum over the
    /// axes of s (1 - fade) + (1 - s) fade = 1/2 - 2 (s - 1/2) (fade - 1/2) <= 1/2. It takes 2^N gradients in corners
    /// of the cube to reach it: seen are 0.89 (N = 2) and 0.87 (N = 3).
    static constexpr double kBound = 0.5 * N;

    /// Throws ValueError for a negative period.
    explicit GradientNoise(const GradientNoiseOptions<N>& options = {});

    template <int Order, class T>
    Jet<T, N, Order> at(const Vec<double, N>& x) const;

    double bound() const { return kBound; }

  private:
    /// The gradient at a vertex. In 2D: of that of the vertex (i, j, 0) in 3D the first two components.
    static Vec<double, N> gradient(const std::array<uint32_t, N>& vertex);

    CubicLattice<N> mLattice;
    std::array<uint32_t, N> mOffset{}; // of the vertices that the hash sees, from the seed
};

template <int N>
Vec<double, N> GradientNoise<N>::gradient(const std::array<uint32_t, N>& vertex) {
    constexpr std::array<std::array<uint32_t, 3>, 3> kMix{{{127, 311, 74}, {269, 183, 246}, {113, 271, 124}}};
    constexpr uint32_t kMask = 0x0fffffff;
    Vec<double, N> g;
    for (size_t c = 0; c < N; ++c) {
        uint32_t n = 0;
        for (size_t axis = 0; axis < N; ++axis) n += kMix[c][axis] * vertex[axis];
        n ^= n << 13;
        n = n * (n * n * 15731u + 789221u) + 1376312589u;
        g[static_cast<int>(c)] = 2.0 * (n & kMask) / kMask - 1.0;
    }
    return g;
}

template <int N>
template <int Order, class T>
Jet<T, N, Order> GradientNoise<N>::at(const Vec<double, N>& x) const {
    const CubicCell<N> cell = mLattice.cell(x);
    const Vec<T, N> s = cell.template position<T>();
    return blendCorners<Order>(s, [&](size_t k) {
        std::array<uint32_t, N> vertex;
        for (size_t axis = 0; axis < N; ++axis) vertex[axis] = cell.index[axis][k >> axis & 1] + mOffset[axis];
        const Vec<double, N> exact = gradient(vertex);
        Vec<T, N> g;
        for (int axis = 0; axis < N; ++axis) g[axis] = static_cast<T>(exact[axis]);
        return cornerRamp<Order>(g, s, k);
    });
}

} // namespace curlew
