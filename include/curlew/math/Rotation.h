// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/math/Vec.h"

#include <cmath>

namespace curlew {

/// Rotates v by an angle in radians about an axis, which must be a unit vector (Rodrigues 1840).
inline Vec3d turned(const Vec3d& v, const Vec3d& axis, double angle) {
    return v * std::cos(angle) + cross(axis, v) * std::sin(angle) + axis * (dot(axis, v) * (1 - std::cos(angle)));
}

/// Returns the rotation by |w| radians about w.
inline Matrix3 rotationBy(const Vec3d& w) {
    const double angle = length(w);
    Matrix3 R;
    if (angle == 0) return R;
    for (int i = 0; i < 3; ++i) {
        Vec3d unit;
        unit[i] = 1;
        const Vec3d column = turned(unit, w * (1 / angle), angle);
        for (int row = 0; row < 3; ++row) R[row][i] = column[row];
    }
    return R;
}

/// Returns the rotation vector of a rotation: its axis times its angle, 0 to pi radians. Half a turn has two such axes;
/// returns either.
inline Vec3d rotationVector(const Matrix3& R) {
    const Vec3d w = Vec3d{{R[2][1] - R[1][2], R[0][2] - R[2][0], R[1][0] - R[0][1]}} * 0.5; // sin(angle) axis
    const double sine = length(w), cosine = (R[0][0] + R[1][1] + R[2][2] - 1) / 2, angle = std::atan2(sine, cosine);
    if (cosine > 0 || sine > 1e-6) return sine > 0 ? w * (angle / sine) : Vec3d{};
    // Half a turn, or nearly so: the symmetric part of R is 2 axis axisᵀ - 1, but does not show the axis's sign.
    int most = 0;
    for (int i = 1; i < 3; ++i)
        if (R[i][i] > R[most][most]) most = i;
    Vec3d axis;
    for (int i = 0; i < 3; ++i) axis[i] = 0.5 * (R[most][i] + R[i][most]);
    axis[most] += 1;
    return axis * ((dot(axis, w) < 0 ? -angle : angle) / length(axis));
}

} // namespace curlew
