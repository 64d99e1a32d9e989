// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/app/run/Console.h"
#include "curlew/app/run/Value.h"

namespace curlew::app {

/// The signed distances of the last few level sets that were asked for.
class SdfCache {
  public:
    /// A level set as a distance that is good up to `distance` world units from the surface; between two frames, that
    /// of the surface on its way.
    Sdf sdf(const GridValue& value, double distance, const Console& console);
    /// The level set itself, its band wide enough for that.
    LevelSet levelSet(const GridValue& value, double distance, const Console& console);

  private:
    struct Entry {
        std::weak_ptr<const openvdb::GridBase> grid;
        double distance;
        LevelSet levelSet;
        Sdf sdf;
    };
    const Entry& entry(const GridValue& value, double distance, const Console& console);

    static constexpr size_t kMost = 6;
    std::vector<Entry> mEntries;
};

} // namespace curlew::app
