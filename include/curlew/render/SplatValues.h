// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/math/Interval.h"
#include "curlew/render/Camera.h"
#include "curlew/track/Curves.h"
#include "curlew/track/Points.h"

#include <array>
#include <string_view>
#include <vector>

namespace curlew {

/// The quantity that colours points or the vertices of curves.
enum class SplatValue {
    speed,  ///< World units per second.
    height, ///< Height above the eye along the picture's up direction, world units.
    depth,  ///< Distance from the eye along the view direction, world units.
    id,     ///< A random number from 0 to 1 per id.
    index,  ///< Position in the order of points or curves: 0 for the first, 1 for the last.
    age     ///< Seconds since birth; for curves, Curves::along.
};
inline constexpr std::array<std::string_view, 6> kSplatValueNames{"speed", "height", "depth", "id", "index", "age"};

/// Returns one value per point. Throws ValueError if velocity or age is needed and the points have none.
std::vector<float> splatValues(const Points& points, SplatValue by, const Camera& camera);
/// Returns one value per vertex.
std::vector<float> splatValues(const Curves& curves, SplatValue by, const Camera& camera);

/// Returns the values at the ends of the colour scale: 0 and 1 for `id` and `index`; otherwise the percentiles 2 and 98
/// of the finite values (of many, only of kEnoughSplats), a unit range around them if they are equal
/// but for rounding errors, or 0 and 1 if there are none.
Interval splatRange(const std::vector<float>& values, SplatValue by);

} // namespace curlew
