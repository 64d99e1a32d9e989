// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/app/registry/Action.h"

#include <string>
#include <vector>

namespace curlew::app {

/// The frame for which the nodes after -frames are evaluated. It shows the moment `time`. Its points have moved there
/// from `begin`, the moment of the frame before it, for `duration` seconds. In the starting frame nothing has moved
/// yet.
struct FrameClock {
    int frame = 1;
    double fps = 24;
    double begin = 0;    ///< Seconds since the starting frame: the time of the frame before this one.
    double duration = 0; ///< Seconds from frame to frame; 0 in the starting one.
    double time = 0;     ///< Seconds since the starting frame, which is where expressions have T.
    int substeps = 1;    ///< Steps in which points are moved through the frame.

    Moment moment() const { return {.frame = static_cast<double>(frame), .time = time, .fps = fps}; }
    /// That of a time between frames.
    Moment moment(double seconds) const {
        return {.frame = frame + (seconds - time) * fps, .time = seconds, .fps = fps};
    }
};

/// The frames of -frames: first, first + by, … up to last, or one part of several of them.
struct FramePlan {
    int first = 1, last = 1, by = 1;
    int start =
        1; ///< The frame in which the time is 0: the first one, or one before it that another process evaluates.
    double fps = 24;
    int substeps = 1;
    int part = 1, parts = 1; ///< This process evaluates the frames number part, part + parts, … of all.
    std::string checkpoint = {};

    /// The frames of this part. Throws ValueError if it has none.
    std::vector<int> frames() const;
    FrameClock clock(int frame) const;
    FrameClock firstClock() const { return clock(frames().front()); }
    FrameClock startClock() const { return clock(start); }
    /// The frame in whose interval (from the frame before it, exclusive, to itself) a time lies.
    FrameClock clockAt(double seconds) const;
};

/// Throws ValueError if the range is invalid, or `start` is not a frame of it as it would be if it were longer.
FramePlan framePlanOf(const Arguments& frames);

} // namespace curlew::app
