// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

namespace curlew {

/// An interval of values, its ends included; all numbers unless something else is said. The operators give the interval
/// of all results.
struct Range {
    double lower = -std::numeric_limits<double>::infinity(), upper = std::numeric_limits<double>::infinity();

    /// From -bound to bound.
    static constexpr Range within(double bound) { return {-bound, bound}; }

    constexpr bool contains(double x) const { return lower <= x && x <= upper; }
    bool finite() const { return std::isfinite(lower) && std::isfinite(upper); }
    /// The largest absolute value.
    double bound() const { return std::max(std::abs(lower), std::abs(upper)); }

    friend constexpr bool operator==(const Range&, const Range&) = default;
};

constexpr Range operator+(const Range& a, const Range& b) { return {a.lower + b.lower, a.upper + b.upper}; }
constexpr Range operator-(const Range& a) { return {-a.upper, -a.lower}; }
constexpr Range operator-(const Range& a, const Range& b) { return a + -b; }
/// Zero times anything is zero, also times infinity.
constexpr Range operator*(const Range& a, const Range& b) {
    const auto times = [](double x, double y) { return x == 0 || y == 0 ? 0 : x * y; };
    const auto [least, most] = std::minmax(
        {times(a.lower, b.lower), times(a.lower, b.upper), times(a.upper, b.lower), times(a.upper, b.upper)});
    return {least, most};
}
constexpr Range operator*(double s, const Range& a) { return Range{s, s} * a; }
/// 1 / a for an interval without zero; all numbers otherwise.
constexpr Range reciprocal(const Range& a) { return a.contains(0) ? Range{} : Range{1 / a.upper, 1 / a.lower}; }

} // namespace curlew
