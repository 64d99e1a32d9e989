// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "FunctionModel.h"
#include "curlew/base/Require.h"
#include "curlew/field/Algebra.h"

#include <numbers>
#include <optional>

namespace curlew::detail {

/// A value in a formula while it is compiled: a number, a linear function of the position (kept as its gradient and its
/// value at the origin), or a field.
template <int N>
struct FormulaValue {
    Vec<double, N> gradient{};
    double value = 0;
    std::optional<ScalarFieldN<N>> field = {};
    int depth = 0; ///< Number of operations on fields that depend on one another.

    explicit FormulaValue(double number) : value(number) {}
    explicit FormulaValue(ScalarFieldN<N> f, int depthOfField = 1) : field(std::move(f)), depth(depthOfField) {}
    static FormulaValue coordinate(int axis) {
        FormulaValue x(0.0);
        x.gradient[axis] = 1;
        return x;
    }

    bool isNumber() const { return !field && gradient == Vec<double, N>{}; }
    ScalarFieldN<N> asField() const {
        if (field) return *field;
        return isNumber() ? constantField<N>(value) : rampField<N>(gradient, value);
    }
    Interval range() const {
        if (field) return field->range();
        return isNumber() ? Interval{value, value} : Interval{};
    }
};

inline void requireFinite(double number) {
    if (!std::isfinite(number)) throw ValueError(fmt::format("the result is {}", number));
}

template <int N>
double numberOf(const FormulaValue<N>& v, std::string_view what) {
    if (!v.isNumber()) throw ValueError(fmt::format("{} must be a number, not a field", what));
    return v.value;
}

template <int N>
FormulaValue<N> scaled(const FormulaValue<N>& v, double factor) {
    if (v.field) return factor == 1 ? v : FormulaValue<N>(factor * *v.field, v.depth + 1);
    FormulaValue<N> result = v;
    result.gradient *= factor;
    result.value *= factor;
    requireFinite(result.value);
    return result;
}

template <int N>
FormulaValue<N> mappedField(const FormulaValue<N>& v, const Interval& range, FunctionMap map) {
    return FormulaValue<N>(ScalarFieldN<N>(Unary<N, FunctionMap>{v.asField(), map, range}), v.depth + 1);
}

template <int N>
FormulaValue<N> operator+(const FormulaValue<N>& a, const FormulaValue<N>& b) {
    if (!a.field && !b.field) {
        FormulaValue<N> result = a;
        result.gradient += b.gradient;
        result.value += b.value;
        requireFinite(result.value);
        return result;
    }
    if (a.isNumber()) return b + a;
    if (b.isNumber()) {
        if (b.value == 0) return a;
        return mappedField(a, a.range() + b.range(), {.function = Function::shift, .first = b.value});
    }
    return FormulaValue<N>(a.asField() + b.asField(), std::max(a.depth, b.depth) + 1);
}

template <int N>
FormulaValue<N> operator*(const FormulaValue<N>& a, const FormulaValue<N>& b) {
    if (b.isNumber()) return scaled(a, b.value);
    if (a.isNumber()) return scaled(b, a.value);
    if (!a.field && !b.field && a.gradient == b.gradient && a.value == b.value) return raised(a, FormulaValue<N>(2.0));
    return FormulaValue<N>(a.asField() * b.asField(), std::max(a.depth, b.depth) + 1);
}

template <int N>
FormulaValue<N> operator/(const FormulaValue<N>& a, const FormulaValue<N>& b) {
    if (b.isNumber()) {
        if (b.value == 0) throw ValueError("division by zero");
        return scaled(a, 1 / b.value);
    }
    if (a.isNumber()) return scaled(raised(b, FormulaValue<N>(-1.0)), a.value);
    return FormulaValue<N>(a.asField() / b.asField(), std::max(a.depth, b.depth) + 1);
}

/// Throws ValueError if the range is not within the limits.
inline void requireWithin(const Interval& range, const Interval& limits, std::string_view what,
                          std::string_view advice) {
    if (range.lower >= limits.lower && range.upper <= limits.upper) return;
    throw ValueError(
        fmt::format("{} may be from {:.4g} to {:.4g}, as far as is known; {}", what, range.lower, range.upper, advice));
}

/// Returns the range of an increasing function.
template <class F>
Interval increasing(const Interval& range, const F& f) {
    return {f(range.lower), f(range.upper)};
}

template <int N>
FormulaValue<N> raised(const FormulaValue<N>& base, const FormulaValue<N>& exponent) {
    if (!exponent.isNumber()) // a^b = exp(b log a)
        return mapped(exponent * mapped(base, Function::log), Function::exp);
    const double n = exponent.value;
    if (base.isNumber()) {
        requireFinite(std::pow(base.value, n));
        return FormulaValue<N>(std::pow(base.value, n));
    }
    if (n == 0) return FormulaValue<N>(1.0);
    if (n == 1) return base;
    const Interval range = base.range();
    constexpr double kGreatest = 64;
    constexpr double kTiny = std::numeric_limits<double>::min();
    if (n != std::floor(n) || std::abs(n) > kGreatest) {
        requireWithin(range, {kTiny, std::numeric_limits<double>::infinity()},
                      fmt::format("the base of the power {}", n), "it must be positive");
        const auto power = [n](double x) { return std::pow(x, n); };
        const Interval ends = increasing(range, power);
        return mappedField(base, n > 0 ? ends : Interval{ends.upper, ends.lower},
                           {.function = Function::power, .first = n});
    }
    if (n < 0 && range.contains(0))
        throw ValueError(
            fmt::format("division by a value that may be zero: it is from {:.4g} to {:.4g}, as far as is "
                        "known; add a constant to it",
                        range.lower, range.upper));
    const bool even = std::fmod(n, 2) == 0;
    const double low = std::pow(range.lower, n), high = std::pow(range.upper, n);
    Interval all{std::min(low, high), std::max(low, high)};
    if (even && n > 0 && range.contains(0)) all.lower = 0;
    return mappedField(base, all, {.function = Function::wholePower, .first = n});
}

/// Applies a function without parameters.
template <int N>
FormulaValue<N> mapped(const FormulaValue<N>& v, Function function) {
    constexpr double kInfinity = std::numeric_limits<double>::infinity(), kHalf = std::numbers::pi / 2;
    const Interval range = v.range();
    const auto made = [&](const Interval& values) {
        if (!v.isNumber()) return mappedField(v, values, {.function = function});
        const double number = FunctionMap{.function = function}(Jet<double, 1, 0>(v.value)).value;
        requireFinite(number);
        return FormulaValue<N>(number);
    };
    switch (function) {
        case Function::sin:
        case Function::cos:
            return made(Interval::within(1));
        case Function::tan:
            requireWithin(range, Interval::within(std::nextafter(kHalf, 0)), "the argument of tan",
                          "it must be between -pi/2 and pi/2");
            return made(increasing(range, [](double x) { return std::tan(x); }));
        case Function::asin:
        case Function::acos:
            if (!v.isNumber())
                requireWithin(range, Interval::within(std::nextafter(1, 0)), "the argument of asin or acos",
                              "it must be between -1 and 1");
            else
                requireWithin(range, Interval::within(1), "the argument of asin or acos", "it must be from -1 to 1");
            return made(function == Function::asin ? Interval::within(kHalf) : Interval{0, std::numbers::pi});
        case Function::atan:
            return made(Interval::within(kHalf));
        case Function::sinh:
            return made(increasing(range, [](double x) { return std::sinh(x); }));
        case Function::cosh:
            return made({range.contains(0) ? 1 : std::cosh(std::min(std::abs(range.lower), std::abs(range.upper))),
                         std::cosh(range.maxAbs())});
        case Function::tanh:
            return made(increasing(range, [](double x) { return std::tanh(x); }));
        case Function::exp:
            return made(increasing(range, [](double x) { return std::exp(x); }));
        case Function::log:
            requireWithin(range, {std::numeric_limits<double>::min(), kInfinity}, "the argument of a logarithm",
                          "it must be positive");
            return made(increasing(range, [](double x) { return std::log(x); }));
        case Function::sqrt:
            requireWithin(range, {0, kInfinity}, "the argument of sqrt", "it must not be negative");
            return made(increasing(range, [](double x) { return std::sqrt(x); }));
        case Function::abs:
            return made(
                {range.contains(0) ? 0 : std::min(std::abs(range.lower), std::abs(range.upper)), range.maxAbs()});
        default:
            throw ValueError("this function has parameters");
    }
}

template <int N>
FormulaValue<N> smaller2(const FormulaValue<N>& a, const FormulaValue<N>& b, double smoothing) {
    if (a.isNumber() && b.isNumber() && smoothing == 0) return FormulaValue<N>(std::min(a.value, b.value));
    return FormulaValue<N>(smoothMin(a.asField(), b.asField(), smoothing), std::max(a.depth, b.depth) + 1);
}

template <int N>
FormulaValue<N> larger2(const FormulaValue<N>& a, const FormulaValue<N>& b, double smoothing) {
    return scaled(smaller2(scaled(a, -1), scaled(b, -1), smoothing), -1);
}

template <int N>
FormulaValue<N> stepped(const FormulaValue<N>& v, double lower, double upper) {
    if (lower == upper) throw ValueError("the two ends of smoothstep must differ");
    const FunctionMap map{.function = Function::smoothstep, .first = lower, .second = 1 / (upper - lower)};
    requireFinite(map.second);
    if (v.isNumber()) return FormulaValue<N>(map(Jet<double, 1, 0>(v.value)).value);
    return mappedField(v, {0, 1}, map);
}

} // namespace curlew::detail
