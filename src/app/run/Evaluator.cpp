// SPDX-License-Identifier: Apache-2.0
#include "Evaluator.h"

#include "Advice.h"
#include "FileNames.h"
#include "SdfCache.h"
#include "curlew/app/registry/InContext.h"
#include "curlew/app/registry/Text.h"
#include "curlew/base/Memory.h"

#include <algorithm>

namespace curlew::app {

namespace {

using Clock = std::chrono::steady_clock;

constexpr size_t kMostRemembered = 8; ///< Limit for the results of a node at other times.
constexpr size_t kWantedLater = std::numeric_limits<size_t>::max();

double secondsSince(Clock::time_point began) { return std::chrono::duration<double>(Clock::now() - began).count(); }

} // namespace

Evaluator::Evaluator(Session& session, const Graph& graph)
    : mSession(session),
      mGraph(graph),
      mResults(session.mResults),
      mStates(graph.states.size()),
      mMemories(graph.nodes.size()),
      mVaries(graph.nodes.size()),
      mAdvances(graph.nodes.size()),
      mInParts(graph.nodes.size()),
      mNeeded(graph.nodes.size(), true),
      mTimings(graph.nodes.size()) {
    mResults.assign(graph.nodes.size(), nullptr);
    analyse();
}

void Evaluator::analyse() {
    for (size_t k = 0; k < mGraph.nodes.size(); ++k) {
        const Node& node = mGraph.nodes[k];
        mAdvances[k] = mGraph.inFrames(k) && node.action().advances(node.arguments);
        mVaries[k] = node.action().changes(node.arguments) || mAdvances[k];
        for (const auto& links : node.inputs)
            for (const Link& link : links) {
                // A field or flow may be evaluated again at another time, and so may a level set made from a mesh.
                const bool again = node.action().evaluation == Evaluation::anyTime ||
                                   (mGraph.inFrames(k) && node.action().makesKind(Kind::levelSet));
                size_t& last = mLastUse[link];
                last = again || last == kWantedLater ? kWantedLater : k;
                const bool state = link.from == Link::From::state && mGraph.inFrames(k);
                const bool sameSection =
                    link.from == Link::From::node && mGraph.inFrames(link.index) == mGraph.inFrames(k);
                mVaries[k] = mVaries[k] || state || (sameSection && mVaries[link.index]);
                mAdvances[k] = mAdvances[k] || state || (sameSection && mAdvances[link.index]);
            }
    }
    findParts();
    // Keep objects that are made once, or do not change, for all frames and parts.
    for (auto& [link, last] : mLastUse) {
        const bool node = link.from == Link::From::node && last != kWantedLater;
        if (link.from == Link::From::given ||
            (node && mGraph.inFrames(last) && (!mGraph.inFrames(link.index) || !mVaries[link.index])) ||
            (node && mInParts[last] && !mInParts[link.index]))
            last = kWantedLater;
    }
    for (const State& state : mGraph.states) {
        if (state.initial) mLastUse[*state.initial] = kWantedLater;
        if (state.next.from == Link::From::node) mLastUse[state.next] = kWantedLater;
    }
    if (mGraph.wanted.empty() && mGraph.effects) return;
    mNeeded.assign(mGraph.nodes.size(), false);
    std::vector<Link> needed;
    for (const auto& name : mGraph.wanted) needed.push_back(linkOf(mGraph, name));
    for (size_t k = 0; k < mGraph.nodes.size(); ++k)
        if (const Action& action = mGraph.nodes[k].action();
            action.evaluation == Evaluation::effect && (mGraph.effects || action.setting))
            needed.push_back({.index = k});
    std::vector<bool> followed(mGraph.states.size());
    while (!needed.empty()) {
        const Link link = needed.back();
        needed.pop_back();
        if (link.from == Link::From::state && !followed[link.index]) {
            followed[link.index] = true;
            const State& state = mGraph.states[link.index];
            if (state.initial) needed.push_back(*state.initial);
            needed.push_back(state.next); // the state of the next frame, wherever it is made
        }
        if (link.from != Link::From::node || mNeeded[link.index]) continue;
        mNeeded[link.index] = true;
        for (const auto& links : mGraph.nodes[link.index].inputs)
            needed.insert(needed.end(), links.begin(), links.end());
    }
}

// --- values

Value Evaluator::value(const Link& link, const Moment& moment, As as) {
    if (link.from == Link::From::given) return mSession.mGiven.at(link.index).value;
    if (link.from == Link::From::state) return mStates[link.index].points;
    const bool wholeFrames = mGraph.nodes[link.index].action().evaluation != Evaluation::anyTime;
    if (!isNow(moment) && wholeFrames) return betweenFrames(link, moment, as);
    const ResultPointer result = resultAt(link.index, moment);
    if (!result || link.output >= result->outputs.size())
        throw ValueError(fmt::format("'{}' has not been made", app::nameOf(mGraph, link)));
    return asBody(link, result->outputs[link.output], mClock);
}

bool Evaluator::steady(const Link& link) const {
    return link.from != Link::From::node || !mVaries[link.index] || (mClock && !mGraph.inFrames(link.index));
}

Moment Evaluator::momentAt(double seconds) const {
    if (!mClock) {
        Moment moment = mNow;
        moment.frame += (seconds - mNow.time) * mNow.fps;
        moment.time = seconds;
        return moment;
    }
    const FrameClock& clock = *mClock;
    // The sum of a frame's steps has a rounding error.
    for (const double known : {clock.begin, clock.time})
        if (std::abs(seconds - known) <= 1e-9 * clock.duration) seconds = known;
    return clock.moment(seconds);
}

ResultPointer Evaluator::resultAt(size_t node, const Moment& moment) {
    const bool fixed = isNow(moment) || mAdvances[node] || steady({.index = node});
    if (fixed) return mResults[node];
    size_t known = 0;
    for (const Remembered& one : mRemembered) {
        if (one.node != node) continue;
        if (one.time == moment.time) return one.result;
        ++known;
    }
    if (known >= kMostRemembered) mRemembered.erase(std::ranges::find(mRemembered, node, &Remembered::node));
    Console silent(Listener{.cancelled = mSession.console.cancelFunction()});
    ResultPointer result = computed(node, moment, silent, {});
    mRemembered.push_back({node, moment.time, result});
    return result;
}

ResultPointer Evaluator::resultInFrame(size_t node, const FrameClock& clock) {
    return mClock && clock.frame == mClock->frame ? mResults[node] : resultAt(node, clock.moment());
}

/// Returns the frame in whose interval a moment is. After the last frame, that is the one that would follow, or the
/// last one if the object cannot be made in that: a file does not exist.
FrameClock Evaluator::clockOf(const Link& link, const Moment& moment) {
    if (moment.time >= mClock->begin && moment.time <= mClock->time) return *mClock;
    const FrameClock clock = mPlan->clockAt(moment.time);
    if (clock.frame <= mPlan->last) return clock;
    try {
        resultInFrame(link.index, clock);
        return clock;
    } catch (const Interrupted&) {
        throw;
    } catch (const Error&) {
        return mPlan->clock(mPlan->last);
    }
}

/// Returns an object between two frames. If a mesh corresponds to that of the previous frame, its points are
/// interpolated. A level set is interpolated between the two frames; if it is made from such a mesh, it follows the
/// mesh. Other grids come with those of the earlier frame, so that actions can blend what they make of them. Other
/// objects are those of the frame.
Value Evaluator::betweenFrames(const Link& link, const Moment& moment, As as) {
    const bool moves = mClock && !mAdvances[link.index] && !steady(link);
    if (!moves) return resultAt(link.index, mNow)->outputs.at(link.output);
    const bool inFrame = as == As::inFrame;
    const FrameClock clock = inFrame ? mPlan->clock(static_cast<int>(moment.frame)) : clockOf(link, moment);
    const auto outputOf = [&](const FrameClock& at) -> Value {
        const auto& outputs = resultInFrame(link.index, at)->outputs;
        return link.output < outputs.size() ? outputs[link.output] : Value{};
    };
    const double part = clock.duration > 0 ? std::clamp((moment.time - clock.begin) / clock.duration, 0.0, 1.0) : 1.0;
    if (const auto body = as == As::body ? bodyAt(link, clock, part) : std::nullopt) {
        GridValue grid = *body->first;
        grid.body = body;
        return grid;
    }
    Value there = outputOf(clock);
    if (inFrame) return asBody(link, std::move(there), clock);
    if (std::holds_alternative<MeshPointer>(there))
        if (const auto keys = meshKeys(link, clock)) return std::make_shared<const Mesh>(meshBetween(*keys, part));
    auto* grid = std::get_if<GridValue>(&there);
    if (!grid || clock.duration == 0) return there;
    if (part >= 1) return there;
    Value earlier = outputOf(frameBefore(clock));
    if (const auto* from = std::get_if<GridValue>(&earlier)) {
        followMesh(link, clock, *from, *grid);
        grid->earlier = std::make_shared<const GridValue>(*from);
    }
    grid->part = part;
    return there;
}

PointSet Evaluator::take(const Link& link, size_t node) {
    const bool last = mLastUse.at(link) == node;
    if (last && link.from == Link::From::state && mClock) {
        PointsPointer& points = mStates[link.index].points;
        if (points.use_count() == 1) return std::move(*points);
        return *points;
    }
    if (last && link.from == Link::From::node && !mSession.mKeeps) {
        auto& points = std::get<PointsPointer>(mResults[link.index]->outputs.at(link.output));
        if (points.use_count() == 1) return std::move(*points);
    }
    const Value held = value(link, mNow);
    return *std::get<PointsPointer>(held);
}

// --- evaluation

const SourceLocation& Evaluator::enter(size_t node) const {
    mSession.location = mGraph.nodes[node].location;
    if (mSession.location.node.empty()) mSession.location.node = mGraph.nodes[node].name;
    return mSession.location;
}

std::string Evaluator::contextOf(size_t node) const { return curlew::app::contextOf(mGraph.nodes[node].location); }

ResultPointer Evaluator::computed(size_t index, const Moment& moment, Console& console, const Digest& key) {
    const Node& node = mGraph.nodes[index];
    auto result = std::make_shared<NodeResult>();
    result->key = key;
    Moment inPart = moment;
    inPart.part = mNow.part;
    Arguments now = node.arguments.at(inPart);
    Context context(*this, console, index, inPart, *result);
    if (now.hasRelativeLengths()) now = now.relativeTo(context.diagonal());
    node.action().run(context, now);
    for (Value& value : result->outputs) {
        auto* field = std::get_if<FieldValue>(&value);
        if (!field) continue;
        std::vector<std::string> programs;
        for (size_t k = 0; k < node.inputs.size(); ++k)
            for (size_t n = 0; n < node.inputs[k].size() && node.action().takes[k].use == Use::taken; ++n)
                programs.push_back(fmt::format("({})", context.programOf(node.action().takes[k].name, n)));
        field->program = now.program() + (programs.empty() ? "" : " of " + join(programs, " and "));
    }
    return result;
}

/// Adds a node's figures to the report.
void Evaluator::apply(size_t index) {
    const Node& node = mGraph.nodes[index];
    for (const auto& [name, figures] : mResults[index]->figures) {
        mSession.report[name] = figures;
        if (node.named && node.name != name) mSession.report[node.name] = figures;
        if (mInParts[index])
            mSession.report["parts"][static_cast<size_t>(mNow.part) - 1][node.named ? node.name : name] = figures;
    }
}

void Evaluator::record(size_t index, double seconds) {
    const Node& node = mGraph.nodes[index];
    Timing& timing = mTimings[index];
    timing.seconds += seconds;
    auto& entries = mSession.report["actions"];
    if (!timing.entry) {
        timing.entry = entries.size();
        entries.push_back({{"action", node.arguments.program()}});
        if (node.named) entries.back()["node"] = node.name;
    }
    entries[*timing.entry]["seconds"] = timing.seconds;
    mSession.console.detail(fmt::format("{}: {:.3f} s, peak memory {}", node.arguments.program(), seconds,
                                        formatBytes(static_cast<double>(peakMemory()))));
}

void Evaluator::evaluate(size_t index, const std::string& place) {
    const Node& node = mGraph.nodes[index];
    if (!mNeeded[index]) return;
    const bool effect = node.action().evaluation == Evaluation::effect;
    if (effect && mNow.part > static_cast<double>(mFirstPart) && !mInParts[index]) return; // done in the first part
    enter(index);
    if (mSession.console.cancelled()) throw Interrupted();
    if (!effect && !mVaries[index] && mResults[index]) return; // unchanged since the previous frame
    const auto began = Clock::now();
    inContextOf(place + contextOf(index), [&] {
        const Digest key = keyOf(index);
        // A reused value would not update the memory of a node that advances with the frames. A velocity grid also
        // depends on the wall's velocity, and so on meshes of other frames.
        const bool advances = mClock && (node.action().advances(node.arguments) ||
                                         (mVaries[index] && node.action().makesKind(Kind::velocity)));
        const auto known = effect || advances ? mSession.mKnown.end() : mSession.mKnown.find(key);
        if (known != mSession.mKnown.end()) {
            mResults[index] = known->second;
        } else {
            if (const Monitor whole = mSession.console.follow(node.action().name); whole.report) whole.report(0);
            mResults[index] = computed(index, mNow, mSession.console, key);
            mSession.mEvaluated.push_back(node.name);
        }
    });
    apply(index);
    record(index, secondsSince(began));
    release(index);
}

/// Frees inputs that no later node uses. Does nothing if the session keeps its results.
void Evaluator::release(size_t index) {
    if (mSession.mKeeps) return;
    for (const auto& links : mGraph.nodes[index].inputs)
        for (const Link& link : links)
            if (link.from == Link::From::node && mLastUse.at(link) == index)
                mResults[link.index]->outputs.at(link.output) = {};
}

void Evaluator::prepare() {
    requireFileNames(mGraph, mPlan, beforeFrames(mFirstPart), mNeeded, mInParts,
                     [&](const std::string& name) { return mSession.mProvided.contains(name); });
    for (size_t k = 0; k < mGraph.frames; ++k)
        if (const auto& check = mGraph.nodes[k].action().prepare; check && mNeeded[k]) {
            enter(k);
            inContextOf(contextOf(k), [&] { check(mGraph.nodes[k].arguments.at(mNow)); });
        }
    if (mGraph.frameRange)
        inContextOf("-frames", [&] { prepareFrames(); });
    else if (mGraph.resume)
        throw ValueError("-resume: needs -frames");
}

/// Stores the objects of these entries in the session, if they have been made.
void Evaluator::collect(const std::vector<Entry>& entries) {
    mSession.mObjects.clear();
    for (const Entry& entry : entries) {
        const Link& link = entry.link;
        if (link.from == Link::From::node &&
            (!mResults[link.index] || link.output >= mResults[link.index]->outputs.size()))
            continue;
        if (link.from == Link::From::state && !mStates[link.index].points) continue;
        std::string name;
        if (link.from == Link::From::node && mGraph.nodes[link.index].named) name = app::nameOf(mGraph, link);
        if (link.from == Link::From::given) name = mGraph.given[link.index].name;
        mSession.mObjects.push_back(
            {.object = entry.object, .value = value(link, mNow), .name = name, .key = keyOf(link)});
    }
}

/// Returns the stacks after a failure. The outputs of nodes that were not evaluated are missing, and the objects that
/// these nodes would have taken remain.
std::vector<Entry> Evaluator::leftOnFailure() const {
    std::vector<Entry> left = mGraph.left;
    for (size_t k = mGraph.frames; k-- > 0;) {
        if (mResults[k]) continue;
        std::erase_if(left,
                      [&](const Entry& entry) { return entry.link.from == Link::From::node && entry.link.index == k; });
        left.insert(left.end(), mGraph.nodes[k].consumed.begin(), mGraph.nodes[k].consumed.end());
    }
    for (Entry& entry : left) // before the first frame, points are in their initial state
        if (entry.link.from == Link::From::state && !mStates[entry.link.index].points)
            entry.link = mGraph.states[entry.link.index].initial.value_or(entry.link);
    std::sort(left.begin(), left.end(), [](const Entry& a, const Entry& b) { return a.made < b.made; });
    return left;
}

/// Says, for -verbose, the share of the time of each node that took at least a thousandth of it.
void Evaluator::sayShares() const {
    double total = 0;
    for (const Timing& one : mTimings) total += one.seconds;
    for (size_t k = 0; k < mTimings.size(); ++k)
        if (mTimings[k].entry && mTimings[k].seconds >= 1e-3 * total)
            mSession.console.detail(fmt::format("{:>9.3f} s {:5.1f} %  -{}", mTimings[k].seconds,
                                                100 * mTimings[k].seconds / total, mGraph.nodes[k].action().name));
}

void Evaluator::run() {
    const auto finish = [&](const std::vector<Entry>& left) {
        if (!mSession.mKeeps) return;
        collect(left);
        mSession.mKnown.clear();
        for (const ResultPointer& result : mResults)
            if (result && !(result->key == Digest{}) && !dependsOnOtherFrames(*result))
                mSession.mKnown.emplace(result->key, result);
    };
    try {
        if (mGraph.frameRange)
            inContextOf("-frames", [&] {
                mSession.location = mGraph.frameLocation;
                mPlan = framePlanOf(mGraph.frameRange->at({}));
            });
        mNow = beforeFrames(mFirstPart);
        prepare();
        for (const auto& advice : adviceOn(mGraph, !mSession.mKeeps)) mSession.console.warn(advice);
        runParts();
    } catch (...) {
        finish(leftOnFailure());
        throw;
    }
    finish(mGraph.left);
    sayShares();
}

} // namespace curlew::app
