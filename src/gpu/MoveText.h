// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/gpu/GpuFlow.h"

#include <string>

namespace curlew {

/// The words of a point's state in the program that moves points: its position, its track, and these.
enum class MoveWord : size_t {
    left,  ///< Remaining time, seconds, or remaining steps.
    next,  ///< Length of the next step: seconds, or a fraction of an equal step.
    rest,  ///< Of an equal step: the fraction that remains.
    unit,  ///< Of an equal step: seconds, negative backward.
    error, ///< Sum of estimated errors, world units.
    flags, ///< kMoveMissed, kMoveStarts, and the number of times that the next step has been halved.
};
constexpr size_t kMoveWords = 6;
constexpr uint32_t kMoveHalvings = 0xff;  ///< The bits of that number.
constexpr uint32_t kMoveMissed = 1u << 8; ///< A step was not taken.
constexpr uint32_t kMoveStarts = 1u << 9; ///< The point has no track yet.

/// Counts over all points, in this order: the members of GpuMoved, and the points that still have time left.
constexpr size_t kMoveCounts = 6;

/// The push constants of the program.
struct MoveRequest {
    uint32_t count;  ///< Points.
    uint32_t budget; ///< Evaluations of the flow per point, after which it stops at the end of a step.
    float accuracy, rmsSpeed, maxStep;
    float shortest;        ///< No step is made shorter than this for its accuracy: seconds.
    float guardedShortest; ///< Nor than this if it was not accepted: seconds, or a fraction of an equal step.
    float usual;           ///< Step length after one that was not taken, seconds.
};

/// Returns the definitions before the text of the flow.
template <int N>
std::string moveDefinitions(const GpuMoveOptions& options, bool tracks, bool wall, const FlowRmsN<N>& rms);
/// Returns the text after that of the flow.
std::string moveText(const GpuMoveOptions& options);

} // namespace curlew
