// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/app/registry/Action.h"

#include <string>
#include <vector>

namespace curlew::app {

/// The frame for which the nodes after -frames are evaluated. The frame shows the scene at `time`. Its points were
/// advected from `begin`, the time of the previous frame, over `duration` seconds. In the starting frame, no point has
/// moved yet.
struct FrameClock {
    int frame = 1;
    double fps = 24;
    double begin = 0;    ///< Time of the previous frame, in seconds since the starting frame.
    double duration = 0; ///< Seconds since the previous frame; 0 in the starting frame.
    double time = 0;     ///< Time of this frame, in seconds since the starting frame: T in expressions.
    int substeps = 1;    ///< Number of steps that advect the points through the frame.

    Moment moment() const { return {.frame = static_cast<double>(frame), .time = time, .fps = fps}; }
    /// Returns the moment at a time between frames.
    Moment moment(double seconds) const {
        return {.frame = frame + (seconds - time) * fps, .time = seconds, .fps = fps};
    }
};

/// The frame range of -frames: first, first + by, … up to last; or one of several parts of that range.
struct FramePlan {
    int first = 1, last = 1, by = 1;
    int start = 1; ///< The frame at which the time is 0: the first frame, or one before this process's range.
    double fps = 24;
    int substeps = 1;
    int part = 1, parts = 1; ///< This process evaluates the frames numbered part, part + parts, … in the range.
    std::string checkpoint = {};

    /// Returns the frames of this part. Throws ValueError if the part has none.
    std::vector<int> frames() const;
    FrameClock clock(int frame) const;
    FrameClock firstClock() const { return clock(frames().front()); }
    FrameClock startClock() const { return clock(start); }
    /// Returns the frame whose interval contains a time. The interval begins at the previous frame (exclusive) and ends
    /// at the frame itself. Times before the range give the starting frame. Times after it give the frame that would
    /// follow the last one: it shows how objects move in the starting frame if that is the last one, too.
    FrameClock clockAt(double seconds) const;
};

/// Reads the options of -frames. Throws ValueError if the range is invalid, if `start` comes after the first frame, or
/// if the step `by` does not lead from `start` to the first frame.
FramePlan framePlanOf(const Arguments& frames);

} // namespace curlew::app
