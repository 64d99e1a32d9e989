#pragma once

#include "curlew/math/Fade.h"
#include "curlew/math/Jet.h"

#include <algorithm>
#include <array>
#include <cstdint>

namespace curlew {

// What the noises on the lattice of whole numbers share: the cell of a position, Perlin's hash of its corners, and the
// blend of what the corners say. Corner k of a cell is the upper one along each axis whose bit is set in k.

/// i modulo p, within [0, p), for whole numbers |i| < 2^52. Beyond, where there is no lattice left, and for NaN: any
/// number.
inline double floorMod(double i, double p) { return i - p * std::floor(i / p); }

/// Throws ValueError for a negative period.
void requirePeriod(int period);

template <int N>
struct CubicCell {
    std::array<std::array<uint32_t, 2>, N> index{}; ///< Of the lower and the upper corners along each axis.
    Vec<double, N> fraction;                        ///< Position in the cell, within [0, 1).

    template <class T>
    Vec<T, N> position() const {
        Vec<T, N> s;
        for (int axis = 0; axis < N; ++axis) s[axis] = static_cast<T>(fraction[axis]);
        return s;
    }
};

/// The cells of space, their corners counted modulo the period along each axis: so all that follows tiles exactly.
/// A seed translates the lattice by a multiple of 1/4096 along each axis. Without that two fields would have their
/// vertices in common, where a value noise has no gradient, and two gradient noises often have parallel ones; the flow
/// grad f x grad g would stand still there.
template <int N>
class CubicLattice {
  public:
    /// `natural`: the period along an axis for which 0 is given, up to 2^32. Throws ValueError for a negative period.
    CubicLattice(const Vec<int, N>& period, double natural, uint64_t seed);

    CubicCell<N> cell(const Vec<double, N>& x) const;

  private:
    Vec<double, N> mPeriod, mShift;
};

template <int N>
CubicCell<N> CubicLattice<N>::cell(const Vec<double, N>& x) const {
    CubicCell<N> cell;
    for (int axis = 0; axis < N; ++axis) {
        // The shift is added to the fraction, which positions a period apart have in common to the bit.
        double i = std::floor(x[axis]), s = x[axis] - i + mShift[axis];
        if (s >= 1) {
            s -= 1;
            i += 1;
        }
        const double p = mPeriod[axis], lower = floorMod(i, p);
        auto& [low, high] = cell.index[static_cast<size_t>(axis)];
        low = lower >= 0 && lower < p ? static_cast<uint32_t>(lower) : 0;
        high = low + 1.0 < p ? low + 1 : 0;
        cell.fraction[axis] = s;
    }
    return cell;
}

/// The hash of Perlin 2002: a permutation of 0 ... 255, looked up once for each axis with the sum of the index there
/// and what was found before. Of an index it sees the last 8 bits. A seed other than 0 shuffles the permutation.
class PermutationHash {
  public:
    explicit PermutationHash(uint64_t seed);

    /// Of all corners of a cell, each within [0, 255].
    template <int N>
    std::array<uint32_t, 1 << N> operator()(const CubicCell<N>& cell) const {
        std::array<uint32_t, 1 << N> hashes{};
        for (size_t axis = 0, count = 1; axis < N; ++axis, count *= 2)
            for (size_t k = 0; k < count; ++k) {
                const uint32_t before = hashes[k];
                for (size_t upper = 0; upper < 2; ++upper)
                    hashes[k + upper * count] = mTwice[before + (cell.index[axis][upper] & 255u)];
            }
        return hashes;
    }

  private:
    std::array<uint8_t, 512> mTwice; // the permutation, and once more: no sum need be reduced
};

/// The linear function with this gradient that is zero at corner k, at s in the cell.
template <int Order, class T, int N>
Jet<T, N, Order> cornerRamp(const Vec<T, N>& gradient, Vec<T, N> s, size_t k) {
    for (int axis = 0; axis < N; ++axis) s[axis] -= T(k >> axis & 1);
    Jet<T, N, Order> ramp(dot(gradient, s));
    if constexpr (Order >= 1) ramp.gradient = gradient;
    return ramp;
}

/// The blend at s in the cell of functions that belong to its corners, constant or linear, with quintic fades: C², and
/// at a corner with first and second derivatives of the function there. corner(k): the jet of the k-th at s.
template <int Order, class T, int N, class Corner>
Jet<T, N, Order> blendCorners(const Vec<T, N>& s, const Corner& corner) {
    std::array<Jet<T, N, Order>, 1 << N> jets;
    for (size_t k = 0; k < jets.size(); ++k) jets[k] = corner(k);
    for (int axis = N - 1; axis >= 0; --axis) {
        Univariate<T> fade = quinticFade(s[axis]);
        fade.value = std::min(fade.value, T(1)); // its rounding must not lead out of the range of the corners
        const size_t half = size_t{1} << axis;
        for (size_t k = 0; k < half; ++k) {
            // a + (b - a) fade, with its derivatives. Most of those of the fade are zero: no need for the whole product
            // rule.
            Jet<T, N, Order>& a = jets[k];
            const Jet<T, N, Order> rise = jets[k + half] - a;
            [[maybe_unused]] Jet<T, N, Order> sum;
            if constexpr (Order >= 3) sum = a + rise * compose(Jet<T, N, Order>::variable(s[axis], axis), fade);
            a += rise * fade.value;
            if constexpr (Order >= 1) a.gradient[axis] += rise.value * fade.first;
            if constexpr (Order >= 2) {
                for (int j = 0; j < N; ++j) a.hessian(axis, j) += T(j == axis ? 2 : 1) * rise.gradient[j] * fade.first;
                a.hessian(axis, axis) += rise.value * fade.second;
            }
            if constexpr (Order >= 3) a.third = sum.third; // alone: the others to the bit as without it
        }
    }
    return jets[0];
}

} // namespace curlew
