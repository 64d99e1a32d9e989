// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/field/Shapes.h"
#include "curlew/vdb/LevelSet.h"

#include <memory>
#include <span>

namespace curlew {

/// A half line; `direction` is a unit vector.
struct Ray {
    Vec3d origin, direction;
};

/// Where a ray first meets a surface.
struct RayHit {
    double distance = std::numeric_limits<double>::infinity(); ///< From the origin, world units; infinite: nowhere.
    Vec3d normal{};                                            ///< Unit vector, towards where the ray comes from.
    double lift = 0; ///< How far above the facet the smooth surface is, which the normal is of; world units.

    bool found() const { return distance < std::numeric_limits<double>::infinity(); }
};

/// The level set after a Gaussian filter of this half width, so that the facets of a mesh do not show; the same for 0
/// voxels. It loses its mesh.
LevelSet smoothed(const LevelSet& levelSet, int voxels);

/// A surface that rays can be traced to. Immutable, cheap to copy, safe to share between threads.
///
/// A field is followed in steps that cannot cross the surface: its value by its steepness (sphere tracing, Hart 1996),
/// but none shorter than the `resolution` that the caller asks for, so a part of the surface may be missed where a ray
/// is inside for less than that. Of a level set, rays first meet OpenVDB's mesh of it, which Embree traces. Both are
/// then refined by Newton steps on the exact field, or on the spline through the level set (sdfOf), whose gradient is
/// the normal: hits are exact to rounding, but for rays that graze a level set. A mesh is what its faces are, seen from
/// both sides; its normals are interpolated between its vertices, but for edges of more than 60 degrees.
class Surface {
  public:
    /// A shape. Where the box cuts it off (an unbounded one), the cut is a plane part of the surface. Throws ValueError
    /// for an infinite or empty box.
    Surface(const Sdf& sdf, const Box& box);
    explicit Surface(const Sdf& sdf) : Surface(sdf, sdf.bounds) {}
    /// Where a field has the value. `solid`: what is below the value is full, so the box cuts it as it does a shape;
    /// else the surface is a sheet, open where the box ends. The steepness of the field is measured at 4096 places of
    /// the box and taken half as large again. Throws ValueError also for a field that is the same everywhere.
    Surface(const ScalarField& field, double value, const Box& box, bool solid);
    /// A level set. Throws ValueError for an empty one.
    explicit Surface(const LevelSet& levelSet);
    /// The faces of a mesh, open or closed. Throws ValueError if it has none, or no extent.
    explicit Surface(const Mesh& mesh);

    /// Contains the surface.
    const Box& box() const { return mBox; }
    /// How far from a hit a ray has to begin so as not to meet the same place again, beside the resolution.
    double skin() const;

    /// For each ray where it meets the surface first. Resolution: world units, positive.
    void intersect(std::span<const Ray> rays, double resolution, std::span<RayHit> hits) const;

    /// For each ray 1 if it meets the surface anywhere, else 0.
    void occluded(std::span<const Ray> rays, double resolution, std::span<uint8_t> flags) const;

    class Model;
    /// For the room itself.
    Surface(const Box& box, std::shared_ptr<const Model> model) : mBox(box), mModel(std::move(model)) {}

  private:
    Box mBox;
    std::shared_ptr<const Model> mModel;
};

} // namespace curlew
