#pragma once

#include "curlew/app/Action.h"
#include "curlew/app/Expression.h"

#include <string>
#include <vector>

namespace curlew::app {

/// The frame for which the actions after -frames are run. A frame shows the moment `time`. Its points have come there
/// since the frame before it: they have moved from `begin` on for `duration`. The first frame shows how they start, so
/// there is no motion in it.
struct FrameClock {
    int frame = 1;
    double fps = 24;
    double begin = 0;    ///< Seconds since the first frame: the time of the frame before this one.
    double duration = 0; ///< Seconds: the step from frame to frame; 0 in the first one.
    double time = 0;     ///< Seconds since the first frame, which is where expressions have T.
    int substeps = 1;    ///< In which points are to be moved through the frame.

    Moment moment() const { return {.frame = static_cast<double>(frame), .time = time, .fps = fps}; }
    /// That of a time between frames.
    Moment moment(double seconds) const {
        return {.frame = frame + (seconds - time) * fps, .time = seconds, .fps = fps};
    }
};

/// What -frames asks for: frames first, first + by, … up to last, or every so many of them.
struct FramePlan {
    int first = 1, last = 1, by = 1;
    double fps = 24;
    int substeps = 1;
    int part = 1, parts = 1; ///< This process has the frames number part, part + parts, … of all.
    std::string checkpoint = {};

    /// Those of this part.
    std::vector<int> frames() const;
    FrameClock clock(int frame) const;
};

/// Throws ValueError for a range that is none.
FramePlan framePlanOf(const Arguments& frames);

} // namespace curlew::app
