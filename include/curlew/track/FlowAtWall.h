// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/base/Monitor.h"
#include "curlew/flow/Flow.h"

#include <vector>

namespace curlew {

/// The behaviour of a flow, or of one term of it, at the domain's wall.
struct AtWall {
    double speed = 0; ///< Root mean square speed over the domain, world units per second.
    double flux = 0;  ///< Maximum speed across the wall, relative to `speed`.
    /// Whether the streamlines stay on their side of the wall, up to rounding.
    bool tangent() const { return flux <= 1e-6; }
};

/// Measures the speed of a flow, and its flux through the wall at up to `samples` points of it. These are the same at
/// every call; Newton's method on the distance finds them. Without a wall, both are 0. Throws ValueError if the domain
/// is empty or infinite.
AtWall flowAtWall(const Flow& flow, size_t samples = 2000, const Monitor& monitor = {});

struct SumAtWall {
    AtWall whole;              ///< The whole sum; flux through the wall may cancel between its terms.
    std::vector<AtWall> terms; ///< Each term by itself; empty without a wall, or if there is only one term.
};

/// Measures a flow, and each of its terms by itself, as flowAtWall() does.
SumAtWall sumAtWall(const Flow& flow, size_t samples = 2000, const Monitor& monitor = {});

} // namespace curlew
