// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/app/run/Console.h"
#include "curlew/app/run/Value.h"
#include "curlew/vdb/DeformingLevelSet.h"
#include "curlew/vdb/GridTypes.h"

#include <list>

namespace curlew::app {

/// Caches the signed distances of the last few level sets that were requested.
class SdfCache {
  public:
    /// Returns a level set as a signed distance that is valid up to `distance` world units from the surface. For a
    /// level set between two frames, this is the distance to the surface in between.
    Sdf sdf(const GridValue& value, double distance, const Console& console);
    /// Adds the motion of a mesh from one level set to the next, `seconds` later, and the level set before them if it
    /// is known.
    void addDeformation(const GridValue* before, const GridValue& from, const GridValue& to, const MeshKeys& meshes,
                        double seconds);
    /// Returns the level set itself, with a narrow band that is wide enough for that distance.
    LevelSet levelSet(const GridValue& value, double distance, const Console& console);

  private:
    struct Entry {
        std::weak_ptr<const openvdb::GridBase> grid;
        double distance;
        double given; ///< Distance up to which the band of the grid itself is wide enough.
        double voxel;
        Sdf sdf;
    };
    struct Band {
        std::weak_ptr<const openvdb::GridBase> grid;
        double distance;
        LevelSet levelSet;
    };
    struct Deformation {
        std::optional<GridValue> before;
        GridValue from, to;
        MeshKeys meshes;
        double seconds;
        std::vector<std::pair<double, DeformingLevelSet>> known = {}; ///< By distance in voxels.
    };
    const Entry& entry(const GridValue& value, double distance, const Console& console);
    Deformation* deformationTo(const GridValue& value);
    const DeformingLevelSet& deforming(Deformation& deformation, double distance, const Console& console);

    static constexpr size_t kMaxEntries = 8, kMaxBands = 8, kMaxDeformations = 2;
    std::vector<Entry> mEntries;
    std::vector<Band> mBands; // for deformations
    std::list<Deformation> mDeformations;
};

} // namespace curlew::app
