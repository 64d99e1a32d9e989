// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/math/Fade.h"
#include "curlew/math/Jet.h"

#include <algorithm>
#include <array>
#include <cstdint>

namespace curlew {

// Shared by the noises on the integer lattice: the cell of a position, Perlin's hash of its corners, and the blend of
// the corners' functions. Corner k of a cell is the upper one along each axis whose bit is set in k. P is double, lanes
// of double (math/Lanes.h), or a symbol of such a number (math/Symbol.h).

/// Throws ValueError if the period is negative.
void requirePeriod(int period);

template <class P, int N>
struct CubicCell {
    std::array<std::array<P, 2>, N> index; ///< Integer indices of the lower and the upper corners along each axis.
    Vec<P, N> fraction;                    ///< Position in the cell, within [0, 1); in a shader it may be 1.

    template <class T>
    Vec<T, N> position() const {
        Vec<T, N> s;
        for (int axis = 0; axis < N; ++axis) s[axis] = convertTo<T>(fraction[axis]);
        return s;
    }
};

/// The cells of the integer lattice. Corner indices are taken modulo the period along each axis, so a noise based on
/// them tiles exactly. A seed translates the lattice by a multiple of 1/4096 along each axis. Otherwise all fields
/// would share their vertices. A value noise has zero gradient there, and two gradient noises often have parallel
/// gradients there, so the flow grad f x grad g would stagnate.
template <int N>
class CubicLattice {
  public:
    /// `natural` is the period, up to 2^32, of an axis for which `period` is 0. Throws ValueError if a period is
    /// negative.
    CubicLattice(const Vec<int, N>& period, double natural, uint64_t seed);

    template <class P>
    CubicCell<P, N> cell(const Vec<P, N>& x) const;

    /// Whether indices along an axis repeat as words of 32 bits do.
    bool wrapsAsWords(int axis) const { return mPeriod[axis] == 0x1p32; }

  private:
    Vec<double, N> mPeriod, mInverse, mShift;
};

template <int N>
template <class P>
CubicCell<P, N> CubicLattice<N>::cell(const Vec<P, N>& x) const {
    CubicCell<P, N> cell;
    for (int axis = 0; axis < N; ++axis) {
        // The shift is added to the fraction, which is bit for bit the same at positions a period apart.
        const P whole = floor(x[axis]), sum = x[axis] - whole + P(mShift[axis]);
        const auto next = [&] {
            // GPUs are slow in double, and a sum of 1 by rounding is as good as 0 in the next cell.
            if constexpr (kSymbolic<P>)
                if (mShift[axis] == 0) return MaskOf<P>(false);
            return sum >= P(1);
        }();
        cell.fraction[axis] = select(next, sum - P(1), sum);
        const P vertex = select(next, whole + P(1), whole);
        auto& [low, high] = cell.index[static_cast<size_t>(axis)];
        if (kSymbolic<P> && wrapsAsWords(axis)) {
            low = vertex;
            high = vertex + P(1);
            continue;
        }
        const double p = mPeriod[axis];
        low = min(max(floorMod(vertex, p, mInverse[axis]), P(0)), P(p - 1)); // valid for NaN and far out, too
        high = select(low < P(p - 1), low + P(1), P(0));
    }
    return cell;
}

/// The hash of Perlin (2002): a permutation of 0 … 255, looked up once per axis at the sum of that axis's index and the
/// previous result. It depends only on the lowest 8 bits of an index. A seed other than 0 shuffles the permutation.
class PermutationHash {
  public:
    static constexpr size_t kSize = 256;
    explicit PermutationHash(uint64_t seed);

    /// Returns the table positions at which the hashes of all corners of a cell are finally looked up: integers in 0 …
    /// 511, to be taken modulo 256.
    template <class P, int N>
    std::array<Rebind<P, float>, 1 << N> places(const CubicCell<P, N>& cell) const;

    /// Returns the hash at such a position, in [0, 255].
    template <class Hash>
    Hash at(const Hash& place) const {
        return valuesAt(mPermutation, place);
    }

  private:
    std::array<float, kSize> mPermutation; // floats, because lanes compute exactly in them
};

template <class P, int N>
std::array<Rebind<P, float>, 1 << N> PermutationHash::places(const CubicCell<P, N>& cell) const {
    using Hash = Rebind<P, float>;
    std::array<Hash, 1 << N> places;
    unrolled<N>([&](auto axis) {
        const auto& [low, high] = cell.index[axis];
        const P lowest = negMulAdd(floor(low * P(1.0 / kSize)), P(kSize), low);
        // The upper index may be 256 here; added to a hash, it is at most 511.
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

/// Returns the linear function with this gradient that is zero at corner k, evaluated at s in the cell.
template <int Order, class T, int N>
Jet<T, N, Order> cornerRamp(const Vec<T, N>& gradient, Vec<T, N> s, size_t k) {
    for (int axis = 0; axis < N; ++axis) s[axis] -= T(k >> axis & 1);
    Jet<T, N, Order> ramp(dot(gradient, s));
    if constexpr (Order >= 1) ramp.gradient = gradient;
    return ramp;
}

namespace detail {

/// Replaces a by a + (b - a) fade along an axis, with its derivatives. The axes after this one are already blended.
/// Along the others the Hessian is still zero, and for constants the gradient is too, so the full product rule is not
/// needed.
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
    if constexpr (Order >= 3) a.third = sum.third; // only this: the lower orders stay bit for bit the same
}

/// Blends along `Axis` and the axes after it, over the corners whose bits before it are those of `Corners`.
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

/// Blends functions that belong to the corners of a cell, at s in the cell, with quintic fades. The result is C². At a
/// corner it has the first and second derivatives of that corner's function. corner(k) returns the jet of the k-th
/// function at s: of order 0 for constants, of order 1 for linear functions.
template <int Order, class T, int N, class Corner>
Jet<T, N, Order> blendCorners(const Vec<T, N>& s, const Corner& corner) {
    Vec<Univariate<T>, N> fades;
    for (int axis = 0; axis < N; ++axis) {
        fades[axis] = quinticFade(s[axis]);
        // Rounding must not take the blend out of the range of the corners. A NaN stays NaN.
        fades[axis].value = min(T(1), fades[axis].value);
    }
    return detail::blendFrom<Order, 0, 0>(s, fades, corner);
}

} // namespace curlew
