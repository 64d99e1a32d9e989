// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/track/Advect.h"
#include "curlew/track/Curves.h"

namespace curlew {

struct Pathlines {
    Curves curves;       ///< One per particle: where it begins, and where it is after each step.
    AdvectResult result; ///< Of all steps together.
};

/// Moves particles as advect() does, and records their pathlines as open curves by time, which is 0 where they begin.
/// They have a vertex after each of `steps` equal parts of the time (0: kMoments); with an accuracy, a part takes as
/// many steps as it needs. In a flow that changes, potentials are those of the flow at each moment. Throws as advect(),
/// and ResourceError if the pathlines do not fit into memory.
Pathlines advectWithPathlines(const FlowInTime& flow, Points& particles, double begin, const AdvectOptions& options,
                              const Monitor& monitor = {});

} // namespace curlew
