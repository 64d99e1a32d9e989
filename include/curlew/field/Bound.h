#pragma once

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
    double width = 0.1; ///< World units.
};
using Wall = WallN<3>;

struct BoundOptions {
    /// Shift the noise away from zero so that the sign of the result is the sign of the distance: then no value of the
    /// result occurs on both sides of the wall, and a reprojected particle cannot converge to the wrong side.
    /// Needs a noise with a finite range().
    bool separate = true;
    /// The noise is centred and scaled to at most this size before it is blended, world units. A size near the width
    /// makes the flow as fast in the layer as beyond it. 0 leaves its size as it is; negative means the wall's width.
    double amplitude = -1;
};

/// ICN Eq. 13: g = (1 - alpha) d + alpha noise, alpha the quintic fade of depth / width: the distance at the wall, the
/// noise beyond the layer. Its gradient has all three terms, (1 - alpha) grad d + alpha grad noise + (noise - d) grad
/// alpha, so a DFVN of it is divergence-free. On the side of the wall where there is no flow, g is the distance itself.
/// Throws ValueError for a width that is not positive, and for `separate` with an unbounded noise.
template <int N>
ScalarFieldN<N> bounded(const ScalarFieldN<N>& noise, const WallN<N>& wall, const BoundOptions& options = {});

/// The alpha of Eq. 13 by itself: 0 at the wall, 1 beyond its layer, on either side.
template <int N>
ScalarFieldN<N> layerFade(const WallN<N>& wall);

/// DeWolf's product (Eq. 3): noise · δ, δ the distance clipped at `range` world units. Zero at the wall, so a flow of
/// it does not cross it; but also zero where the noise is, so an iso-value other than zero does not tell the sides
/// apart, and the flow is slow near the wall, not only turned along it. Throws ValueError for a range that is not
/// positive.
template <int N>
ScalarFieldN<N> productBounded(const ScalarFieldN<N>& noise, const SdfN<N>& sdf, double range);

} // namespace curlew
