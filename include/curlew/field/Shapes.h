// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/field/Map.h"

namespace curlew {

/// Where something is that moves without changing its form.
template <int N>
struct PoseN {
    Matrix<N, N> axes;       ///< A rotation.
    Vec<double, N> origin{}; ///< World units.
};
using Pose = PoseN<3>;

/// A signed distance: a scalar field that is negative inside and zero on the surface.
/// (This is the one place that states the sign.)
template <int N>
struct SdfN {
    ScalarFieldN<N> distance;
    BoxN<N> bounds; ///< Contains the inside; infinite where that is unbounded.
    /// Where |distance| is below this, it is the distance; elsewhere no more than that. 0: nowhere more than a lower
    /// bound.
    double reach = std::numeric_limits<double>::infinity();
    /// The most that the distance changes on a way, divided by its length. Of samples it is measured, and may be more.
    double steepness = 1;
    PoseN<N> pose = {}; ///< Where it has been put: how a wall moves is seen from it (track/WallMotion.h).
};
using Sdf = SdfN<3>;

/// Shapes, world units, centred at the origin; move them with placed(). Where the kinks of each are is said here; a
/// flow needs second derivatives, so keep the width of a wall (Eq. 13) below the distance to them. All throw ValueError
/// for sizes that are not positive and finite. Boxes, planes and what is made of shapes: in 2 and 3 dimensions.

/// A ball: in 1D a segment, in 2D a disc. Exact. C^inf but at the centre.
template <int N = 3>
SdfN<N> sphereSdf(double radius);
/// A box with rounded edges; `size` is the whole edge length, `rounding` the radius of the edges. Exact; C¹ at the
/// seams between faces and edges, kinks deeper than `rounding`. Throws where rounding exceeds half the shortest edge.
template <int N>
SdfN<N> boxSdf(const Vec<double, N>& size, double rounding);
inline Sdf boxSdf(const Vec3d& size, double rounding) { return boxSdf<3>(size, rounding); }
/// Around the y axis: `radius` from the centre to the middle of the tube, `tube` the tube's radius. Exact; C^inf but on
/// the axis and on the circle in the middle of the tube. Throws where tube is not below radius.
Sdf torusSdf(double radius, double tube);
/// A cylinder along y of the given length with hemispheres at both ends. Exact; C¹ at the seams, C^inf elsewhere but on
/// the inner segment.
Sdf capsuleSdf(double length, double radius);
/// Inside is where normal · x < offset, normal of any length but zero. Exact, C^inf; its inside is unbounded.
template <int N>
SdfN<N> planeSdf(const Vec<double, N>& normal, double offset);
inline Sdf planeSdf(const Vec3d& normal, double offset) { return planeSdf<3>(normal, offset); }
/// The sheet |gyroid| < thickness / 2 of Schoen's gyroid with the given wavelength. C^inf but in the middle of the
/// sheet. A lower bound on the distance, not the distance; its inside is unbounded.
Sdf gyroidSdf(double wavelength, double thickness);

/// The shape moved and turned, and scaled alike along all axes (ValueError for unequal or negative scales: the result
/// would not be a distance).
template <int N>
SdfN<N> placed(const SdfN<N>& sdf, const PlacementN<N>& placement);
inline Sdf placed(const Sdf& sdf, const Placement& placement) { return placed<3>(sdf, placement); }

/// A shape in the plane as one in space: the same for every z, unbounded along it.
Sdf extruded(const SdfN<2>& sdf);

/// Both shapes together, what they share, and the first without the second. Where their surfaces meet, the edge is
/// rounded over `smoothing` world units, so the distance is C² (as far as those of the shapes are); 0 leaves a kink.
/// The results are lower bounds on the distance. Throws ValueError for a negative smoothing.
template <int N>
SdfN<N> unite(const SdfN<N>& a, const SdfN<N>& b, double smoothing);
template <int N>
SdfN<N> intersect(const SdfN<N>& a, const SdfN<N>& b, double smoothing);
template <int N>
SdfN<N> subtract(const SdfN<N>& a, const SdfN<N>& b, double smoothing);

} // namespace curlew
