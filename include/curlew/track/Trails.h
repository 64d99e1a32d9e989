#pragma once

#include "curlew/track/Advect.h"
#include "curlew/track/Curves.h"

namespace curlew {

struct Trails {
    Curves curves;       ///< Of each particle its way: where it begins, and where it is after each step.
    AdvectResult result; ///< Sums over the steps; what is said of the end is that of the last one.
};

/// Moves particles as advect() does, and keeps their ways as open curves by time, which is 0 where they begin. In a
/// flow that changes, these are path lines, and potentials are those of the flow at each moment. Throws as advect(),
/// and ResourceError where the ways do not fit the memory.
Trails advectWithTrails(const FlowInTime& flow, Particles& particles, double begin, const AdvectOptions& options,
                        const Monitor& monitor = {});

} // namespace curlew
