#include "Runner.h"

#include "Checkpoint.h"
#include "Context.h"
#include "curlew/base/AtomicFile.h"
#include "curlew/base/Memory.h"

#include <algorithm>
#include <array>
#include <chrono>

namespace curlew::app {

namespace {

using Clock = std::chrono::steady_clock;

double secondsSince(Clock::time_point began) { return std::chrono::duration<double>(Clock::now() - began).count(); }

template <class T>
bool havePoints(const std::vector<T>& things) {
    return std::any_of(things.begin(), things.end(), [](const T& thing) {
        return std::find(thing.kinds.begin(), thing.kinds.end(), Kind::points) != thing.kinds.end();
    });
}
bool makesPoints(const Action& action) { return havePoints(action.makes); }
bool takesPoints(const Action& action) { return havePoints(action.takes); }

/// What stood on the stacks at -frames, and is to stand there at the beginning of every frame.
class Outside {
  public:
    explicit Outside(const Session& s) : mFields(s.fields), mFlows(s.flows), mGrids(s.grids), mImages(s.images) {
        for (const auto& entry : s.geometry.entries())
            if (!std::holds_alternative<Particles>(entry.object)) mMeshes.push_back(entry);
    }

    /// Drops what the frame has made, but for the points that are carried on.
    void endFrame(Session& s) const {
        s.fields = mFields;
        s.flows = mFlows;
        s.grids = mGrids;
        s.images = mImages;
        std::vector<Stack<Geometry>::Entry> kept = mMeshes;
        for (auto& entry : s.geometry.entries())
            if (std::holds_alternative<Particles>(entry.object) && s.carries(entry.made))
                kept.push_back(std::move(entry));
        std::sort(kept.begin(), kept.end(), [](const auto& a, const auto& b) { return a.made < b.made; });
        s.geometry.entries() = std::move(kept);
    }

