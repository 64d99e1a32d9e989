// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "BackwardMap.h"
#include "curlew/vdb/Openvdb.h"

namespace curlew {

/// The signed distance to the surface φ = 0 of a BackwardMap, from the closest surface point of each voxel in a narrow
/// band. The surface itself does not move.
///
/// Voxels at the ends of an edge that the surface crosses start with the crossing. Each ring of voxels around them
/// takes the best closest point of its neighbours (Danielsson 1980). The point then slides along the surface until the
/// vector to the voxel is normal to the surface: Newton steps keep it on φ = 0 (Chopp 2001), and steps of Barzilai and
/// Borwein (1988) along the tangential part of that vector reduce the distance. No value is differenced or passed on,
/// so errors do not accumulate from ring to ring.
class ClosestPoints {
  public:
    /// Finds closest points for voxels up to `halfWidth` voxels from the surface.
    ClosestPoints(const BackwardMap& map, const std::vector<BackwardMap::Crossing>& crossings, double halfWidth,
                  const Monitor& monitor);

    /// Returns the distances as a level set, in world units for this voxel size. The background is `halfWidth` voxels,
    /// at most the half width given to the constructor.
    openvdb::FloatGrid::Ptr grid(double halfWidth, double voxelSize) const;

    /// Number of closest points that did not converge. For these the best point found is used: it is on the surface,
    /// but may be too far away.
    size_t unconverged() const { return mUnconverged; }

    struct Entry {
        openvdb::Coord voxel = {};
        openvdb::Vec3d point = {}; ///< Closest surface point, in voxels.
        openvdb::Vec3d normal{0};  ///< Of the surface at this point, of length 1; 0 if unknown.
        double distance = 0;       ///< Distance to the point in voxels, never negative.
        bool inside = false;
    };

  private:
    void begin(const BackwardMap& map, const std::vector<BackwardMap::Crossing>& crossings, const Monitor& monitor);
    bool addRing(const BackwardMap& map, size_t first, double halfWidth, const Monitor& monitor);
    void improve(const BackwardMap& map, const Monitor& monitor);
    void insert(const std::vector<Entry>& entries);

    std::vector<Entry> mEntries;
    openvdb::Int32Tree mIndex{-1};
    size_t mUnconverged = 0;
};

} // namespace curlew
