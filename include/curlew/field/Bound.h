// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/field/NoiseScale.h"
#include "curlew/field/Shapes.h"

namespace curlew {

/// The side of a wall on which a flow is allowed.
enum class Side {
    inside,  ///< Inside the shape, which contains the flow.
    outside, ///< Outside the shape, which is an obstacle.
    both,    ///< On both sides, never through the wall.
};

/// A wall (a solid boundary): the zero set of a signed distance, and the thickness of the layer in which a flow turns
/// parallel to it.
template <int N>
struct WallN {
    SdfN<N> sdf;
    Side side = Side::inside;
    double width = 0.1; ///< World units; layerWidth() chooses one for a noise.
};
using Wall = WallN<3>;

/// The default width of a layer in wavelengths of the noise. In a thinner layer the flow is faster than beyond it,
/// because the stream of a swirl passes through a smaller gap (docs/math.md).
inline constexpr double kLayerInWavelengths = 0.3;

/// A layer width that suits a noise and an object.
struct LayerWidth {
    double width = 0; ///< World units.
    NoiseScale noise = {};
    /// Whether the object is too small for kLayerInWavelengths. The width is then a quarter of an edge of its box: of
    /// the longest edge for Side::outside, else of the shortest. The swirls of the noise have no room there; raise its
    /// frequency.
    bool limited = false;
};

/// Returns a width of kLayerInWavelengths, or less if the object's bounds require it (infinite bounds do not). Throws
/// ValueError if the noise is constant.
template <int N>
LayerWidth layerWidth(const ScalarFieldN<N>& noise, const BoxN<N>& bounds, Side side = Side::inside);

struct BoundOptions {
    /// Shifts the noise away from zero, so the sign of the result is the sign of the distance, and no value of the
    /// result occurs on both sides of the wall. Requires a noise with a finite range(). Particles do not cross the wall
    /// without it either (track/Advect.h). It makes the flow faster in the layer than beyond it.
    bool separate = false;
    /// Centres the noise and scales it to at most this size in world units before it is blended. This requires a noise
    /// with a finite range(). 0 keeps the size. A negative value scales the noise to an rms gradient of 1, like that of
    /// the distance: the flow is then as fast in the layer as beyond it.
    double amplitude = -1;
    /// How much the gradient of the result at the wall follows the noise: its length varies from 1 - variation to 1 +
    /// variation, 0 <= variation < 1. Without it, a flow in the plane has the same speed everywhere along a wall. The
    /// wall remains the zero set. Requires a noise with a finite range().
    double variation = 0;
    /// The rms gradient of the noise in the bounds of the wall if it is known (layerWidth() returns it), so that it is
    /// not measured again; 0 if unknown.
    double slope = 0;
};

/// ICN Eq. 13 with a distance that levels off: g = D + alpha noise, where alpha is a C² fade of depth / width and D is
/// the integral of 1 - alpha over the distance. So grad g = (1 - alpha) grad d + alpha grad noise + noise grad alpha.
/// At the wall, g is the distance. Beyond the layer, it is the noise plus a constant, half of the width. (Eq. 13 as
/// printed has (1 - alpha) d instead of D. Its slope changes sign in the layer, so the flow would be slow there and
/// faster beyond.) The gradient has all terms, so divergence-free vector noise (DFVN) made of g is divergence-free. On
/// the side of the wall where no flow is allowed, g is the distance itself. The term of `variation` is added on both
/// sides of the wall. g is C² where the noise and the distance are.
///
/// Throws ValueError if the width is not positive, if `variation` is not in [0, 1), if the noise is constant, or if an
/// option requires a noise with a finite range and this one has none.
template <int N>
ScalarFieldN<N> bounded(const ScalarFieldN<N>& noise, const WallN<N>& wall, const BoundOptions& options = {});

/// The quintic fade of depth / width: 0 at the wall, 1 beyond its layer on either side.
template <int N>
ScalarFieldN<N> layerFade(const WallN<N>& wall);

/// The ramp of Bridson et al. 2007 for vector potentials: an odd quintic of distance / width. It is C², zero at the
/// wall, 1 beyond the layer on the inside and -1 on the outside; Side::outside swaps the signs. The curl of ψ times the
/// ramp is tangent to the wall for any ψ.
template <int N>
ScalarFieldN<N> layerRamp(const WallN<N>& wall);

/// DeWolf's product (Eq. 3): noise · δ, where δ is the distance clipped at `range` world units. It is zero at the wall,
/// so a flow of it does not cross the wall. It is also zero where the noise is zero, so an iso-value other than zero
/// does not tell the sides apart, and near the wall the flow is not only turned parallel to it but also slow. Throws
/// ValueError if `range` is not positive.
template <int N>
ScalarFieldN<N> productBounded(const ScalarFieldN<N>& noise, const SdfN<N>& sdf, double range);

} // namespace curlew
