// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/field/Bound.h"
#include "curlew/flow/Flow.h"

#include <optional>

namespace curlew {

struct WindOptions {
    Vec3d direction{{1, 0, 0}}; ///< Of the wind far away; any length except 0.
    double speed = 1;           ///< Of the wind far away, world units per second.
    /// The rms speed that the noise adds far from the wall, relative to `speed`.
    double gusts = 0.3;
    /// The direction in which the wind is deflected, to both sides. Its component along the wind is ignored. If
    /// nullopt: the direction in which the shape is narrowest.
    std::optional<Vec3d> across = {};
    double padding = -1; ///< As in DomainN::of().
};

/// A wind that flows around a wall, as one term ∇f × ∇g, so it has tracks:
/// f = speed a·x + noise, g = r(d) b·(x - c), with a × b along the wind and c the centre of the shape. The ramp r rises
/// from 0 at the wall to 1 at the wall's width (clipped(), field/Algebra.h). At the wall ∇g is parallel to ∇d, so the
/// flow is tangent to the wall. Beyond the width it is the wind with the gusts of the noise. The stream that the shape
/// displaces passes through the layer: its mean speed there is 1 + R / width times that of the wind, where R is half
/// the extent of the shape along b. The slope of r at the wall is not zero, so the flow slips along the wall.
///
/// The plane b·(x - c) = 0 divides the stream. Where it meets the wall, the flow stagnates. On all parts of a wall g is
/// 0, so nothing flows between two bodies that belong to one wall.
///
/// The domain's wall has a quarter of the ramp's width. Steps near the wall are judged against that width
/// (track/Advect.h), and a body is thinner than the ramp is wide.
///
/// Side::inside makes a wind in a room: it blows along the middle and returns in the layer. Throws ValueError if the
/// direction is zero, if `across` is parallel to it, if the speed or the width is not positive, if `gusts` is negative,
/// or if the noise does not change across the wind.
Flow windFlow(const Wall& wall, const std::optional<ScalarField>& noise, const WindOptions& options = {});

/// Returns the unit vector along which windFlow() deflects the wind, perpendicular to the wind.
Vec3d windAcross(const Sdf& shape, const WindOptions& options);

/// Returns a suitable width of the ramp: half the extent of the shape across the wind, so the mean speed in the layer
/// is twice that of the wind. Throws ValueError if the shape is unbounded.
double windWidth(const Sdf& shape, const WindOptions& options);

} // namespace curlew
