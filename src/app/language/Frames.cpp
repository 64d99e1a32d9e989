// SPDX-License-Identifier: Apache-2.0
#include "curlew/app/language/Frames.h"

#include "curlew/app/registry/Part.h"
#include "curlew/app/registry/Text.h"
#include "curlew/base/Error.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace curlew::app {

namespace {

/// Sets first, last and by from "1-240", "1-240x2" or "7".
void setRange(FramePlan& plan, const std::string& text) {
    const auto wrong = [&](const char* what) {
        return ValueError(
            fmt::format("'{}' {}; write FIRST-LAST, as in 1-240, or 1-240x2 for every other frame, with "
                        "whole numbers from 0 to {}",
                        text, what, kMostWhole));
    };
    const size_t times = text.find('x');
    const auto ends = split(std::string_view(text).substr(0, times), '-');
    const auto first = wholeNumber(ends.front()), last = wholeNumber(ends.back());
    const auto by = times == std::string::npos ? 1 : wholeNumber(std::string_view(text).substr(times + 1));
    if (ends.size() > 2 || !first || !last || !by) throw wrong("is not a range of frames");
    if (*by == 0) throw wrong("has a step of 0");
    if (*last < *first) throw wrong("runs backward");
    plan.first = *first;
    plan.last = *last;
    plan.by = *by;
}

void setPart(FramePlan& plan, const std::string& text) {
    const Part part = partOf(text);
    if (part.number == 0)
        throw ValueError(fmt::format("part={} of the frames would be all of them; give one part, as in 3/8", text));
    plan.part = static_cast<int>(part.number);
    plan.parts = static_cast<int>(part.count);
}

} // namespace

std::vector<int> FramePlan::frames() const {
    std::vector<int> frames;
    const int count = (last - first) / by + 1;
    for (int k = part - 1; k < count; k += parts) frames.push_back(first + k * by);
    if (frames.empty())
        throw ValueError(fmt::format("there are fewer frames than parts, so part={}/{} has no frames", part, parts));
    return frames;
}

FrameClock FramePlan::clockAt(double seconds) const {
    constexpr double kRounding = 1e-9;
    const double steps = std::ceil(seconds * fps / by - kRounding);
    return clock(start + by * std::clamp(static_cast<int>(steps), 0, (last - start) / by + 1));
}

FrameClock FramePlan::clock(int frame) const {
    const auto seconds = [&](int f) { return (f - start) / fps; };
    return {.frame = frame,
            .fps = fps,
            .begin = frame == start ? 0 : seconds(frame - by),
            .duration = frame == start ? 0 : by / fps,
            .time = seconds(frame),
            .substeps = substeps};
}

FramePlan framePlanOf(const Arguments& frames) {
    FramePlan plan{.fps = frames.real("fps"),
                   .substeps = static_cast<int>(frames.integer("substeps")),
                   .checkpoint = frames.text("checkpoint")};
    if (frames.changes()) throw ValueError("F, FF and T have no value in the range and the options of the frames");
    if (frames.given("checkpoint") && plan.checkpoint.empty())
        throw ValueError("checkpoint= is empty; give the name of a file");
    setRange(plan, frames.words().front());
    if (frames.given("by")) {
        if (plan.by != 1) throw ValueError("the step between frames is given twice: in the range and as by=");
        plan.by = static_cast<int>(frames.integer("by"));
    }
    plan.start = frames.given("start") ? static_cast<int>(frames.integer("start")) : plan.first;
    if (plan.start > plan.first)
        throw ValueError(
            fmt::format("start={} is after the first frame, {}; it must be at or before it, since it is the frame at "
                        "which the time is 0",
                        plan.start, plan.first));
    if ((plan.first - plan.start) % plan.by != 0)
        throw ValueError(
            fmt::format("a step of {} frames from start={} does not reach the first frame, {}; begin with {}", plan.by,
                        plan.start, plan.first, plan.first + plan.by - (plan.first - plan.start) % plan.by));
    if (frames.given("part")) setPart(plan, frames.text("part"));
    return plan;
}

} // namespace curlew::app
