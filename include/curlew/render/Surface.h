// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/field/Shapes.h"
#include "curlew/math/Ray.h"
#include "curlew/vdb/LevelSet.h"

#include <memory>
#include <span>

namespace curlew {

/// The first intersection of a ray with a surface.
struct RayHit {
    double distance = std::numeric_limits<double>::infinity(); ///< From the origin, world units; infinite: no hit.
    Vec3d normal{};                                            ///< Unit vector, facing the ray's origin.
    double lift = 0; ///< Height of the smooth surface, to which the normal belongs, above the facet; world units.

    bool found() const { return distance < std::numeric_limits<double>::infinity(); }
};

/// Returns the level set after a Gaussian filter of this half width in voxels, so that the facets of a mesh do not
/// show. The result has no mesh. 0 voxels return the level set unchanged.
LevelSet smoothed(const LevelSet& levelSet, int voxels);

/// A surface for ray tracing. Immutable, cheap to copy, safe to share between threads.
///
/// A field is intersected by sphere tracing (Hart 1996, Keinert et al. 2014): the field's value divided by its
/// Lipschitz bound is a distance in which there is no surface, and a ray goes back if those of two samples do not meet.
/// Where the second derivatives are bounded, too (ScalarField::homogeneous), so is the distance to where a parabola
/// would reach the surface. But a ray may miss a part of the surface in which it stays for less than the `resolution`
/// that the caller requests.
/// A level set is first intersected through OpenVDB's mesh of it, which Embree traces. Newton steps then refine the
/// hits on the exact field or on the spline through the level set (sdfOf), whose gradient gives the normal. Hits are
/// exact to rounding, except for rays that graze a level set. A mesh is intersected face by face, seen from both sides;
/// its normals are interpolated between vertices, except across edges of more than 60 degrees.
class Surface {
  public:
    /// A shape. If the box cuts it off, as it does an unbounded shape, the cut becomes a planar part of the surface.
    /// Throws ValueError if the box is infinite or empty.
    Surface(const Sdf& sdf, const Box& box);
    explicit Surface(const Sdf& sdf) : Surface(sdf, sdf.bounds) {}
    /// The level set of a field at a value. If `solid`, the region below the value is filled, so the box cuts it like a
    /// shape; otherwise the surface is a sheet that is open at the box. The field's bounds are estimated as 1.5 times
    /// the largest derivatives at random places; unless the field is homogeneous, the steepest slopes are also looked
    /// for near the surface, on the edges of a lattice of 48³ places. Also throws ValueError if no place has a slope.
    Surface(const ScalarField& field, double value, const Box& box, bool solid);
    /// A level set. Throws ValueError if it is empty.
    explicit Surface(const LevelSet& levelSet);
    /// The faces of a mesh, open or closed. Throws ValueError if it has no faces or no extent.
    explicit Surface(const Mesh& mesh);

    /// Contains the surface.
    const Box& box() const { return mBox; }
    /// Returns the distance from a hit at which a ray must start, in addition to the resolution, so as not to hit the
    /// same place again.
    double rayOffset() const;

    /// Computes the first hit of each ray. Resolution: world units, positive.
    void intersect(std::span<const Ray> rays, double resolution, std::span<RayHit> hits) const;

    /// Computes for each ray whether it hits the surface: 1 or 0.
    void occluded(std::span<const Ray> rays, double resolution, std::span<uint8_t> flags) const;

    class Model;
    /// For use within render/ only.
    Surface(const Box& box, std::shared_ptr<const Model> model) : mBox(box), mModel(std::move(model)) {}

  private:
    Box mBox;
    std::shared_ptr<const Model> mModel;
};

} // namespace curlew
