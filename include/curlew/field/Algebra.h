// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/field/ScalarField.h"

namespace curlew {

// Fields made of fields, with the rules of differentiation: values, gradients and Hessians are exact. N = 1 … 7.

/// The same value everywhere.
template <int N = 3>
ScalarFieldN<N> constantField(double value);

/// direction · x + offset: a linear ramp; its gradient is `direction`.
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
/// Throws ValueError where the range of b, as far as it is known, contains zero.
template <int N>
ScalarFieldN<N> operator/(const ScalarFieldN<N>& a, const ScalarFieldN<N>& b);

/// The smaller and the larger of two fields, C²: where they differ by less than `smoothing` (in their own units), the
/// corner is rounded by a cubic, by at most smoothing / 6. With smoothing = 0 there is a kink. Throws ValueError for a
/// negative one.
template <int N>
ScalarFieldN<N> smoothMin(const ScalarFieldN<N>& a, const ScalarFieldN<N>& b, double smoothing);
template <int N>
ScalarFieldN<N> smoothMax(const ScalarFieldN<N>& a, const ScalarFieldN<N>& b, double smoothing);

/// a where |a| is small, levelling off, C³, to ±range/2 where |a| >= range: a distance that only matters near its
/// surface (DeWolf §4). Throws ValueError for a range that is not positive.
template <int N>
ScalarFieldN<N> clipped(const ScalarFieldN<N>& a, double range);

} // namespace curlew
