#include "curlew/field/Algebra.h"

#include "curlew/base/Error.h"
#include "curlew/field/Dimensions.h"
#include "curlew/math/Fade.h"

#include <fmt/format.h>

namespace curlew {

namespace {

template <int N>
struct Constant {
    double value;
    template <int Order, class T>
    Jet<T, N, Order> at(const Vec<double, N>&) const {
        return static_cast<T>(value);
    }
    Range range() const { return {value, value}; }
};

template <int N>
struct Ramp {
    Vec<double, N> direction;
    double offset;
    template <int Order, class T>
    Jet<T, N, Order> at(const Vec<double, N>& p) const {
        Jet<T, N, Order> jet(static_cast<T>(dot(direction, p) + offset));
        if constexpr (Order >= 1)
            for (int i = 0; i < N; ++i) jet.gradient[i] = static_cast<T>(direction[i]);
        return jet;
    }
};

/// `combine` of the jets of two fields at the same place.
template <int N, class Combine>
struct Binary {
    ScalarFieldN<N> a, b;
    Combine combine;
    Range interval;
    template <int Order, class T>
    void evalBatch(const PointBatchN<N>& points, JetBatchN<T, N, Order>& jets) const {
        JetBatchN<T, N, Order> other;
        a.eval(points, jets);
        b.eval(points, other);
        for (int i = 0; i < points.size; ++i) jets.set(i, combine(jets[i], other[i]));
    }
    Range range() const { return interval; }
};

/// `map` of the jet of a field.
template <int N, class Map>
struct Unary {
    ScalarFieldN<N> a;
    Map map;
    Range interval;
    template <int Order, class T>
    void evalBatch(const PointBatchN<N>& points, JetBatchN<T, N, Order>& jets) const {
        a.eval(points, jets);
        for (int i = 0; i < points.size; ++i) jets.set(i, map(jets[i]));
    }
    Range range() const { return interval; }
};

template <int N, class Combine>
ScalarFieldN<N> binary(const ScalarFieldN<N>& a, const ScalarFieldN<N>& b, const Range& range, Combine combine) {
    return ScalarFieldN<N>(Binary<N, Combine>{a, b, std::move(combine), range});
}

template <int N, class Map>
ScalarFieldN<N> unary(const ScalarFieldN<N>& a, const Range& range, Map map) {
    return ScalarFieldN<N>(Unary<N, Map>{a, std::move(map), range});
}

/// min(t, 0), its kink replaced between -1 and 1 by a cubic: C².
template <class T>
Univariate<T> smoothNegativePart(T t) {
    const T size = std::abs(t), s = T(1) - size, sign = t < T(0) ? T(-1) : T(1);
    if (size >= T(1)) return t < T(0) ? Univariate<T>{t, T(1)} : Univariate<T>{};
    const T step = t < T(0) ? T(1) : T(0);
    return {std::min(t, T(0)) - s * s * s / T(6), step + sign * s * s / T(2), -s, sign};
}

/// The odd function with slope 1 - quinticFade(|t|): t near 0, ±1/2 beyond ±1.
template <class T>
Univariate<T> clip(T t) {
    const T size = std::abs(t), sign = t < T(0) ? T(-1) : T(1);
    if (size >= T(1)) return {sign * T(0.5)};
    const auto fade = quinticFade(size);
    const T s2 = size * size, s4 = s2 * s2;
    const T value = std::min(size - s4 * (s2 - T(3) * size + T(2.5)), T(0.5)); // no rounding leads out of the range
    return {sign * value, T(1) - fade.value, -sign * fade.first, -fade.second};
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
    return binary(a, b, a.range() + b.range(), [](const auto& p, const auto& q) { return p + q; });
}

template <int N>
ScalarFieldN<N> operator-(const ScalarFieldN<N>& a, const ScalarFieldN<N>& b) {
    return binary(a, b, a.range() - b.range(), [](const auto& p, const auto& q) { return p - q; });
}

template <int N>
ScalarFieldN<N> operator*(const ScalarFieldN<N>& a, const ScalarFieldN<N>& b) {
    return binary(a, b, a.range() * b.range(), [](const auto& p, const auto& q) { return p * q; });
}

template <int N>
ScalarFieldN<N> operator*(double s, const ScalarFieldN<N>& a) {
    return unary(a, s * a.range(), [s](const auto& p) { return p * static_cast<decltype(p.value)>(s); });
}

template <int N>
ScalarFieldN<N> operator/(const ScalarFieldN<N>& a, const ScalarFieldN<N>& b) {
    if (const Range r = b.range(); r.contains(0))
        throw ValueError(
            fmt::format("cannot divide by a field that may be zero: as far as is known its values lie "
                        "between {:.4g} and {:.4g}; add a constant to it first",
                        r.lower, r.upper));
    return binary(a, b, a.range() * reciprocal(b.range()),
                  [](const auto& p, const auto& q) { return p * reciprocal(q); });
}

template <int N>
ScalarFieldN<N> smoothMin(const ScalarFieldN<N>& a, const ScalarFieldN<N>& b, double smoothing) {
    if (!(smoothing >= 0) || !std::isfinite(smoothing))
        throw ValueError(fmt::format("smoothing {} must not be negative", smoothing));
    const Range ra = a.range(), rb = b.range();
    return binary(a, b, {std::min(ra.lower, rb.lower) - smoothing / 6, std::min(ra.upper, rb.upper)},
                  [smoothing](const auto& p, const auto& q) {
                      using T = std::remove_cvref_t<decltype(p.value)>;
                      const auto k = static_cast<T>(smoothing);
                      const auto gap = p - q;
                      if (!(std::abs(gap.value) < k)) return gap.value < T(0) ? p : q;
                      const auto m = smoothNegativePart(gap.value / k);
                      return q + compose(gap, Univariate<T>{k * m.value, m.first, m.second / k, m.third / (k * k)});
                  });
}

template <int N>
ScalarFieldN<N> smoothMax(const ScalarFieldN<N>& a, const ScalarFieldN<N>& b, double smoothing) {
    return -1.0 * smoothMin(-1.0 * a, -1.0 * b, smoothing);
}

template <int N>
ScalarFieldN<N> clipped(const ScalarFieldN<N>& a, double range) {
    if (!(range > 0) || !std::isfinite(range)) throw ValueError(fmt::format("range {} must be positive", range));
    return unary(a, Range::within(range / 2), [range](const auto& p) {
        using T = std::remove_cvref_t<decltype(p.value)>;
        const auto k = static_cast<T>(range);
        const auto c = clip(p.value / k);
        return compose(p, Univariate<T>{k * c.value, c.first, c.second / k, c.third / (k * k)});
    });
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
