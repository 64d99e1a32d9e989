// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/math/Fade.h"
#include "curlew/math/Jet.h"

#include <algorithm>
#include <array>
#include <cstdint>

namespace curlew {

// What the noises on the lattice of whole numbers share: the cell of a position, Perlin's hash of its corners, and the
// blend of what the corners say. Corner k of a cell is the upper one along each axis whose bit is set in k. P stands
// for double, or for lanes of it (math/Lanes.h).

/// Throws ValueError for a negative period.
void requirePeriod(int period);

template <class P, int N>
struct CubicCell {
    std::array<std::array<P, 2>, N> index; ///< Of the lower and the upper corners along each axis: whole numbers.
    Vec<P, N> fraction;                    ///< Position in the cell, within [0, 1).

    template <class T>
    Vec<T, N> position() const {
        Vec<T, N> s;
        for (int axis = 0; axis < N; ++axis) s[axis] = convertTo<T>(fraction[axis]);
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

    template <class P>
    CubicCell<P, N> cell(const Vec<P, N>& x) const;

  private:
    Vec<double, N> mPeriod, mInverse, mShift;
};

template <int N>
template <class P>
CubicCell<P, N> CubicLattice<N>::cell(const Vec<P, N>& x) const {
    CubicCell<P, N> cell;
    for (int axis = 0; axis < N; ++axis) {
        // The shift is added to the fraction, which positions a period apart have in common to the bit.
        const P whole = floor(x[axis]), sum = x[axis] - whole + P(mShift[axis]);
        const auto next = sum >= P(1);
        cell.fraction[axis] = select(next, sum - P(1), sum);
        const double p = mPeriod[axis];
        const P modulo = floorMod(select(next, whole + P(1), whole), p, mInverse[axis]);
        auto& [low, high] = cell.index[static_cast<size_t>(axis)];
        low = min(max(modulo, P(0)), P(p - 1)); // where there is no lattice left, too
        high = select(low < P(p - 1), low + P(1), P(0));
    }
    return cell;
}

/// The hash of Perlin 2002: a permutation of 0 ... 255, looked up once for each axis with the sum of the index there
/// and what was found before. Of an index it sees the last 8 bits. A seed other than 0 shuffles the permutation.
class PermutationHash {
  public:
    static constexpr size_t kSize = 256;
    explicit PermutationHash(uint64_t seed);

    /// Where the hashes of all corners of a cell are looked up in the end: whole numbers of 0 … 511, to be taken modulo
    /// 256.
    template <class P, int N>
    std::array<Rebind<P, float>, 1 << N> places(const CubicCell<P, N>& cell) const;

    /// The hash at such a place, within [0, 255].
    template <class Hash>
    Hash at(const Hash& place) const {
        return valuesAt(mPermutation, place);
    }

