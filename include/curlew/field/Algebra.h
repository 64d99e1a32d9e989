#pragma once

#include "curlew/field/ScalarField.h"

namespace curlew {

/// The same value everywhere.
ScalarField constantField(double value);

/// direction · x + offset: a linear ramp; its gradient is `direction`.
ScalarField rampField(const Vec3d& direction, double offset = 0);

/// a + b, a · b and s · a, with the rules of differentiation.
ScalarField operator+(const ScalarField& a, const ScalarField& b);
ScalarField operator*(const ScalarField& a, const ScalarField& b);
ScalarField operator*(double s, const ScalarField& a);

/// Where a field is put: first scaled, then rotated, then moved.
struct Placement {
    Vec3d offset{};         ///< World units.
    Vec3d rotate{};         ///< Degrees about x, then y, then z.
    Vec3d scale{{1, 1, 1}}; ///< Per axis, not zero.

    friend bool operator==(const Placement&, const Placement&) = default;
};

/// `field` put elsewhere: its value at R S p + offset is the field's at p. Throws ValueError for a scale of zero.
ScalarField placed(const ScalarField& field, const Placement& placement);

} // namespace curlew
