// SPDX-License-Identifier: Apache-2.0
#include "curlew/field/Algebra.h"

#include "AlgebraModels.h"
#include "curlew/base/Error.h"
#include "curlew/field/Dimensions.h"

#include <fmt/format.h>

namespace curlew {

using namespace detail;

namespace {

template <int N, class Combine>
ScalarFieldN<N> binary(const ScalarFieldN<N>& a, const ScalarFieldN<N>& b, const Interval& range, Combine combine) {
    return ScalarFieldN<N>(Binary<N, Combine>{a, b, std::move(combine), range});
}

template <int N, class Map>
ScalarFieldN<N> unary(const ScalarFieldN<N>& a, const Interval& range, Map map) {
    return ScalarFieldN<N>(Unary<N, Map>{a, std::move(map), range});
}

} // namespace

template <int N>
ScalarFieldN<N> constantField(double value) {
    return ScalarFieldN<N>(Constant<N>{value});
}

template <int N>
ScalarFieldN<N> rampField(const Vec<double, N>& direction, double offset) {
    return ScalarFieldN<N>(Ramp<N>{direction, offset});
}

template <int N>
ScalarFieldN<N> operator+(const ScalarFieldN<N>& a, const ScalarFieldN<N>& b) {
    return binary(a, b, a.range() + b.range(), Sum{});
}

template <int N>
ScalarFieldN<N> operator-(const ScalarFieldN<N>& a, const ScalarFieldN<N>& b) {
    return binary(a, b, a.range() - b.range(), Difference{});
}

template <int N>
ScalarFieldN<N> operator*(const ScalarFieldN<N>& a, const ScalarFieldN<N>& b) {
    return binary(a, b, a.range() * b.range(), Product{});
}

template <int N>
ScalarFieldN<N> operator*(double s, const ScalarFieldN<N>& a) {
    return unary(a, s * a.range(), Scaled{s});
}

template <int N>
ScalarFieldN<N> operator/(const ScalarFieldN<N>& a, const ScalarFieldN<N>& b) {
    if (const Interval r = b.range(); r.contains(0))
        throw ValueError(
            fmt::format("cannot divide by a field that may be zero: its values are only known to lie between {:.4g} "
                        "and {:.4g}; add a constant to it first",
                        r.lower, r.upper));
    return binary(a, b, a.range() * reciprocal(b.range()), Quotient{});
}

template <int N>
ScalarFieldN<N> smoothMin(const ScalarFieldN<N>& a, const ScalarFieldN<N>& b, double smoothing) {
    if (!(smoothing >= 0) || !std::isfinite(smoothing))
        throw ValueError(fmt::format("smoothing {} must not be negative", smoothing));
    const Interval ra = a.range(), rb = b.range();
    return binary(a, b, {std::min(ra.lower, rb.lower) - smoothing / 6, std::min(ra.upper, rb.upper)},
                  SmoothMin{smoothing});
}

template <int N>
ScalarFieldN<N> smoothMax(const ScalarFieldN<N>& a, const ScalarFieldN<N>& b, double smoothing) {
    return -1.0 * smoothMin(-1.0 * a, -1.0 * b, smoothing);
}

template <int N>
ScalarFieldN<N> clipped(const ScalarFieldN<N>& a, double range) {
    if (!(range > 0) || !std::isfinite(range)) throw ValueError(fmt::format("range {} must be positive", range));
    return unary(a, Interval::within(range / 2), Clip{range});
}

#define CURLEW_INSTANTIATE(N)                                                                   \
    template ScalarFieldN<N> constantField<N>(double);                                          \
    template ScalarFieldN<N> rampField(const Vec<double, N>&, double);                          \
    template ScalarFieldN<N> operator+(const ScalarFieldN<N>&, const ScalarFieldN<N>&);         \
    template ScalarFieldN<N> operator-(const ScalarFieldN<N>&, const ScalarFieldN<N>&);         \
    template ScalarFieldN<N> operator*(const ScalarFieldN<N>&, const ScalarFieldN<N>&);         \
    template ScalarFieldN<N> operator*(double, const ScalarFieldN<N>&);                         \
    template ScalarFieldN<N> operator/(const ScalarFieldN<N>&, const ScalarFieldN<N>&);         \
    template ScalarFieldN<N> smoothMin(const ScalarFieldN<N>&, const ScalarFieldN<N>&, double); \
    template ScalarFieldN<N> smoothMax(const ScalarFieldN<N>&, const ScalarFieldN<N>&, double); \
    template ScalarFieldN<N> clipped(const ScalarFieldN<N>&, double);
CURLEW_FOR_DIMENSIONS(CURLEW_INSTANTIATE)
#undef CURLEW_INSTANTIATE

} // namespace curlew
