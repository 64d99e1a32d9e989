// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/field/ScalarField.h"

#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace curlew {

/// Fields that a formula may use by name.
template <int N>
using NamedFields = std::map<std::string, ScalarFieldN<N>, std::less<>>;

template <int N>
struct ParsedFormula {
    ScalarFieldN<N> field;
    /// Parts of the formula at which the gradient may jump, such as "abs(x)".
    std::vector<std::string> kinks = {};
};

/// Compiles a formula, such as "sin(2*pi*x) * swirl + 0.3*z^2", to a field made with Algebra.h: its derivatives are
/// exact, it runs on lanes, and nothing is interpreted at a point.
///
/// - Coordinates: x, y, z and w, or x1 to x7; p is the position, a vector. A name in `fields` is that field.
/// - Numbers, and the constant pi.
/// - Operators: + - * / ^, with the usual precedence; ^ associates to the right. (a, b, …) is a vector: vectors can be
///   added, subtracted, and multiplied with and divided by a scalar.
/// - Functions: sin cos tan asin acos atan sinh cosh tanh exp log (ln) log2 log10 sqrt abs, length(v), dot(v, w),
///   min(a, b, …), max(a, b, …), clamp(a, lower, upper), sum(a, b, …), avg(a, b, …); and, with derivatives that are
///   continuous (C²), smin(a, b, smoothing), smax(a, b, smoothing), smoothstep(lower, upper, a) (the quintic of Perlin
///   2002). The arguments of length and dot may also be written out: length(x, y).
///
/// Throws ValueError, with the column, if the text is not a formula, if a name is unknown, or if a function is not
/// differentiable where its argument may lie: a divisor must have a known range without zero; an argument of log, and
/// the base of a power whose exponent is fractional or beyond ±64, such as x^100, a known range of positive numbers.
template <int N>
ParsedFormula<N> parsedFormula(std::string_view text, const NamedFields<N>& fields = {});

/// Returns the names in a formula that are neither coordinates nor constants nor functions, in the order in which they
/// first appear.
std::vector<std::string> namesInFormula(std::string_view text);

/// Returns the number of the last coordinate in a formula (1 for x … 7 for x7), or 0 if there is none.
int lastCoordinateIn(std::string_view text);

} // namespace curlew
