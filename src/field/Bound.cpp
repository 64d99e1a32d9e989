#include "curlew/field/Bound.h"

#include "BoundModel.h"
#include "curlew/base/Error.h"
#include "curlew/base/Require.h"
#include "curlew/field/Algebra.h"
#include "curlew/field/Dimensions.h"

#include <fmt/format.h>

namespace curlew {

using namespace detail;

template <int N>
ScalarFieldN<N> bounded(const ScalarFieldN<N>& noise, const WallN<N>& wall, const BoundOptions& options) {
    if (!(wall.width > 0) || !std::isfinite(wall.width))
        throw ValueError(fmt::format("width {} must be positive and finite", wall.width));
    if (std::isnan(options.amplitude) || std::isinf(options.amplitude)) throw ValueError("amplitude must be finite");
    const Range range = noise.range();
    const double size = (range.upper - range.lower) / 2;
    const bool limited = std::isfinite(size) && size > 0;
    if (options.separate && !limited)
        throw ValueError(
            "separate=1 needs a noise whose range is known; use separate=0, or a noise instead of this field");
    const double amplitude = options.amplitude < 0 ? wall.width : options.amplitude;
    const double factor = amplitude > 0 && limited ? amplitude / size : 1;
    const double middle = limited ? (range.lower + range.upper) / 2 : 0;
    // Any shift above the noise's size separates; an eighth more keeps the values clear of zero.
    const double shift = options.separate ? 1.125 * factor * size : 0;
    return ScalarFieldN<N>(
        Bounded<N>{wall.sdf.distance, noise, wall.side, wall.width, wall.sdf.steepness, middle, factor, shift});
}

template <int N>
ScalarFieldN<N> layerFade(const WallN<N>& wall) {
    requirePositive(wall.width, "width");
    return ScalarFieldN<N>(LayerFade<N>{wall.sdf.distance, wall.width});
}

template <int N>
ScalarFieldN<N> productBounded(const ScalarFieldN<N>& noise, const SdfN<N>& sdf, double range) {
    return noise * clipped(sdf.distance, range);
}

#define CURLEW_INSTANTIATE(N)                                                                       \
    template ScalarFieldN<N> bounded(const ScalarFieldN<N>&, const WallN<N>&, const BoundOptions&); \
    template ScalarFieldN<N> layerFade(const WallN<N>&);                                            \
    template ScalarFieldN<N> productBounded(const ScalarFieldN<N>&, const SdfN<N>&, double);
CURLEW_FOR_DIMENSIONS(CURLEW_INSTANTIATE)
#undef CURLEW_INSTANTIATE

} // namespace curlew
