// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/track/Advect.h"
#include "curlew/track/Curves.h"

namespace curlew {

struct Pathlines {
    Curves curves;       ///< One per particle: its start, and its position after each step.
    AdvectResult result; ///< Totals over all steps.
};

/// Moves particles like advect() and records their pathlines as open curves by time, which is 0 at their start. A
/// pathline has a vertex after each of `steps` equal parts of the time (0: kMoments). With an accuracy, a part takes as
/// many steps as it needs. In a time-dependent flow, potentials are those of the flow at each vertex's time. Throws
/// like advect(), and ResourceError if the pathlines do not fit into memory.
Pathlines advectWithPathlines(const FlowInTime& flow, Points& particles, double begin, const AdvectOptions& options,
                              const Monitor& monitor = {});

} // namespace curlew
