// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/base/Monitor.h"
#include "curlew/track/Curves.h"
#include "curlew/track/Points.h"

namespace curlew {

/// How far two sets of points or curves are apart, world units.
struct Distance {
    size_t pairs = 0; ///< Points of the same id; or vertices of the first set, whose curve the second set has too.
    double mean = 0, rms = 0, max = 0;
    size_t unmatched = 0; ///< Points, or curves, of either set whose id the other has not.
};

/// Between the points that have the same id in both. Throws ValueError where there are none, or one occurs twice.
Distance distanceBetween(const Points& a, const Points& b, const Monitor& monitor = {});

/// From each vertex of the curves in `a` to the nearest point on that curve of `b` which has the same id, wherever
/// along it that is: how far they are apart as lines, not as motions. Throws as the other; the time goes with the
/// product of their vertices.
Distance distanceBetween(const Curves& a, const Curves& b, const Monitor& monitor = {});

} // namespace curlew
