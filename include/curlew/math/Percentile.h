// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/math/Range.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

namespace curlew {

/// How the rank part * (size - 1) of a percentile, a fraction, becomes that of a value.
enum class PercentileRank {
    nearest,
    lower ///< Truncated.
};

/// The value below which this part (0 to 1) of the values lies; one of them, not interpolated. Reorders the values.
/// There must be at least one, and no NaN.
template <class T>
T percentile(std::vector<T>& values, double part, PercentileRank rank) {
    const double place = part * static_cast<double>(values.size() - 1);
    const auto nth = values.begin() + static_cast<std::ptrdiff_t>(rank == PercentileRank::nearest ? std::round(place)
                                                                                                  : std::trunc(place));
    std::nth_element(values.begin(), nth, values.end());
    return *nth;
}

/// Two percentiles, of the lower rank.
template <class T>
Range percentiles(std::vector<T> values, double lower, double upper) {
    const auto first = static_cast<double>(percentile(values, lower, PercentileRank::lower));
    return {first, static_cast<double>(percentile(values, upper, PercentileRank::lower))};
}

} // namespace curlew
