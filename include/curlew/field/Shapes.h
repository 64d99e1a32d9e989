// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/field/Transforms.h"

#include <array>
#include <optional>

namespace curlew {

/// The position and orientation of a rigid body.
template <int N>
struct PoseN {
    Matrix<N, N> axes;       ///< A rotation.
    Vec<double, N> origin{}; ///< World units.
};
using Pose = PoseN<3>;

/// A signed distance field (SDF): negative inside, zero on the surface. (Only this comment states the sign.)
template <int N>
struct SdfN {
    ScalarFieldN<N> distance;
    BoxN<N> bounds; ///< Contains the inside; infinite if the inside is unbounded.
    /// Where |distance| is below `reach`, it is exact; elsewhere it is a lower bound. 0: a lower bound everywhere.
    double reach = std::numeric_limits<double>::infinity();
    /// A Lipschitz bound of the distance: along a path, it changes by at most this times the length. If the distance is
    /// sampled, it is measured and may exceed 1.
    double lipschitz = 1;
    PoseN<N> pose = {}; ///< Where the shape was placed; track/WallMotion.h derives a wall's motion from it.
    /// The velocity at this moment of the closest point of a surface that deforms, world units per second, if the
    /// points of the surface are known from moment to moment (a mesh whose faces stay the same). Valid where |distance|
    /// is below `reach`. Its normal part is only approximate; that of a wall follows from its distances.
    std::optional<std::array<ScalarFieldN<N>, size_t{N}>> surfaceVelocity = {};
};
using Sdf = SdfN<3>;

/// Shapes in world units, centred at the origin; move them with placed(). Each comment says where a shape has kinks. A
/// flow needs second derivatives, so keep the width of a wall (Eq. 13) below the distance to the kinks. All functions
/// throw ValueError if a size is not positive and finite. Boxes, planes and combined shapes exist in 2 and 3
/// dimensions.

/// A ball (1D: a segment, 2D: a disc). Exact; C^inf except at the centre.
template <int N = 3>
SdfN<N> sphereSdf(double radius);
/// A box with rounded edges. `size` is the full edge length, `rounding` the radius of the edges. Exact; C¹ at the seams
/// between faces and edges, with kinks deeper than `rounding`. Throws ValueError if `rounding` exceeds half the
/// shortest edge.
template <int N>
SdfN<N> boxSdf(const Vec<double, N>& size, double rounding);
inline Sdf boxSdf(const Vec3d& size, double rounding) { return boxSdf<3>(size, rounding); }
/// A torus around the y axis. `radius` is the distance from the centre to the middle of the tube, `tube` the tube's
/// radius. Exact; C^inf except on the axis and on the circle in the middle of the tube. Throws ValueError if `tube` is
/// not below `radius`.
Sdf torusSdf(double radius, double tube);
/// A cylinder along y of the given length, with hemispheres at both ends. Exact; C¹ at the seams, C^inf elsewhere
/// except on the inner segment.
Sdf capsuleSdf(double length, double radius);
/// The half-space normal · x < offset. `normal` may have any length but zero. Exact, C^inf; unbounded.
template <int N>
SdfN<N> planeSdf(const Vec<double, N>& normal, double offset);
inline Sdf planeSdf(const Vec3d& normal, double offset) { return planeSdf<3>(normal, offset); }
/// The sheet |gyroid| < thickness / 2 of Schoen's gyroid with the given wavelength. C^inf except in the middle of the
/// sheet. It is a lower bound on the distance, not the distance; its inside is unbounded.
Sdf gyroidSdf(double wavelength, double thickness);

/// Translates, rotates and uniformly scales a shape. Throws ValueError if the scales are unequal or not positive,
/// because the result would not be a distance.
template <int N>
SdfN<N> placed(const SdfN<N>& sdf, const PlacementN<N>& placement);
inline Sdf placed(const Sdf& sdf, const Placement& placement) { return placed<3>(sdf, placement); }

/// Extends a 2D shape along z without bound.
Sdf extruded(const SdfN<2>& sdf);

/// The union and the intersection of two shapes, and the difference a - b. Where the surfaces meet, the edge is rounded
/// over `smoothing` world units, so the distance is C² as far as those of the shapes are; 0 leaves a kink. The results
/// are lower bounds on the distance. Throws ValueError if `smoothing` is negative.
template <int N>
SdfN<N> unite(const SdfN<N>& a, const SdfN<N>& b, double smoothing);
template <int N>
SdfN<N> intersect(const SdfN<N>& a, const SdfN<N>& b, double smoothing);
template <int N>
SdfN<N> subtract(const SdfN<N>& a, const SdfN<N>& b, double smoothing);

} // namespace curlew
