// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

namespace curlew {

/// A closed interval of values; by default all numbers. The operators do interval arithmetic: they return an interval
/// that contains every result.
struct Interval {
    double lower = -std::numeric_limits<double>::infinity(), upper = std::numeric_limits<double>::infinity();

    /// Returns [-bound, bound].
    static constexpr Interval within(double bound) { return {-bound, bound}; }

    constexpr bool contains(double x) const { return lower <= x && x <= upper; }
    bool finite() const { return std::isfinite(lower) && std::isfinite(upper); }
    /// Returns the largest absolute value in the interval.
    double maxAbs() const { return std::max(std::abs(lower), std::abs(upper)); }

    friend constexpr bool operator==(const Interval&, const Interval&) = default;
};

constexpr Interval operator+(const Interval& a, const Interval& b) { return {a.lower + b.lower, a.upper + b.upper}; }
constexpr Interval operator-(const Interval& a) { return {-a.upper, -a.lower}; }
constexpr Interval operator-(const Interval& a, const Interval& b) { return a + -b; }
/// Zero times anything is zero, even times infinity.
constexpr Interval operator*(const Interval& a, const Interval& b) {
    const auto times = [](double x, double y) { return x == 0 || y == 0 ? 0 : x * y; };
    const auto [least, most] = std::minmax(
        {times(a.lower, b.lower), times(a.lower, b.upper), times(a.upper, b.lower), times(a.upper, b.upper)});
    return {least, most};
}
constexpr Interval operator*(double s, const Interval& a) { return Interval{s, s} * a; }
/// Returns 1 / a if the interval does not contain zero, else all numbers.
constexpr Interval reciprocal(const Interval& a) {
    return a.contains(0) ? Interval{} : Interval{1 / a.upper, 1 / a.lower};
}

} // namespace curlew
