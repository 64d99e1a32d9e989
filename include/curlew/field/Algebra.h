// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/field/ScalarField.h"

namespace curlew {

// Fields made of other fields. Values, gradients and Hessians are exact. N = 1 … 7.

/// A field with the same value everywhere.
template <int N = 3>
ScalarFieldN<N> constantField(double value);

/// A linear ramp, direction · x + offset. Its gradient is `direction`.
template <int N>
ScalarFieldN<N> rampField(const Vec<double, N>& direction, double offset = 0);
inline ScalarField rampField(const Vec3d& direction, double offset = 0) { return rampField<3>(direction, offset); }

template <int N>
ScalarFieldN<N> operator+(const ScalarFieldN<N>& a, const ScalarFieldN<N>& b);
template <int N>
ScalarFieldN<N> operator-(const ScalarFieldN<N>& a, const ScalarFieldN<N>& b);
template <int N>
ScalarFieldN<N> operator*(const ScalarFieldN<N>& a, const ScalarFieldN<N>& b);
template <int N>
ScalarFieldN<N> operator*(double s, const ScalarFieldN<N>& a);
/// Throws ValueError if the known range of b contains zero.
template <int N>
ScalarFieldN<N> operator/(const ScalarFieldN<N>& a, const ScalarFieldN<N>& b);

/// The minimum and the maximum of two fields, C². Where they differ by less than `smoothing` (in their own units), a
/// cubic rounds the corner, by at most smoothing / 6. With smoothing = 0 there is a kink. Throws ValueError if
/// `smoothing` is negative.
template <int N>
ScalarFieldN<N> smoothMin(const ScalarFieldN<N>& a, const ScalarFieldN<N>& b, double smoothing);
template <int N>
ScalarFieldN<N> smoothMax(const ScalarFieldN<N>& a, const ScalarFieldN<N>& b, double smoothing);

/// A field that is close to a where |a| is small, and levels off (C³) to ±range/2 where |a| >= range. It turns a
/// distance into one that matters only near its surface (DeWolf §4). Throws ValueError if `range` is not positive.
template <int N>
ScalarFieldN<N> clipped(const ScalarFieldN<N>& a, double range);

} // namespace curlew
