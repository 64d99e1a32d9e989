#pragma once

#include "curlew/math/Jet.h"

#include <algorithm>
#include <array>
#include <cstdint>

namespace curlew {

struct PsrdOptions {
    Vec<int, 3> period{}; ///< Tiles with this period along each axis, in lattice units; 0: does not tile.
    double alpha = 0;     ///< Rotation of the gradients, radians ("flow noise"); 2 pi is a full turn.
    uint64_t seed = 0;    ///< 0 is the published function; other seeds give independent fields.
};

/// Tiling simplex noise in 3D with rotating gradients: psrdnoise of Gustavson and McEwan 2021 ("the paper" below), on
/// its default, axis-aligned grid and with its default rotation of gradients.
///
/// C², of wavelength about 1, values within ±kBound (seen: ±1.0214). The Hessian is the true one: the published
/// second-derivative code scales the diagonal by 35.0 instead of 39.5.
/// The lattice cell is taken off in double, so T = float loses nothing far from the origin (|x| up to 2^31); against
/// T = double it is accurate to 1e-4 (value), 5e-4 (gradient), 3e-3 (Hessian).
/// Immutable after construction, safe to share between threads.
class Psrd3 {
  public:
    static constexpr double kBound = 1.0440;

    /// Throws ValueError for a negative period.
    explicit Psrd3(const PsrdOptions& options = {});

    template <int Order, class T>
    Jet<T, 3, Order> at(const Vec3d& x) const;

    double bound() const { return kBound; }

  private:
    static constexpr int kHashes = 289;
    static constexpr double kScale = 39.5;
    using LatticePoint = std::array<int, 3>;

    /// Hash of a lattice vertex given in simplex coordinates, each within [0, kHashes).
    int hash(const LatticePoint& i) const;
    /// The vertex at `base + offset`, reduced to its period and then to [0, kHashes).
    LatticePoint reduce(const Vec3d& base, const LatticePoint& offset) const;

    template <class T>
    const std::array<Vec3<T>, kHashes>& gradients() const {
        if constexpr (std::is_same_v<T, float>)
            return mGradientsFloat;
        else
            return mGradients;
    }

    PsrdOptions mOptions;
    bool mTiles = false;
    LatticePoint mShift{}; // of the hash, from the seed
    std::array<uint16_t, 2 * kHashes> mPermutation;
    std::array<Vec3d, kHashes> mGradients;
    std::array<Vec3f, kHashes> mGradientsFloat;
};

inline int Psrd3::hash(const LatticePoint& i) const {
    const auto permute = [&](int a) { return static_cast<int>(mPermutation[static_cast<size_t>(a)]); };
    return permute(permute(permute(i[2]) + i[1]) + i[0]);
}

inline Psrd3::LatticePoint Psrd3::reduce(const Vec3d& base, const LatticePoint& offset) const {
    Vec3d i = base + Vec3d{{double(offset[0]), double(offset[1]), double(offset[2])}};
    if (mTiles) {
        // Wrap in space, where vertices lie at multiples of 1/2, so all of this is exact.
        Vec3d v{{0.5 * (i[1] + i[2] - i[0]), 0.5 * (i[0] + i[2] - i[1]), 0.5 * (i[0] + i[1] - i[2])}};
        for (int axis = 0; axis < 3; ++axis)
            if (const double p = mOptions.period[axis]; p > 0) v[axis] -= p * std::floor(v[axis] / p);
        i = Vec3d{{v[1] + v[2], v[0] + v[2], v[0] + v[1]}};
    }
    LatticePoint reduced;
    for (int axis = 0; axis < 3; ++axis) {
        const double n = i[axis] + mShift[static_cast<size_t>(axis)];
        double r = n - kHashes * std::floor(n * (1.0 / kHashes));
        // The rounded reciprocal can be off by one period next to a multiple of it. Beyond 2^50, and for NaN, there is
        // no lattice left: any index in range will do.
        if (r < 0) r += kHashes;
        if (r >= kHashes) r -= kHashes;
        reduced[static_cast<size_t>(axis)] = r >= 0 && r < kHashes ? static_cast<int>(r) : 0;
    }
    return reduced;
}

template <int Order, class T>
Jet<T, 3, Order> Psrd3::at(const Vec3d& x) const {
    // The simplex of x in the skewed lattice (paper, Fig. 3 and Table 1, steps 2 and 3).
    const Vec3d u{{x[1] + x[2], x[0] + x[2], x[0] + x[1]}};
    const Vec3d base{{std::floor(u[0]), std::floor(u[1]), std::floor(u[2])}};
    const Vec3d r = u - base;
    const int gx = r[1] >= r[0], gy = r[2] >= r[1], gz = r[2] >= r[0];
    const std::array<int, 3> g{1 - gz, gx, gy}, l{1 - gx, 1 - gy, gz};
    std::array<LatticePoint, 4> corners{};
    for (size_t k = 0; k < 3; ++k) {
        corners[1][k] = g[k] & l[k];
        corners[2][k] = g[k] | l[k];
        corners[3][k] = 1;
    }
    const Vec3<T> x0{{static_cast<T>(0.5 * (r[1] + r[2] - r[0])), static_cast<T>(0.5 * (r[0] + r[2] - r[1])),
                      static_cast<T>(0.5 * (r[0] + r[1] - r[2]))}};
    // Sum over the corners of w³ (g·d), w = 1/2 - d·d (paper, Table 2), with its derivatives.
    Jet<T, 3, Order> sum;
    for (const LatticePoint& c : corners) {
        const Vec3<T> d{{x0[0] - T(0.5) * T(c[1] + c[2] - c[0]), x0[1] - T(0.5) * T(c[0] + c[2] - c[1]),
                         x0[2] - T(0.5) * T(c[0] + c[1] - c[2])}};
        const T w = std::max(T(0.5) - dot(d, d), T(0));
        const Vec3<T>& gradient = gradients<T>()[static_cast<size_t>(hash(reduce(base, c)))];
        const T ramp = dot(gradient, d), w2 = w * w, w3 = w2 * w;
        sum.value += w3 * ramp;
        if constexpr (Order >= 1) sum.gradient += gradient * w3 - d * (T(6) * w2 * ramp);
        if constexpr (Order >= 2)
            for (int i = 0; i < 3; ++i)
                for (int j = i; j < 3; ++j)
                    sum.hessian(i, j) += T(24) * w * ramp * d[i] * d[j] -
                                         T(6) * w2 * (gradient[i] * d[j] + gradient[j] * d[i] + (i == j ? ramp : T(0)));
    }
    return sum * T(kScale);
}

} // namespace curlew
