// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/vdb/LevelSet.h"
#include "curlew/vdb/MeshMotion.h"

#include <vector>

namespace curlew {

/// The signed distance to a mesh that deforms from one frame to the next, at any time in between.
///
/// The mesh is converted to level sets at a few times only (meshBetween), and their distances are interpolated in time:
/// quadratically if three times are known, so that velocities are second-order accurate, otherwise linearly. Between
/// two level sets this is correct as long as the surface moves by less than the thickness of the body. Therefore the
/// mesh halfway between two level sets is compared with the interpolated surface. If its points are off by more than
/// the tolerance, a level set is added halfway, and so on, down to a sixteenth of the frame. A limb that moves farther
/// than its own thickness would be missing halfway. So the tolerance is at most a fourth of the local thickness, as far
/// as the voxels resolve it.
///
/// The velocity of the surface (Sdf::surfaceVelocity) is that of the mesh: of the closest point, by barycentric
/// weights. It is sampled at the same few times, on voxels twice as large, and interpolated linearly in time.
///
/// Immutable; safe to share between threads.
class DeformingLevelSet {
  public:
    struct Options {
        /// How far points of the mesh may be off the interpolated surface, in world units: `tolerance` where the body
        /// is thick, and down to `minTolerance` where a fourth of its thickness is less than that.
        double tolerance = 0, minTolerance = 0;
        double seconds = 0; ///< Time between the two frames; 0: the velocity of the surface is not needed.
    };

    /// Takes level sets of `meshes.from` and `meshes.to`, and that of `meshes.before` if it is known. Their bands must
    /// be wide enough for later queries. Makes the level sets in between. Throws as widened() does, and ValueError if a
    /// level set has no mesh.
    DeformingLevelSet(const std::optional<LevelSet>& before, const LevelSet& from, const LevelSet& to, MeshKeys meshes,
                      const Options& options, const Monitor& monitor = {});

    /// Returns the distance at `part` = 0 … 1 of the interval. Its reach is 0 if the tolerance could not be met.
    Sdf at(double part) const;

    size_t levelSetsBetween() const { return mMoments.size() - 2; }
    /// The largest deviation measured at a point of the mesh, in world units.
    double error() const { return mError; }

  private:
    struct Moment {
        double part;
        Sdf sdf;
    };

    Sdf interpolated(size_t interval, double part, const Mesh& mesh) const;
    const Moment* thirdOf(size_t interval) const;

    MeshKeys mMeshes;
    double mVoxel; ///< Voxel size of the coarser of the two level sets.
    std::optional<Moment> mBefore;
    std::vector<Moment> mMoments; ///< Sorted by `part`, from 0 to 1.
    double mError = 0;
    bool mKnown = true; ///< The tolerance was met everywhere.
};

} // namespace curlew
