// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/vdb/WindingNumber.h"

#include <openvdb/openvdb.h>

namespace curlew {

/// The solid where the winding number of a mesh is above 1/2 in size, as it looks at a voxel size.
class SolidBoundary {
  public:
    /// Voxels closer than this to the mesh have a known winding number, in voxels: all corners of any cell that the
    /// mesh passes through.
    static constexpr double kNear = 1.75;

    /// `mesh`: triangles only, without duplicates. `whole`: winding numbers are integers, so there are no holes.
    SolidBoundary(const Mesh& mesh, const openvdb::math::Transform& transform, bool whole, const Monitor& monitor);

    /// Its surface: the faces, or pieces of them, that separate inside from outside, and quads across holes. Not
    /// oriented.
    const Mesh& surface() const { return mSurface; }
    /// Whether the voxels are inside; those that are not known yet are computed.
    std::vector<uint8_t> inside(const std::vector<openvdb::Coord>& voxels, const Monitor& monitor);

    double undecided() const { return mUndecided; } ///< Share of the near voxels where 0.1 < |w| < 0.9.
    double hidden() const { return mHidden; }       ///< Share of the mesh's area that is not on the boundary.
    bool turned() const { return mTurned; }         ///< Where it is inside, w is mostly negative.

    /// Above 1/2 by more than the error of w: a flat sheet, at which it is 1/2, is not inside of anything.
    static bool isInside(double w) { return std::abs(w) > 0.5 + 1e-3; }

  private:
    using Accessor = openvdb::tree::ValueAccessor<openvdb::FloatTree>;

    void computeNear(const Mesh& mesh, const Monitor& monitor);
    void compute(const std::vector<openvdb::Coord>& voxels, const Monitor& monitor);
    void sortFaces(const Mesh& mesh, const Monitor& monitor);
    void closeHoles(const Monitor& monitor);

    openvdb::math::Transform mTransform;
    WindingNumber mWinding;
    openvdb::FloatTree mKnown{0.0f}; ///< w at active voxels.
    Mesh mSurface;
    double mUndecided = 0, mHidden = 0;
    bool mTurned = false;
};

} // namespace curlew
