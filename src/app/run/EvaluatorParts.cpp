// SPDX-License-Identifier: Apache-2.0
#include "Evaluator.h"
#include "curlew/app/registry/InContext.h"

#include <algorithm>
#include <utility>

namespace curlew::app {

// Evaluation of points in parts, so that memory does not grow with their number.

/// Finds the number of parts and the nodes that change from part to part.
void Evaluator::findParts() {
    for (size_t k = 0; k < mGraph.nodes.size(); ++k) {
        const Node& node = mGraph.nodes[k];
        const int64_t parts = node.action().parts(node.arguments);
        if (parts == 1) continue;
        enter(k);
        if (mParts > 1 && parts != mParts)
            throw ValueError(
                fmt::format("{}: {} parts, but other points are made in {} parts; give both the same number",
                            contextOf(k), parts, mParts));
        mParts = parts;
    }
    if (mParts == 1) return;
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
        mInParts[k] = action.parts(node.arguments) > 1 || node.arguments.usesPart() || (begun && shows) ||
                      std::ranges::any_of(node.inputs, any);
        begun = begun || mInParts[k];
    }
}

/// Forgets what belongs to the part before.
void Evaluator::beginPart(int64_t part) {
    mNow = {.part = static_cast<double>(part)};
    mClock.reset();
    mRemembered.clear();
    std::ranges::fill(mStates, StateValue{});
    for (size_t k = 0; k < mGraph.nodes.size(); ++k) {
        if (mInParts[k] || mGraph.inFrames(k)) mResults[k].reset();
        if (mGraph.inFrames(k)) mMemories[k] = {};
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