  private:
    std::array<float, kSize> mPermutation; // floats, in which lanes compute exactly
};

template <class P, int N>
std::array<Rebind<P, float>, 1 << N> PermutationHash::places(const CubicCell<P, N>& cell) const {
    using Hash = Rebind<P, float>;
    std::array<Hash, 1 << N> places;
    unrolled<N>([&](auto axis) {
        const auto& [low, high] = cell.index[axis];
        const P lowest = negMulAdd(floor(low * P(1.0 / kSize)), P(kSize), low);
        // The upper index may be 256 here: with a hash that is at most 511.
        const Hash lower = convertTo<Hash>(lowest), upper = convertTo<Hash>(select(high > P(0), lowest + P(1), P(0)));
        constexpr size_t kCount = size_t{1} << axis;
        unrolled<int{kCount}>([&](auto k) {
            const Hash before = axis == 0 ? Hash(0) : at(places[k]);
            places[k] = before + lower;
            places[k + kCount] = before + upper;
        });
    });
    return places;
}

/// The linear function with this gradient that is zero at corner k, at s in the cell.
template <int Order, class T, int N>
Jet<T, N, Order> cornerRamp(const Vec<T, N>& gradient, Vec<T, N> s, size_t k) {
    for (int axis = 0; axis < N; ++axis) s[axis] -= T(k >> axis & 1);
    Jet<T, N, Order> ramp(dot(gradient, s));
    if constexpr (Order >= 1) ramp.gradient = gradient;
    return ramp;
}

namespace detail {

/// a becomes a + (b - a) fade along an axis, with its derivatives. The axes after this one have been blended before. In
/// all others a Hessian is still zero, and of constants the gradient, too: no need for the whole product rule.
template <bool Constant, class T, int N, int Order>
void blendAlong(int axis, Jet<T, N, Order>& a, const Jet<T, N, Order>& b, const T& s, const Univariate<T>& fade) {
    [[maybe_unused]] Jet<T, N, Order> sum;
    if constexpr (Order >= 3) sum = a + (b - a) * compose(Jet<T, N, Order>::variable(s, axis), fade);
    const T rise = b.value - a.value;
    a.value = mulAdd(rise, fade.value, a.value);
    if constexpr (Order >= 1) {
        Vec<T, N> slope;
        for (int j = Constant ? axis + 1 : 0; j < N; ++j) {
            slope[j] = b.gradient[j] - a.gradient[j];
            a.gradient[j] = mulAdd(slope[j], fade.value, a.gradient[j]);
        }
        a.gradient[axis] = mulAdd(rise, fade.first, a.gradient[axis]);
        if constexpr (Order >= 2) {
            for (int j = axis + 1; j < N; ++j)
                for (int i = Constant ? axis + 1 : 0; i <= j; ++i)
                    a.hessian(i, j) = mulAdd(b.hessian(i, j) - a.hessian(i, j), fade.value, a.hessian(i, j));
            for (int j = Constant ? axis + 1 : 0; j < N; ++j)
                if (j != axis) a.hessian(axis, j) = mulAdd(slope[j], fade.first, a.hessian(axis, j));
            a.hessian(axis, axis) = mulAdd(T(2) * slope[axis], fade.first, rise * fade.second);
        }
    }
    if constexpr (Order >= 3) a.third = sum.third; // alone: the others to the bit as without it
}

/// The blend, along `Axis` and those after it, of the corners whose bits before it are these.
template <int Order, int Axis, size_t Corners, class T, int N, class Corner>
Jet<T, N, Order> blendFrom(const Vec<T, N>& s, const Vec<Univariate<T>, N>& fades, const Corner& corner) {
    if constexpr (Axis == N) {
        Jet<T, N, Order> jet;
        const auto known = corner(std::integral_constant<size_t, Corners>{});
        for (int k = 0; k < known.kSize; ++k) jet.component(k) = known.component(k);
        return jet;
    } else {
        constexpr bool kConstant = decltype(corner(size_t{0}))::kOrder == 0;
        auto lower = blendFrom<Order, Axis + 1, Corners>(s, fades, corner);
        const auto upper = blendFrom<Order, Axis + 1, (Corners | size_t{1} << Axis)>(s, fades, corner);
        blendAlong<kConstant>(Axis, lower, upper, s[Axis], fades[Axis]);
        return lower;
    }
}

} // namespace detail

/// The blend at s in the cell of functions that belong to its corners, with quintic fades: C², and at a corner with
/// first and second derivatives of the function there. corner(k): the jet of the k-th at s, of order 0 for constants,
/// of order 1 for linear functions.
template <int Order, class T, int N, class Corner>
Jet<T, N, Order> blendCorners(const Vec<T, N>& s, const Corner& corner) {
    Vec<Univariate<T>, N> fades;
    for (int axis = 0; axis < N; ++axis) {
        fades[axis] = quinticFade(s[axis]);
        // Its rounding must not lead out of the range of the corners. NaN stays.
        fades[axis].value = min(T(1), fades[axis].value);
    }
    return detail::blendFrom<Order, 0, 0>(s, fades, corner);
}

} // namespace curlew
