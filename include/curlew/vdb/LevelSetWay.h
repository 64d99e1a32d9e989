// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/vdb/LevelSet.h"
#include "curlew/vdb/MeshMotion.h"

#include <vector>

namespace curlew {

/// The surface of a mesh that changes its form from one frame to the next, as a distance at any time between.
///
/// Level sets are made at a few moments only, of the mesh as it then is (meshBetween), and their distances are
/// interpolated in time: quadratically, so that velocities are of second order, where three moments are known, linearly
/// else. Between two frames that is right as long as the surface moves by less than it is thick. So the mesh in the
/// middle is held against it, and if its points are off the interpolated surface by more than the tolerance there is a
/// level set in the middle, too, and so on, in up to 16 parts. A limb that is thinner than its way would not be there
/// halfway; so what its points may be off is never more than a fourth of its thickness, as far as voxels tell.
///
/// Immutable, safe to share between threads.
class LevelSetWay {
  public:
    struct Options {
        /// How far points of the mesh may be off the surface between moments, world units: where the body is thick, and
        /// at least where it is thin, and a fourth of its thickness would be less.
        double tolerance = 0, leastTolerance = 0;
    };

    /// Of level sets of `meshes.from` and `meshes.to`, and that of `meshes.before` if it is known; all with bands that
    /// are wide enough for what they will be asked. Makes the level sets between. Throws as widened(), and ValueError
    /// if a level set has no mesh.
    LevelSetWay(const std::optional<LevelSet>& before, const LevelSet& from, const LevelSet& to, MeshKeys meshes,
                const Options& options, const Monitor& monitor = {});

    /// `part` = 0 … 1 of the way. Its reach is 0, and says so, where even the shortest part was too long.
    Sdf at(double part) const;

    size_t levelSetsBetween() const { return mMoments.size() - 2; }
    /// The most that a point of the mesh was seen to be off, world units.
    double error() const { return mError; }

  private:
    struct Moment {
        double part;
        Sdf sdf;
    };

    Sdf interpolated(size_t interval, double part, const Mesh& mesh) const;
    const Moment* thirdOf(size_t interval) const;

    MeshKeys mMeshes;
    double mVoxel; ///< Of the coarser of both level sets.
    std::optional<Moment> mBefore;
    std::vector<Moment> mMoments; ///< In order, from 0 to 1.
    double mError = 0;
    bool mKnown = true; ///< The tolerance is kept.
};

} // namespace curlew
