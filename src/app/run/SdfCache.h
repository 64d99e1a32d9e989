// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/app/run/Console.h"
#include "curlew/app/run/Value.h"
#include "curlew/vdb/LevelSetWay.h"

#include <list>

namespace curlew::app {

/// Caches the signed distances of the last few level sets that were requested.
class SdfCache {
  public:
    /// Returns a level set as a signed distance that is valid up to `distance` world units from the surface. For a
    /// level set between two frames, this is the distance to the surface in between.
    Sdf sdf(const GridValue& value, double distance, const Console& console);
    /// Sets how the mesh moves from one level set to the next in so many seconds, and which level set precedes them, if
    /// known.
    void setWay(const GridValue* before, const GridValue& from, const GridValue& to, const MeshKeys& meshes,
                double seconds);
    /// Returns the level set itself, with a narrow band that is wide enough for that distance.
    LevelSet levelSet(const GridValue& value, double distance, const Console& console);

  private:
    struct Entry {
        std::weak_ptr<const openvdb::GridBase> grid;
        double distance;
        double voxel;
        Sdf sdf;
    };
    struct Band {
        std::weak_ptr<const openvdb::GridBase> grid;
        double distance;
        LevelSet levelSet;
    };
    struct Way {
        std::optional<GridValue> before;
        GridValue from, to;
        MeshKeys meshes;
        double seconds;
        std::vector<std::pair<double, LevelSetWay>> known = {}; ///< By requested distance.
    };
    const Entry& entry(const GridValue& value, double distance, const Console& console);
    Way* wayTo(const GridValue& value);
    const LevelSetWay& known(Way& way, double distance, const Console& console);

    static constexpr size_t kMost = 8, kMostBands = 4, kMostWays = 2;
    std::vector<Entry> mEntries;
    std::vector<Band> mBands; // for ways between level sets
    std::list<Way> mWays;
};

} // namespace curlew::app
