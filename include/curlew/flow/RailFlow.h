// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/field/Rail.h"
#include "curlew/flow/Flow.h"

namespace curlew {

enum class RailProfile {
    plug, ///< The same speed everywhere in the tubes, which must not touch. The tubes are the wall of the flow.
    smooth, ///< speed (1 - ρ²/radius²)³ at the distance ρ from a rail, zero beyond (C²). Where tubes meet, flows add.
};
inline constexpr std::array<std::string_view, 2> kRailProfileNames{"plug", "smooth"};

struct RailFlowOptions {
    double radius = 0.1; ///< Of the tubes around the rails, world units.
    double speed = 1;    ///< On the rails, world units per second. Negative: against their direction.
    RailProfile profile = RailProfile::plug;
};

/// Returns a flow along rails. Its streamlines keep their distance from their rail, so no particle leaves a tube, for
/// any step: u and v (Rail.h) are constant along them, and reprojection moves every particle back onto its u and v.
///
/// With `plug`, and with a single rail, the flow has one term and tracks: its potentials are u and v, or functions of
/// them. Several rails with `smooth` make a sum of one term each, which is divergence-free but has no tracks; followed
/// term by term (Splitting), particles stay in the union of the tubes. The domain is the tubes, in the box around the
/// rails. Throws ValueError if there are no rails, if an option is invalid, if a tube is wider than a bend of its rail
/// or touches itself, or, with `plug`, if it touches another.
Flow railFlow(const std::vector<RailPointer>& rails, const RailFlowOptions& options);

} // namespace curlew