  private:
    Stack<FieldObject> mFields;
    Stack<AnyFlow> mFlows;
    Stack<GridObject> mGrids;
    Stack<ImageObject> mImages;
    std::vector<Stack<Geometry>::Entry> mMeshes;
};

/// All points on the stack are older by the frame.
void growPoints(Session& s) {
    for (auto& entry : s.geometry.entries())
        if (auto* particles = std::get_if<Particles>(&entry.object)) particles->grow(s.clock->duration);
}

/// Whatever decides on what the frames hold: the actions, and of -frames all but how far it goes.
uint64_t programDigest(const Program& program, const FramePlan& plan) {
    constexpr std::array<std::string_view, 5> kSilent{"frames", "resume", "quiet", "verbose", "threads"};
    std::string text = fmt::format("frames {}x{} fps={} substeps={} part={}/{}\n", plan.first, plan.by, plan.fps,
                                   plan.substeps, plan.part, plan.parts);
    for (const auto& action : program.actions)
        if (std::find(kSilent.begin(), kSilent.end(), action.action().name) == kSilent.end())
            text += action.program() + "\n";
    return digestOf(text);
}

} // namespace

Runner::Runner(const Program& program, Session& session)
    : mProgram(program), mSession(session), mTook(program.actions.size()), mFrames(program.actions.size()) {
    for (size_t k = 0; k < program.actions.size(); ++k) {
        const std::string& name = action(k).action().name;
        mResume = mResume || name == "resume";
        if (name != "frames") continue;
        enter(k);
        if (mFrames != program.actions.size()) throw ValueError("-frames: is given twice; a program has one");
        mFrames = k;
    }
}

const std::string& Runner::enter(size_t k) const {
    mSession.place = {.line = action(k).line(), .action = action(k).action().name};
    return mSession.place.action;
}

bool Runner::changes(size_t begin, size_t end) const {
    for (size_t k = begin; k < end; ++k)
        if (action(k).changes()) return true;
    return false;
}

void Runner::prepare() const {
    for (size_t k = 0; k < mFrames; ++k)
        if (action(k).action().prepare)
            inContextOf("-" + enter(k), [&] { action(k).action().prepare(action(k).at({})); });
    if (mFrames < mProgram.actions.size())
        inContextOf("-" + enter(mFrames), [&] { prepareFrames(); });
    else if (mResume)
        throw ValueError("-resume: there is nothing to resume without -frames");
}

void Runner::prepareFrames() const {
    const FramePlan plan = framePlanOf(action(mFrames).at({}));
    const std::vector<int> frames = plan.frames();
    if (frames.empty())
        throw ValueError(
            fmt::format("there are fewer frames than parts: none is left for part={}/{}", plan.part, plan.parts));
    if (mFrames + 1 == mProgram.actions.size())
        throw ValueError("there is nothing to do for a frame: no action follows");
    if (!plan.checkpoint.empty()) checkWritable(plan.checkpoint);
    if (mResume && plan.checkpoint.empty())
        throw ValueError("-resume needs the checkpoint that an earlier run has written; give both checkpoint=FILE");
    bool ownPoints = false;
    for (size_t k = mFrames + 1; k < mProgram.actions.size(); ++k) {
        const Action& declared = action(k).action();
        if (plan.parts > 1 && makesPoints(declared) && takesPoints(declared) && !ownPoints)
            throw ValueError(fmt::format(
                "part= splits frames that do not depend on each other, but -{} carries points from frame to frame",
                declared.name));
        ownPoints = ownPoints || (makesPoints(declared) && !takesPoints(declared));
        if (!declared.prepare) continue;
        inContextOf("-" + enter(k), [&] {
            for (const int frame : {frames.front(), frames.back()})
                declared.prepare(action(k).at(plan.clock(frame).moment()));
        });
    }
}

void Runner::runAction(size_t k, const std::string& place) {
    if (mSession.console.cancelled()) throw Interrupted();
    const auto began = Clock::now();
    if (const Monitor whole = mSession.console.follow(action(k).action().name); whole.report) whole.report(0);
    inContextOf(place + "-" + enter(k), [&] { mSession.run(action(k)); });
    const double seconds = secondsSince(began);
    Took& took = mTook[k];
    took.seconds += seconds;
    auto& entries = mSession.report["actions"];
    if (!took.entry) {
        took.entry = entries.size();
        entries.push_back({{"action", action(k).program()}});
    }
    entries[*took.entry]["seconds"] = took.seconds;
    mSession.console.detail(fmt::format("{}: {:.3f} s, peak memory {}", action(k).program(), seconds,
                                        formatBytes(static_cast<double>(peakMemory()))));
}

void Runner::runFrames() {
    const FramePlan plan = framePlanOf(action(mFrames).at({}));
    const std::vector<int> frames = plan.frames();
    const uint64_t digest = programDigest(mProgram, plan);
    const bool changing = changes(mFrames + 1, mProgram.actions.size());
    const Outside outside(mSession);
    size_t done = 0;
    if (mResume) {
        const auto last = inContextOf("-resume", [&] { return restoreCheckpoint(plan.checkpoint, digest, mSession); });
        while (last && done < frames.size() && frames[done] <= *last) ++done;
        mSession.console.say(last ? fmt::format("resuming after frame {}", *last)
                                  : fmt::format("there is no '{}' yet: starting at the first frame", plan.checkpoint));
    }
    const auto began = Clock::now();
    for (const size_t first = done; done < frames.size(); ++done) {
        const double left = secondsSince(began) / static_cast<double>(std::max<size_t>(done - first, 1)) *
                            static_cast<double>(frames.size() - done);
        mSession.console.say(fmt::format("frame {}, {} of {}{}", frames[done], done + 1, frames.size(),
                                         done > first ? fmt::format(", about {:.0f} s left", left) : ""));
        mSession.clock = plan.clock(frames[done]);
        growPoints(mSession);
        mSession.beginRecording(changing);
        for (size_t k = mFrames + 1; k < mProgram.actions.size(); ++k)
            runAction(k, fmt::format("frame {}: ", frames[done]));
        if (mSession.onFrame) mSession.onFrame(frames[done]);
        outside.endFrame(mSession);
        mSession.report["frames"] = done + 1;
        if (!plan.checkpoint.empty()) writeCheckpoint(plan.checkpoint, digest, mSession);
    }
}

/// Where the time went, for -verbose: a line for each action that took a thousandth of it.
void Runner::sayShares() const {
    double total = 0;
    for (const Took& one : mTook) total += one.seconds;
    for (size_t k = 0; k < mTook.size(); ++k)
        if (mTook[k].entry && mTook[k].seconds >= 1e-3 * total)
            mSession.console.detail(fmt::format("{:>9.3f} s {:5.1f} %  -{}", mTook[k].seconds,
                                                100 * mTook[k].seconds / total, action(k).action().name));
}

void Runner::run() {
    prepare();
    mSession.beginRecording(changes(0, mFrames));
    for (size_t k = 0; k < mFrames; ++k) runAction(k, "");
    if (mFrames < mProgram.actions.size()) runFrames();
    sayShares();
}

} // namespace curlew::app
