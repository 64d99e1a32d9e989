// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "SolidWinding.h"
#include "curlew/vdb/Openvdb.h"

namespace curlew {

/// The solid where the winding number w of a mesh (SolidWinding.h) satisfies |w| > 1/2, resolved by voxels.
class SolidBoundary {
  public:
    /// In voxels: w is computed at all voxels closer than this to the mesh. They include all corners of every cell that
    /// the mesh passes through.
    static constexpr double kNear = 1.75;

    SolidBoundary(const SolidFaces& faces, const openvdb::math::Transform& transform, const Monitor& monitor);

    /// The surface of the solid: the faces, or pieces of them, that separate inside from outside, and quads across
    /// holes. Not oriented.
    const Mesh& surface() const { return mSurface; }
    /// Returns whether voxels are inside. Computes w where it is not known yet.
    std::vector<uint8_t> inside(const std::vector<openvdb::Coord>& voxels, const Monitor& monitor);

    const SolidWinding& winding() const { return mWinding; }
    double undecided() const { return mUndecided; } ///< Fraction of the near voxels where 1/4 < |w| < 3/4.
    double hidden() const { return mHidden; }       ///< Fraction of the mesh's area that is not on the boundary.
    bool turned() const { return mTurned; }         ///< w is negative at most inside voxels.

  private:
    using Accessor = openvdb::tree::ValueAccessor<openvdb::FloatTree>;

    void computeNear(const Mesh& mesh, const Monitor& monitor);
    void compute(const std::vector<openvdb::Coord>& voxels, const Monitor& monitor);
    void sortFaces(const Mesh& mesh, const Monitor& monitor);
    void closeHoles(const Monitor& monitor);

    openvdb::math::Transform mTransform;
    SolidWinding mWinding;
    openvdb::FloatTree mKnown{0.0f}; ///< w at its active voxels.
    Mesh mSurface;
    double mUndecided = 0, mHidden = 0;
    bool mTurned = false;
};

} // namespace curlew
