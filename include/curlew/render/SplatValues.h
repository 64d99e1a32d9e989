// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/math/Range.h"
#include "curlew/render/Camera.h"
#include "curlew/track/Curves.h"
#include "curlew/track/Points.h"

#include <array>
#include <string_view>
#include <vector>

namespace curlew {

/// The number by which points, or the vertices of curves, are coloured.
enum class SplatValue {
    speed,  ///< World units per second.
    height, ///< Upwards in the picture from the eye, world units.
    depth,  ///< From the eye into the picture, world units.
    id,     ///< A random number from 0 to 1 for each id.
    index,  ///< The place in the order of points or curves: 0 for the first, 1 for the last.
    age     ///< Seconds since birth; of curves Curves::along.
};
inline constexpr std::array<std::string_view, 6> kSplatValueNames{"speed", "height", "depth", "id", "index", "age"};

/// One value for each point. Throws ValueError if the points have no velocity, or no age, and that is asked for.
std::vector<float> splatValues(const Points& points, SplatValue by, const Camera& camera);
/// One value for each vertex.
std::vector<float> splatValues(const Curves& curves, SplatValue by, const Camera& camera);

/// The values at the ends of the colours: 0 and 1 for `id` and `index`; else the percentiles 2 and 98 of the finite
/// values, or a unit around them if they are equal, or 0 and 1 if there are none.
Range splatRange(std::vector<float> values, SplatValue by);

} // namespace curlew
