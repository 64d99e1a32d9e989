// SPDX-License-Identifier: Apache-2.0
#include "Evaluator.h"
#include "curlew/app/registry/InContext.h"
#include "curlew/base/AtomicFile.h"
#include "curlew/base/LocalFile.h"

#include <algorithm>

namespace curlew::app {

// Evaluation of the frames, and the state that is carried from frame to frame.

void Evaluator::prepareFrames() const {
    const std::vector<int> frames = mPlan->frames();
    mSession.location = mGraph.frameLocation;
    if (mGraph.frames == mGraph.nodes.size()) throw ValueError("-frames needs actions after it");
    if (!mPlan->checkpoint.empty() && mParts > 1)
        throw ValueError(
            "checkpoint= cannot be combined with points in several parts; make one part at a time, as with "
            "part=3/500, each with a checkpoint of its own");
    if (isStream(mPlan->checkpoint))
        throw ValueError(fmt::format("checkpoint={} must be a file, since -resume reads it", mPlan->checkpoint));
    if (!mPlan->checkpoint.empty()) checkWritable(mPlan->checkpoint);
    if (mGraph.resume && mPlan->checkpoint.empty())
        throw ValueError("-resume needs the checkpoint of an earlier run; give checkpoint=FILE in both runs");
    if (mPlan->parts > 1 || (mPlan->first > mPlan->start && !mGraph.resume)) requireNoState();
    for (size_t k = mGraph.frames; k < mGraph.nodes.size(); ++k) {
        const Node& node = mGraph.nodes[k];
        if (!node.action().prepare || !mNeeded[k]) continue;
        enter(k);
        inContextOf(contextOf(k), [&] {
            for (const int frame : {frames.front(), frames.back()})
                node.action().prepare(node.arguments.at(momentOf(mPlan->clock(frame))));
        });
    }
}

/// Throws ValueError if frames depend on earlier frames that this process does not evaluate.
void Evaluator::requireNoState() const {
    for (const State& state : mGraph.states) {
        if (state.next.from != Link::From::node) continue;
        const std::string& action = mGraph.nodes[state.next.index].action().name;
        if (mPlan->parts > 1)
            throw ValueError(fmt::format(
                "part= needs frames that do not depend on each other, but -{} carries points from frame to frame",
                action));
        throw ValueError(
            fmt::format("start={} skips the frames before {}, but -{} carries points from frame to frame; run those "
                        "first with checkpoint=FILE and continue with -resume, or use -advect loop=SECONDS, which "
                        "finds the positions in any frame",
                        mPlan->start, mPlan->first, action));
    }
}

void Evaluator::beginFrame(const FrameClock& clock) {
    mClock = clock;
    mNow = momentOf(clock);
    for (size_t k = mGraph.frames; k < mGraph.nodes.size(); ++k)
        if (mVaries[k]) mResults[k].reset(); // so that carried points have a single owner
    for (StateValue& state : mStates) {
        if (!state.points->particles.hasAge()) continue;
        if (state.points.use_count() > 1) state.points = std::make_shared<PointSet>(*state.points);
        state.points->particles.grow(clock.duration);
        state.key = DigestBuilder().add(state.key).add(clock.duration).digest();
    }
}

/// Keeps the results that the next frame needs, such as those of the previous frame.
void Evaluator::keepForNextFrame() {
    // Meshes are slow to read. Those of the first frame, the last two and the next are needed again. So are the level
    // sets of the last two frames.
    std::list<Remembered> kept;
    for (Remembered& one : mRemembered) {
        const auto& made = one.result->outputs;
        const bool mesh = std::any_of(made.begin(), made.end(),
                                      [](const Value& v) { return std::holds_alternative<MeshPointer>(v); });
        const bool levelSet = std::any_of(made.begin(), made.end(), [](const Value& v) {
            const auto* grid = std::get_if<GridValue>(&v);
            return grid && grid->mesh;
        });
        const bool wanted = mesh ? one.time == 0 || one.time >= mClock->begin : levelSet && one.time == mClock->begin;
        if (wanted) kept.push_back(std::move(one));
    }
    for (size_t k = mGraph.frames; k < mGraph.nodes.size(); ++k) {
        const Evaluation evaluation = mGraph.nodes[k].action().evaluation;
        const bool whole = evaluation == Evaluation::file || evaluation == Evaluation::value;
        if (whole && mVaries[k] && !mAdvances[k] && mResults[k]) kept.push_back({k, mNow.time, mResults[k]});
    }
    mRemembered = std::move(kept);
}

void Evaluator::endFrame() {
    std::vector<StateValue> next;
    for (const State& state : mGraph.states) {
        const bool evaluated = state.next.from != Link::From::node || mResults[state.next.index];
        if (!evaluated) {
            next.push_back({std::make_shared<PointSet>(), {}});
            continue;
        }
        next.push_back({std::get<PointsPointer>(value(state.next, mNow)), keyOf(state.next)});
    }
    mStates = std::move(next);
    keepForNextFrame();
}

/// After -resume, finds the flow whose track the points carry, if it was made before the frames.
void Evaluator::findTrackedFlow(TrackedFlow& tracked) const {
    for (size_t k = 0; k < mGraph.frames; ++k)
        for (size_t o = 0; mResults[k] && o < mResults[k]->outputs.size(); ++o)
            if (const auto* flow = std::get_if<AnyFlow>(&mResults[k]->outputs[o]);
                flow && tracked.frame == -1 && keyOf(Link{.index = k, .output = o}) == tracked.identity)
                tracked.flow = std::make_shared<const AnyFlow>(*flow);
}

/// Reads the input files of all frames up to the checkpoint's again, and returns their digest. Throws FileError if they
/// have changed.
Digest Evaluator::inputsUpTo(const Checkpoint& checkpoint, Digest inputs) const {
    for (int64_t frame = checkpoint.since; frame <= checkpoint.frame; frame += int64_t{mPlan->by} * mPlan->parts) {
        Monitor{.report = {}, .cancelled = mSession.console.cancelFunction()}.check();
        inputs = inputsOf(inputs, momentOf(mPlan->clock(int(frame))));
    }
    if (inputs != checkpoint.inputs)
        throw FileError(
            fmt::format("an input file has changed since the checkpoint '{}' was written; restore it, or remove the "
                        "checkpoint and start again",
                        mPlan->checkpoint));
    return inputs;
}

void Evaluator::restore(const Checkpoint& checkpoint) {
    for (size_t k = 0; k < mStates.size() && k < checkpoint.states.size(); ++k)
        mStates[k] = {std::make_shared<PointSet>(checkpoint.states[k].set), checkpoint.states[k].key};
    size_t remembered = 0; // skips settings, which may differ from run to run
    for (size_t k = 0; k < mMemories.size(); ++k)
        if (!mGraph.nodes[k].action().setting && remembered < checkpoint.sums.size())
            mMemories[k].sum = checkpoint.sums[remembered++];
    for (StateValue& state : mStates) findTrackedFlow(state.points->tracked);
}

void Evaluator::runFrames() {
    const std::vector<int> frames = mPlan->frames();
    const Digest program = programDigest();
    for (size_t k = 0; k < mStates.size(); ++k) {
        const auto& initial = mGraph.states[k].initial;
        const bool there = initial && (initial->from != Link::From::node || mResults[initial->index]);
        mStates[k] = {there ? std::get<PointsPointer>(value(*initial, mNow)) : std::make_shared<PointSet>(),
                      there ? keyOf(*initial) : Digest{}};
    }
    size_t done = 0;
    const bool saves = !mPlan->checkpoint.empty();
    Digest inputs = saves ? inputsBefore() : Digest{};
    int since = frames.front();
    if (mGraph.resume) {
        const auto checkpoint = inContextOf("-resume", [&] { return readCheckpoint(mPlan->checkpoint, program); });
        if (checkpoint) {
            inContextOf("-resume", [&] { inputs = inputsUpTo(*checkpoint, inputs); });
            since = checkpoint->since;
            restore(*checkpoint);
            while (done < frames.size() && frames[done] <= checkpoint->frame) ++done;
        }
        if (mPlan->first > mPlan->start && (!checkpoint || checkpoint->frame < mPlan->first - mPlan->by))
            inContextOf("-frames", [&] { requireNoState(); });
        if (checkpoint && done == frames.size())
            mSession.console.info(fmt::format("all frames up to {} are done: the checkpoint is of frame {}",
                                              frames.back(), checkpoint->frame));
        else
            mSession.console.info(
                checkpoint ? fmt::format("resuming after frame {}", checkpoint->frame)
                           : fmt::format("no checkpoint '{}' yet: starting at the first frame", mPlan->checkpoint));
    }
    const double began = mSession.seconds();
    for (const size_t first = done; done < frames.size(); ++done) {
        const double left = (mSession.seconds() - began) / static_cast<double>(std::max<size_t>(done - first, 1)) *
                            static_cast<double>(frames.size() - done);
        mSession.console.info(fmt::format("frame {}, {} of {}{}", frames[done], done + 1, frames.size(),
                                          done > first ? fmt::format(", about {:.0f} s left", left) : ""));
        beginFrame(mPlan->clock(frames[done]));
        for (size_t k = mGraph.frames; k < mGraph.nodes.size(); ++k)
            evaluate(k, fmt::format("frame {}: ", frames[done]));
        if (mSession.onFrame) {
            collect(mGraph.leftInFrame);
            mSession.onFrame(frames[done]);
            mSession.mObjects.clear();
        }
        endFrame();
        mSession.report["frames"] = done + 1;
        if (!saves) continue;
        inputs = inputsOf(inputs, momentOf(mPlan->clock(frames[done])));
        Checkpoint checkpoint{.frame = frames[done], .since = since, .inputs = inputs};
        for (const StateValue& state : mStates) checkpoint.states.push_back({*state.points, state.key});
        for (size_t k = 0; k < mMemories.size(); ++k)
            if (!mGraph.nodes[k].action().setting) checkpoint.sums.push_back(mMemories[k].sum);
        writeCheckpoint(mPlan->checkpoint, program, checkpoint, mSession.console.cancelFunction());
    }
}

} // namespace curlew::app
