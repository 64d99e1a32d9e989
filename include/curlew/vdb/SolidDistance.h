// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/base/Monitor.h"
#include "curlew/field/Bound.h"
#include "curlew/vdb/LevelSet.h"

#include <memory>
#include <span>

namespace curlew {

/// The solid of a mesh itself, without the voxels of a level set: it measures how well a level set, and anything that
/// conforms to it, fits the mesh. The solid is that of MeshSolid.h: the points with a winding number |w| > 1/2, or, for
/// a sheet, the points within half the thickness of a face.
///
/// The side comes from the fast winding numbers of the solid (error below 1e-3), the distance from the closest
/// triangle (RayMesh.h). Where faces lie inside the solid, the distance is a lower bound. Next to a hole, where 0.1 <
/// |w| < 0.9, it is at most the distance to the surface |w| = 1/2 that closes the hole, estimated from the slope of w.
/// Immutable; safe to share between threads.
class SolidDistance {
  public:
    /// `thickness`: that of a sheet in world units; 0 if the mesh is a solid. Throws ValueError if the mesh has no
    /// faces or no extent, ResourceError if it does not fit into memory, Interrupted.
    explicit SolidDistance(const Mesh& mesh, double thickness = 0, const Monitor& monitor = {});
    /// The solid from whose mesh a level set was made: a sheet if the level set is that of a sheet. Throws ValueError
    /// if the level set has no mesh, and like the other constructor.
    explicit SolidDistance(const LevelSet& levelSet, const Monitor& monitor = {});
    ~SolidDistance();
    SolidDistance(SolidDistance&&) noexcept;
    SolidDistance& operator=(SolidDistance&&) noexcept;

    /// Returns whether a position is inside the solid. False if it is not finite.
    bool inside(const Vec3d& position) const;
    /// Returns the signed distance to the surface of the solid, negative inside, world units.
    double at(const Vec3d& position) const;

  private:
    struct Parts;
    std::unique_ptr<const Parts> mParts;
};

/// Points on the wrong side of a wall.
struct WrongSide {
    size_t points = 0; ///< Number of such points.
    double depth = 0;  ///< Greatest distance of such a point from the wall, world units; 0 if there is none.
};

/// Counts the points of which a wall, the union of these solids, is on the wrong side. With Side::both no point is
/// wrong. x, y and z have equally many elements. Takes about 5 µs per point and solid. Throws Interrupted.
WrongSide wrongSideOf(std::span<const SolidDistance* const> solids, Side side, std::span<const double> x,
                      std::span<const double> y, std::span<const double> z, const Monitor& monitor = {});

} // namespace curlew
