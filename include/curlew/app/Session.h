#pragma once

#include "curlew/app/Action.h"
#include "curlew/app/AnyField.h"
#include "curlew/app/Console.h"
#include "curlew/base/Error.h"
#include "curlew/base/Parallel.h"
#include "curlew/image/ColorMap.h"
#include "curlew/image/Image.h"
#include "curlew/track/Advect.h"
#include "curlew/track/Curves.h"
#include "curlew/vdb/LevelSet.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <variant>

namespace curlew::app {

/// A stack of one kind of object. Age 0 is the newest. Every object knows when it was made, across all stacks.
template <class T>
class Stack {
  public:
    struct Entry {
        T object;
        uint64_t made;
    };

    explicit Stack(std::string kind) : mKind(std::move(kind)) {}

    bool empty() const { return mEntries.empty(); }
    size_t size() const { return mEntries.size(); }

    /// Throws ValueError where there is no such object.
    const Entry& entry(size_t age = 0) const { return mEntries[indexOf(age)]; }
    const T& at(size_t age = 0) const { return entry(age).object; }
    T& at(size_t age = 0) { return mEntries[indexOf(age)].object; }

    void push(T object, uint64_t made) { mEntries.push_back({std::move(object), made}); }
    T take(size_t age = 0) {
        const auto position = mEntries.begin() + static_cast<std::ptrdiff_t>(indexOf(age));
        T object = std::move(position->object);
        mEntries.erase(position);
        return object;
    }

  private:
    size_t indexOf(size_t age) const {
        if (age >= mEntries.size())
            throw ValueError(mEntries.empty() ? fmt::format("there is no {} yet", mKind)
                                              : fmt::format("there is no {} of age {}; there {} {}", mKind, age,
                                                            mEntries.size() == 1 ? "is" : "are", mEntries.size()));
        return mEntries.size() - 1 - age;
    }
    std::string mKind;
    std::vector<Entry> mEntries;
};

struct FieldObject {
    AnyField field;
    std::string program;           ///< What made it, for -print.
    std::optional<Sdf> sdf = {};   ///< Where the field is a signed distance.
    std::optional<Wall> wall = {}; ///< Where the field is bounded by one.
};

struct GridObject {
    openvdb::GridBase::ConstPtr grid;
    std::shared_ptr<const Mesh> mesh; ///< Where the grid is a level set of one.
};

using Geometry = std::variant<std::shared_ptr<const Mesh>, Particles, std::shared_ptr<const Curves>>;

/// A picture, with how its first channel is shown in colour.
struct ImageObject {
    Image image;
    ColorMap map;
};

/// Everything that a running program has made so far.
class Session {
  public:
    explicit Session(Console& output) : console(output) {}

    Console& console;
    Stack<FieldObject> fields{"field"};
    Stack<AnyFlow> flows{"flow"};
    Stack<GridObject> grids{"grid"};
    Stack<Geometry> geometry{"geometry"};
    Stack<ImageObject> images{"image"};
    nlohmann::ordered_json report = nlohmann::ordered_json::object(); ///< What the actions measured, by action.

    uint64_t trackedFlow = 0; ///< When the flow was made that the newest particles' tracks belong to.

    /// The moment, for ordering objects across stacks.
    uint64_t now() { return mClock++; }
    /// Since the session began.
    double seconds() const { return std::chrono::duration<double>(std::chrono::steady_clock::now() - mBegan).count(); }
    void setThreads(int threads) { mThreads = std::make_unique<ThreadLimit>(threads); }

    /// The flow of that age, in space; ValueError where there is none, or it is of too high a dimension.
    Flow flow(size_t age = 0) const { return inSpace(flows.at(age)); }
    /// The newest particles; ValueError where there are none.
    Particles& particles(size_t age = 0);
    bool hasParticles() const;
    /// The newest velocity grid, or null.
    openvdb::Vec3SGrid::ConstPtr velocity() const;

    /// A level set on the grid stack as a distance, its band widened where it does not reach `distance` world units
    /// from the surface (the widened grid then takes its place on the stack).
    Sdf levelSetSdf(size_t age, double distance);
    /// The age of the newest level set on the grid stack; none: nothing.
    std::optional<size_t> newestLevelSet() const;
    /// The age of the newest field that is (not) a signed distance; none: nothing.
    std::optional<size_t> newestField(bool sdf) const;
    /// The newest signed distance of all, field or level set, which is good up to `distance` from the surface.
    Sdf newestSdf(double distance);

  private:
    uint64_t mClock = 1;
    std::chrono::steady_clock::time_point mBegan = std::chrono::steady_clock::now();
    std::unique_ptr<ThreadLimit> mThreads;
};

} // namespace curlew::app
