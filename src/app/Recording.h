#pragma once

#include "curlew/app/Session.h"

namespace curlew::app {

/// What has run since the program or the frame began, and the stacks as they were then: handles, all of them.
struct Recording {
    struct Step {
        Arguments arguments;
        uint64_t now;            ///< Before it ran.
        Stack<GridObject> grids; ///< After it ran, where it makes no field and something changes with time.
    };

    int frame = -1;       ///< Which frame it is of; -1: of none.
    bool changing = true; ///< Whether some step changes with time.
    uint64_t began = 1;
    Stack<FieldObject> fields{"field"};
    Stack<AnyFlow> flows{"flow"};
    Stack<GridObject> grids{"grid"};
    Stack<Geometry> geometry{"geometry"}; ///< Meshes; points are left out, their places kept.
    std::vector<Step> steps;
};

/// The level sets that a frame has read, for the next one.
struct FrameLevelSets {
    struct Entry {
        size_t step;     ///< Which step of its recording has made it.
        uint64_t offset; ///< When: this much after the step began.
        GridObject object;
    };

    int frame = -1;
    std::vector<Entry> entries;
};

/// The signed distances of the last few level sets.
struct SdfCache {
    struct Entry {
        std::weak_ptr<const openvdb::GridBase> of;
        double distance;
        openvdb::GridBase::ConstPtr widened;
        Sdf sdf;
    };
    static constexpr size_t kMost = 4;

    std::vector<Entry> entries;

    void add(Entry entry) {
        if (entries.size() == kMost) entries.erase(entries.begin());
        entries.push_back(std::move(entry));
    }
};

} // namespace curlew::app
