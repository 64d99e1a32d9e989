// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/math/Interval.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

namespace curlew {

/// How the fractional rank part * (size - 1) of a percentile is rounded to an index.
enum class PercentileRank {
    nearest,
    lower ///< Truncated.
};

/// Returns the value below which this part (0 to 1) of the values lies. It is one of the values, not interpolated.
/// Reorders `values`, which must not be empty or contain NaN.
template <class T>
T percentile(std::vector<T>& values, double part, PercentileRank rank) {
    const double place = part * static_cast<double>(values.size() - 1);
    const auto nth = values.begin() + static_cast<std::ptrdiff_t>(rank == PercentileRank::nearest ? std::round(place)
                                                                                                  : std::trunc(place));
    std::nth_element(values.begin(), nth, values.end());
    return *nth;
}

/// Returns two percentiles, both with PercentileRank::lower.
template <class T>
Interval percentiles(std::vector<T> values, double lower, double upper) {
    const auto first = static_cast<double>(percentile(values, lower, PercentileRank::lower));
    return {first, static_cast<double>(percentile(values, upper, PercentileRank::lower))};
}

} // namespace curlew
