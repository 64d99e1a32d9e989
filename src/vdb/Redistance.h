// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "BackwardMap.h"

namespace curlew {

/// The signed distance to the surface φ = 0 of a BackwardMap, by the closest point of each voxel of a narrow band; the
/// surface itself stays where it is.
///
/// Voxels beside an edge that the surface crosses start with the crossing; each ring of voxels around takes the best
/// closest point among its neighbours' (Danielsson 1980). Each then slides along the surface to where the surface is
/// perpendicular to the way to the voxel, by Newton steps on φ and on the tangential part of that way (Chopp 2001).
/// Nothing is differenced, and no value is passed on, so errors do not add up from ring to ring.
class ClosestPoints {
  public:
    /// Up to `halfWidth` voxels from the surface.
    ClosestPoints(const BackwardMap& map, const std::vector<BackwardMap::Crossing>& crossings, double halfWidth,
                  const Monitor& monitor);

    /// Values are distances in world units for that voxel size, less than `halfWidth` voxels, which is the background.
    /// At most the half width of the constructor.
    openvdb::FloatGrid::Ptr grid(double halfWidth, double voxelSize) const;

    /// Closest points that did not settle, for which the best that was found is taken: too far, but on the surface.
    size_t unsettled() const { return mUnsettled; }

    struct Entry {
        openvdb::Coord voxel = {};
        openvdb::Vec3d point = {}; ///< The closest of the surface, in voxels.
        double distance = 0;       ///< To it, in voxels, never negative.
        bool inside = false;
    };

  private:
    void begin(const BackwardMap& map, const std::vector<BackwardMap::Crossing>& crossings, const Monitor& monitor);
    bool addRing(const BackwardMap& map, size_t first, double halfWidth, const Monitor& monitor);
    void improve(const BackwardMap& map, const Monitor& monitor);
    void insert(const std::vector<Entry>& entries);

    std::vector<Entry> mEntries;
    openvdb::Int32Tree mIndex{-1};
    size_t mUnsettled = 0;
};

} // namespace curlew
