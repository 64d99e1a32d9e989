#include "Recording.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace curlew::app {

namespace {

constexpr size_t kMostTimes = 8;

/// Whether the action makes fields and flows, of nothing but others and level sets.
bool makesFields(const Action& action) {
    constexpr std::array<std::string_view, 3> kGroups{"shapes", "fields", "flows"};
    return std::find(kGroups.begin(), kGroups.end(), action.group) != kGroups.end();
}

/// Whether it makes level sets, of nothing but files and meshes.
bool readsLevelSets(const Action& action) { return action.name == "read" || action.name == "mesh2ls"; }

/// A session with the stacks as they were when the recording began.
void restore(const Recording& recording, Session& session) {
    session.fields = recording.fields;
    session.flows = recording.flows;
    session.grids = recording.grids;
    session.geometry = recording.geometry;
}

std::shared_ptr<const FrameLevelSets> levelSetsOf(const Recording& recording) {
    auto sets = std::make_shared<FrameLevelSets>();
    sets->frame = recording.frame;
    for (size_t k = 0; k < recording.steps.size(); ++k) {
        const Recording::Step& step = recording.steps[k];
        if (!readsLevelSets(step.arguments.action())) continue;
        for (const auto& [object, made] : step.grids.entries())
            if (made >= step.now && object.grid->getGridClass() == openvdb::GRID_LEVEL_SET)
                sets->entries.push_back({k, made - step.now, object});
    }
    return sets;
}

/// Where they were read in each frame, level sets stand between those of the frame before and their own.
void moveLevelSets(Stack<GridObject>& grids, const Stack<GridObject>& earlier, double part) {
    for (auto& [object, made] : grids.entries())
        for (const auto& entry : earlier.entries())
            if (entry.made == made && entry.object.grid->getGridClass() == openvdb::GRID_LEVEL_SET) {
                object.earlier = std::make_shared<const GridObject>(entry.object);
                object.part = part;
            }
}

/// What flowInTime() needs to make flows when the session has gone on.
struct Replay {
    std::shared_ptr<const Recording> recording;
    size_t count;                   ///< Of its steps.
    FrameClock clock;               ///< Of the frame that is recorded.
    Stack<GridObject> earlierGrids; ///< Those that change from frame to frame, as they were one frame earlier.

    Flow at(double time, Session& session) const {
        restore(*recording, session);
        const double part = clock.duration > 0 ? std::clamp((time - clock.begin) / clock.duration, 0.0, 1.0) : 1;
        for (size_t k = 0; k < count; ++k) {
            const Recording::Step& step = recording->steps[k];
            session.setNextNow(step.now);
            if (makesFields(step.arguments.action())) {
                step.arguments.action().run(session, step.arguments.at(clock.moment(time)));
            } else {
                session.grids = step.grids;
                moveLevelSets(session.grids, earlierGrids, part);
            }
        }
        return session.flow();
    }
};

} // namespace

void Session::run(const Arguments& written) {
    const Arguments arguments = written.at(clock ? clock->moment() : Moment{});
    const uint64_t before = mClock;
    arguments.action().run(*this, arguments);
    const bool keepsGrids = mRecording->changing && !makesFields(arguments.action());
    mRecording->steps.push_back({written, before, keepsGrids ? grids : Stack<GridObject>("grid")});
}

size_t Session::recorded() const { return mRecording->steps.size(); }

bool Session::carries(uint64_t made) const { return made < mRecording->began || emissions.nextIds.contains(made); }

void Session::beginRecording(bool changing) {
    mLastLevelSets = levelSetsOf(*mRecording);
    mRecording = std::make_shared<Recording>();
    mRecording->frame = clock ? clock->frame : -1;
    mRecording->changing = changing;
    mRecording->began = mClock;
    mRecording->fields = fields;
    mRecording->flows = flows;
    mRecording->grids = grids;
    for (const auto& [object, made] : geometry.entries())
        mRecording->geometry.push(std::holds_alternative<Particles>(object) ? Geometry(Particles{}) : object, made);
}

FlowInTime Session::flowInTime() {
    const Flow newest = flow();
    const auto& steps = mRecording->steps;
    const bool moving = clock && clock->duration > 0;
    bool newFields = false, newLevelSets = false;
    for (const auto& step : steps) {
        const Action& action = step.arguments.action();
        newFields = newFields || (makesFields(action) && step.arguments.changes());
        newLevelSets = newLevelSets || (moving && readsLevelSets(action) && step.arguments.changes());
    }
    if (!(newFields || newLevelSets) || flows.entry().made < mRecording->began) return newest;
    const Replay replay{.recording = mRecording,
                        .count = steps.size(),
                        .clock = clock.value_or(FrameClock{}),
                        .earlierGrids = newLevelSets ? earlierGrids() : Stack<GridObject>("grid")};
    auto known = std::make_shared<std::vector<std::pair<double, Flow>>>();
    known->emplace_back(replay.clock.time, newest);
    return FlowInTime([known, replay, sdfs = mSdfs, cancelled = console.cancelFunction()](double time) {
        for (const auto& [t, flow] : *known)
            if (t == time) return flow;
        Console silent(Listener{.cancelled = cancelled});
        Session session(silent);
        session.mSdfs = sdfs;
        Flow flow = replay.at(time, session);
        if (known->size() == kMostTimes) known->erase(known->begin());
        known->emplace_back(time, flow);
        return flow;
    });
}

Stack<GridObject> Session::earlierGrids() const {
    Moment moment = clock->moment(clock->begin);
    moment.frame = std::round(moment.frame);
    const auto& steps = mRecording->steps;
    if (mLastLevelSets->frame == static_cast<int>(moment.frame) && mRecording->changing) {
        Stack<GridObject> known("grid");
        for (const auto& [step, offset, object] : mLastLevelSets->entries)
            if (step < steps.size()) known.push(object, steps[step].now + offset);
        return known;
    }
    Console silent(Listener{.cancelled = console.cancelFunction()});
    Session session(silent);
    session.provided = provided;
    restore(*mRecording, session);
    session.grids = Stack<GridObject>("grid");
    for (const auto& step : steps) {
        session.setNextNow(step.now);
        if (readsLevelSets(step.arguments.action())) step.arguments.action().run(session, step.arguments.at(moment));
    }
    return session.grids;
}

} // namespace curlew::app
