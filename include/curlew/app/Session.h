#pragma once

#include "curlew/app/Action.h"
#include "curlew/app/AnyField.h"
#include "curlew/app/Console.h"
#include "curlew/app/Frames.h"
#include "curlew/base/Error.h"
#include "curlew/base/Parallel.h"
#include "curlew/flow/FlowInTime.h"
#include "curlew/picture/ColorMap.h"
#include "curlew/picture/Image.h"
#include "curlew/render/Camera.h"
#include "curlew/track/Advect.h"
#include "curlew/track/Curves.h"
#include "curlew/vdb/LevelSetAdvection.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <map>
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

    /// From the oldest to the newest.
    std::vector<Entry>& entries() { return mEntries; }
    const std::vector<Entry>& entries() const { return mEntries; }

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
    /// Where the wanted time is between two frames: the level set of the earlier one, and which part of the way it has
    /// gone from there to this one.
    std::shared_ptr<const GridObject> earlier = {};
    double part = 1;
};

using Geometry = std::variant<std::shared_ptr<const Mesh>, Particles, std::shared_ptr<const Curves>>;

/// A picture, with how its first channel is shown in colour.
struct ImageObject {
    Image image;
    ColorMap map = ColorMap::viridis;
    std::optional<Camera> camera = {}; ///< Of a picture in perspective.
};

/// What -emit remembers from frame to frame.
struct Emissions {
    std::map<size_t, double> rates;      ///< By action: the sum of its rates over the frames so far, 1/s.
    std::map<uint64_t, int64_t> nextIds; ///< By the set of points (when it was made): the id of its next one.
};

/// Where a program has come to: what an error is about.
struct Place {
    int line = 0;            ///< Of the scene, as Arguments::line() has it.
    std::string action = {}; ///< Its name; "" before the first one.
};

struct Recording;
struct FrameLevelSets;
struct SdfCache;

/// Everything that a running program has made so far.
class Session {
  public:
    explicit Session(Console& output);

    Console& console;
    Stack<FieldObject> fields{"field"};
    Stack<AnyFlow> flows{"flow"};
    Stack<GridObject> grids{"grid"};
    Stack<Geometry> geometry{"geometry"};
    Stack<ImageObject> images{"image"};
    nlohmann::ordered_json report = nlohmann::ordered_json::object(); ///< What the actions measured, by action.

    uint64_t trackedFlow = 0; ///< When the flow was made that the newest particles' tracks belong to.

    std::optional<FrameClock> clock = {}; ///< While the actions after -frames run.
    /// Called at the end of each frame of -frames, while what the frame has made is still there.
    std::function<void(int frame)> onFrame = {};
    /// Geometry from the program's caller, which -read takes in the place of files of these names.
    std::map<std::string, Geometry> provided = {};
    Place place = {}; ///< The action that runs, or has run last.

    Emissions emissions = {};
    /// Level sets that follow a flow from frame to frame, by action.
    std::map<size_t, std::shared_ptr<LevelSetSequence>> sequences = {};

    /// Runs an action with the values that its expressions have now, and records it for flowInTime().
    void run(const Arguments& written);
    /// How many actions have run since the recording began.
    size_t recorded() const;
    /// Whether points that were made then are carried to the next frame: those that the frame began with, and those of
    /// -emit are.
    bool carries(uint64_t made) const;
    /// What is recorded begins here: the program, or a frame. `changing`: some of the actions to come depend on F or T,
    /// so that what they make is kept to be used again.
    void beginRecording(bool changing = true);

    /// The newest flow as it changes with time, seconds since the first frame (or, without -frames, since T = 0). If
    /// nothing that it may be made of depends on F or T, or it is older than the recording, it is steady. Else at(t)
    /// runs the actions of shapes, fields and flows since then again, with T = t, on the stacks as they were: the same
    /// bits at any time, and no effect on this session. A flow that is scaled to a speed= is so at every time. Level
    /// sets whose files change from frame to frame move from those of the frame before to those of this one: the
    /// distance between is the mean of both, weighted by the time. All other objects stay what they are.
    FlowInTime flowInTime();
    /// The moment, for ordering objects across stacks.
    uint64_t now() { return mClock++; }
    /// That which now() gives next.
    uint64_t nextNow() const { return mClock; }
    void setNextNow(uint64_t moment) { mClock = moment; }
    /// Since the session began.
    double seconds() const { return std::chrono::duration<double>(std::chrono::steady_clock::now() - mBegan).count(); }
    void setThreads(int threads) { mThreads = std::make_unique<ThreadLimit>(threads); }
    /// As many as there are again.
    void resetThreads() { mThreads.reset(); }

    /// The flow of that age, in space; ValueError where there is none, or it is of too high a dimension.
    Flow flow(size_t age = 0) const { return inSpace(flows.at(age)); }
    /// The newest particles; ValueError where there are none.
    Particles& particles(size_t age = 0);
    bool hasParticles() const;
    /// The newest velocity grid, or null.
    openvdb::Vec3SGrid::ConstPtr velocity() const;

    /// A level set on the grid stack as a distance, its band widened where it does not reach `distance` world units
    /// from the surface (the widened grid then takes its place on the stack). What was computed for the same grid and
    /// distance a short time ago is not computed again.
    Sdf levelSetSdf(size_t age, double distance);
    /// The age of the newest level set on the grid stack; none: nothing.
    std::optional<size_t> newestLevelSet() const;
    /// The age of the newest field that is (not) a signed distance; none: nothing.
    std::optional<size_t> newestField(bool sdf) const;
    /// The newest signed distance of all, field or level set, which is good up to `distance` from the surface.
    Sdf newestSdf(double distance);

  private:
    /// Its band reaches `distance` on return.
    Sdf widenedSdf(GridObject& object, double distance);
    /// The grids that were read in this frame, as they were one frame earlier.
    Stack<GridObject> earlierGrids() const;

    uint64_t mClock = 1;
    std::shared_ptr<Recording> mRecording; ///< Whoever asked for a flow in time shares it.
    std::shared_ptr<const FrameLevelSets> mLastLevelSets;
    std::shared_ptr<SdfCache> mSdfs;
    std::chrono::steady_clock::time_point mBegan = std::chrono::steady_clock::now();
    std::unique_ptr<ThreadLimit> mThreads;
};

} // namespace curlew::app
