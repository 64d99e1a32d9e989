// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/base/Monitor.h"
#include "curlew/track/Curves.h"
#include "curlew/track/Points.h"

namespace curlew {

/// Distance between two sets of points or curves, world units.
struct Distance {
    size_t pairs = 0; ///< Pairs of points with equal ids; or vertices of the first set with a curve in the second.
    double mean = 0, rms = 0, max = 0;
    size_t unmatched = 0; ///< Points or curves of either set whose id the other set lacks.
};

/// Returns the distances between points of equal id. Throws ValueError if no id is common or an id occurs twice in a
/// set.
Distance distanceBetween(const Points& a, const Points& b, const Monitor& monitor = {});

/// Returns the distances from each vertex of the curves in `a` to the nearest point of the curve in `b` with the same
/// id, wherever along that curve it is. This compares the curves as lines, not as motions. Throws like the other
/// overload. The time is proportional to the product of their vertex counts.
Distance distanceBetween(const Curves& a, const Curves& b, const Monitor& monitor = {});

} // namespace curlew
