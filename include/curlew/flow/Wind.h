// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/field/Bound.h"
#include "curlew/flow/Flow.h"

#include <optional>

namespace curlew {

struct WindOptions {
    Vec3d direction{{1, 0, 0}}; ///< Of the wind far away; any length but 0.
    double speed = 1;           ///< Of the wind far away, world units per second.
    /// The root mean square speed of what a noise adds far from the wall, relative to `speed`.
    double gusts = 0.3;
    /// In which direction the wind gives way, to both sides; what it has along the wind does not count. Nothing: the
    /// one in which the shape is narrowest.
    std::optional<Vec3d> across = {};
    double padding = -1; ///< DomainN::of().
};

/// A wind that goes around the wall, as one term ∇f × ∇g, so it has tracks:
/// f = speed a·x + noise, g = r(d) b·(x - c), with a × b along the wind, c the centre of the shape, and r a ramp that
/// rises from 0 at the wall to 1 at its width (clipped(), field/Algebra.h). At the wall ∇g is parallel to ∇d, so the
/// flow is tangent there; beyond the width it is the wind, with the gusts of the noise. The stream that the shape
/// displaces goes through the layer: with R the half of the extent of the shape along b, its mean speed there is
/// 1 + R / width times that of the wind. Since r has a slope at the wall, the flow slips along it.
///
/// b·(x - c) = 0 parts the stream. Where it meets the wall the flow stands still. All parts of a wall have g = 0:
/// nothing streams between two bodies that are one wall.
///
/// The domain's wall is narrower than the ramp, a quarter of it: steps near the wall are judged against that width
/// (track/Advect.h), and a body is thinner than the ramp is wide.
///
/// Side::inside makes a wind in a room: it goes along in the middle and comes back in the layer. Throws ValueError for
/// a direction of no length, `across` along it, a speed or width that is not positive, negative gusts, and a noise that
/// does not change across the wind.
Flow windFlow(const Wall& wall, const std::optional<ScalarField>& noise, const WindOptions& options = {});

/// The unit vector across the wind in which windFlow() gives way.
Vec3d windAcross(const Sdf& shape, const WindOptions& options);

/// The width that the ramp should have: half of the extent of the shape across the wind, so that the mean speed in the
/// layer is twice that of the wind. Throws ValueError for an unbounded shape.
double windWidth(const Sdf& shape, const WindOptions& options);

} // namespace curlew
