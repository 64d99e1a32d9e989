// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/app/run/Console.h"
#include "curlew/app/run/Value.h"
#include "curlew/vdb/LevelSetWay.h"

#include <list>

namespace curlew::app {

/// The signed distances of the last few level sets that were asked for.
class SdfCache {
  public:
    /// A level set as a distance that is good up to `distance` world units from the surface; between two frames, that
    /// of the surface on its way.
    Sdf sdf(const GridValue& value, double distance, const Console& console);
    /// Says how the mesh goes from one level set to the next, and what the level set before them is, if that is known.
    void setWay(const GridValue* before, const GridValue& from, const GridValue& to, const MeshKeys& meshes);
    /// The level set itself, its band wide enough for that.
    LevelSet levelSet(const GridValue& value, double distance, const Console& console);

  private:
    struct Entry {
        std::weak_ptr<const openvdb::GridBase> grid;
        double distance;
        LevelSet levelSet;
        Sdf sdf;
    };
    struct Way {
        std::optional<GridValue> before;
        GridValue from, to;
        MeshKeys meshes;
        std::vector<std::pair<double, LevelSetWay>> known = {}; ///< By the distance asked for.
    };
    const Entry& entry(const GridValue& value, double distance, const Console& console);
    Way* wayTo(const GridValue& value);
    const LevelSetWay& known(Way& way, double distance, const Console& console);

    static constexpr size_t kMost = 8, kMostWays = 2;
    std::vector<Entry> mEntries;
    std::list<Way> mWays;
};

} // namespace curlew::app
