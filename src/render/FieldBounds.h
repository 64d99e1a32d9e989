// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/field/ScalarField.h"
#include "curlew/math/Vec.h"

namespace curlew::detail {

/// What is known of a field everywhere.
struct FieldBounds {
    static constexpr double kUnknown = 1e30; ///< As a bound, it has no effect.

    double slope = 1;       ///< Largest slope: a Lipschitz constant.
    double bend = kUnknown; ///< Largest second derivative along any line, per unit of length.
};

/// Estimates the bounds in a box for rays that look for a value: 1.5 times the largest derivatives at random places.
/// Only homogeneous fields have a bound of the second derivatives; in others, a kink or a narrow bend may be where none
/// of these places is. In those, bisections towards the value on the edges of a lattice look for steeper slopes. Throws
/// ValueError if no place has a slope.
FieldBounds boundsOf(const ScalarField& field, double value, const Box& box);

} // namespace curlew::detail
