// SPDX-License-Identifier: Apache-2.0
#include "Evaluator.h"
#include "curlew/app/registry/InContext.h"

#include <algorithm>
#include <utility>

namespace curlew::app {

// Evaluation of points in parts, so that memory does not grow with their number.

/// Finds the part or parts to make, and the nodes that change from part to part.
void Evaluator::findParts() {
    const auto nameOf = [](const Part& part) {
        return fmt::format("part={}/{}", part.number == 0 ? "each" : std::to_string(part.number), part.count);
    };
    Part given;
    for (size_t k = 0; k < mGraph.nodes.size(); ++k) {
        const Node& node = mGraph.nodes[k];
        const Part part = node.action().part(node.arguments);
        if (part.count == 1) continue;
        enter(k);
        if (given.count > 1 && !(part == given))
            throw ValueError(fmt::format("{}: {}, but other points have {}; give both the same", contextOf(k),
                                         nameOf(part), nameOf(given)));
        given = part;
    }
    if (given.number > 0) {
        mFirstPart = given.number;
        return;
    }
    mParts = given.count;
    bool begun = false;
    for (size_t k = 0; k < mGraph.nodes.size(); ++k) {
        const Node& node = mGraph.nodes[k];
        const Action& action = node.action();
        const auto changes = [&](const Link& link) {
            return link.from == Link::From::state || (link.from == Link::From::node && mInParts[link.index]);
        };
        const auto any = [&](const auto& links) { return std::ranges::any_of(links, changes); };
        // An effect without inputs, such as -report, shows what the nodes before it have done.
        const bool shows = action.readsReport || (action.evaluation == Evaluation::effect && !action.setting &&
                                                  std::ranges::all_of(node.inputs, &std::vector<Link>::empty));
        mInParts[k] = action.part(node.arguments).count > 1 || node.arguments.usesPart() || (begun && shows) ||
                      std::ranges::any_of(node.inputs, any);
        begun = begun || mInParts[k];
    }
}

/// Returns the moment at which the nodes before -frames are evaluated.
Moment Evaluator::beforeFrames(int64_t part) const {
    Moment moment = mGraph.moment;
    moment.part = static_cast<double>(part);
    if (mPlan) moment.fps = mPlan->fps;
    return moment;
}

/// Returns the moment of a frame, in the current part.
Moment Evaluator::momentOf(const FrameClock& clock) const {
    Moment moment = clock.moment();
    moment.part = mNow.part;
    return moment;
}

/// Forgets what belongs to the part before.
void Evaluator::beginPart(int64_t part) {
    mNow = beforeFrames(part);
    mClock.reset();
    mRemembered.clear();
    std::ranges::fill(mStates, StateValue{});
    for (size_t k = 0; k < mGraph.nodes.size(); ++k) {
        if (mInParts[k] || mGraph.inFrames(k)) mResults[k].reset();
        if (mGraph.inFrames(k)) mMemories[k] = {};
        if (mInParts[k]) mMemories[k].figures = Json::object();
    }
}

void Evaluator::runParts() {
    double began = 0;
    for (int64_t part = 1; part <= mParts; ++part) {
        if (part > 1) beginPart(part);
        bool said = mParts == 1;
        const auto say = [&] {
            if (std::exchange(said, true)) return;
            if (part == 1) began = mSession.seconds();
            const double left = (mSession.seconds() - began) / static_cast<double>(std::max<int64_t>(part - 1, 1)) *
                                static_cast<double>(mParts - part + 1);
            mSession.console.info(fmt::format("part {} of {}{}", part, mParts,
                                              part > 1 ? fmt::format(", about {:.0f} s left", left) : ""));
        };
        for (size_t k = 0; k < mGraph.frames; ++k) {
            if (mInParts[k]) say();
            evaluate(k, mParts > 1 ? fmt::format("part {}: ", part) : "");
        }
        if (!mGraph.frameRange) continue;
        say();
        runFrames();
    }
}

} // namespace curlew::app
