// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/field/NoiseScale.h"
#include "curlew/field/Shapes.h"

namespace curlew {

/// Where a wall lets the flow be.
enum class Side {
    inside,  ///< Contained in the shape.
    outside, ///< Around it, as an obstacle.
    both,    ///< On either side, never through.
};

/// A wall: the zero set of a signed distance, with the thickness of the layer in which a flow turns along it.
template <int N>
struct WallN {
    SdfN<N> sdf;
    Side side = Side::inside;
    double width = 0.1; ///< World units; layerWidth() chooses one for a noise.
};
using Wall = WallN<3>;

/// The width of a layer in wavelengths of the noise, if none is given. Thinner ones are faster than the flow beyond
/// them: the stream of a swirl has to pass through less (docs/math.md).
inline constexpr double kLayerInWavelengths = 0.3;

/// A width that suits a noise and an object.
struct LayerWidth {
    double width = 0; ///< World units.
    NoiseScale noise = {};
    /// kLayerInWavelengths would have been more than the object allows: a quarter of the shortest edge of its box for a
    /// flow inside, of the longest one around it. The noise has no room for its swirls; a higher frequency has.
    bool limited = false;
};

/// kLayerInWavelengths of the noise, as far as an object with these bounds allows (infinite ones allow everything).
/// Throws ValueError for a constant noise.
template <int N>
LayerWidth layerWidth(const ScalarFieldN<N>& noise, const BoxN<N>& bounds, Side side = Side::inside);

struct BoundOptions {
    /// Shift the noise away from zero so that the sign of the result is the sign of the distance: then no value of the
    /// result occurs on both sides of the wall. Needs a noise with a finite range(). No particle crosses the wall
    /// without it either (track/Advect.h); it makes the flow in the layer faster than beyond it.
    bool separate = false;
    /// The noise is centred and scaled to at most this size before it is blended, world units; that needs a noise with
    /// a finite range(). 0 leaves its size as it is; negative scales it to a root mean square slope of 1, that of the
    /// distance: then the flow is as fast in the layer as beyond it.
    double amplitude = -1;
    /// 0 … below 1: how much the slope at the wall follows the noise, from 1 - variation to 1 + variation. A flow in
    /// the plane has the same speed all along a wall without it. The wall stays the zero set. Needs a noise with a
    /// finite range().
    double variation = 0;
    /// The root mean square slope of the noise in the bounds of the wall, if it is known (layerWidth() has it), so that
    /// it is not measured again; 0: not known.
    double slope = 0;
};

/// ICN Eq. 13 with a distance that levels off: g = D + alpha noise, alpha a C² fade of depth / width and D the integral
/// of 1 - alpha over the distance, so grad g = (1 - alpha) grad d + alpha grad noise + noise grad alpha. g is the
/// distance at the wall, and the noise and a constant, half of the width, beyond the layer. (Eq. 13 as printed has
/// (1 - alpha) d for D, whose slope changes its sign in the layer: there the flow would be slow, and faster beyond.)
/// All terms of the gradient are there, so a DFVN of it is divergence-free. On the side of the wall where there is no
/// flow, g is the distance itself. C² where the noise and the distance are.
/// Throws ValueError for a width that is not positive, a variation that is not below 1, a constant noise, and options
/// that need a noise with a finite range for one without.
template <int N>
ScalarFieldN<N> bounded(const ScalarFieldN<N>& noise, const WallN<N>& wall, const BoundOptions& options = {});

/// The quintic fade of depth / width: 0 at the wall, 1 beyond its layer, on either side.
template <int N>
ScalarFieldN<N> layerFade(const WallN<N>& wall);

/// The ramp of Bridson et al. 2007 for vector potentials: an odd quintic of the distance over the width, C², zero at
/// the wall, 1 beyond the layer on the inside and -1 on the outside; for Side::outside the other way round. The curl
/// of ψ times the ramp is tangent to the wall, for any ψ.
template <int N>
ScalarFieldN<N> layerRamp(const WallN<N>& wall);

/// DeWolf's product (Eq. 3): noise · δ, δ the distance clipped at `range` world units. Zero at the wall, so a flow of
/// it does not cross it; but also zero where the noise is, so an iso-value other than zero does not tell the sides
/// apart, and the flow is slow near the wall, not only turned along it. Throws ValueError for a range that is not
/// positive.
template <int N>
ScalarFieldN<N> productBounded(const ScalarFieldN<N>& noise, const SdfN<N>& sdf, double range);

} // namespace curlew
