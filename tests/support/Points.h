#pragma once

#include "curlew/base/Random.h"
#include "curlew/field/Batch.h"

#include <catch2/catch.hpp>

#include <sstream>
#include <vector>

/// How CAPTURE prints a vector: all digits, so that a failing input can be pasted into a test.
template <class T, int N>
struct Catch::StringMaker<curlew::Vec<T, N>> {
    static std::string convert(const curlew::Vec<T, N>& v) {
        std::ostringstream text;
        text.precision(17);
        for (int i = 0; i < N; ++i) text << (i ? ", " : "(") << v[i];
        return text.str() + ")";
    }
};

namespace curlew::test {

/// The cube from -half to half.
inline Box cube(double half) { return {{{-half, -half, -half}}, {{half, half, half}}}; }

/// Point k of the pseudo-random sequence `seed`, uniform in the box.
inline Vec3d randomPoint(const Box& box, uint64_t seed, uint64_t k) {
    Vec3d p;
    for (int axis = 0; axis < 3; ++axis)
        p[axis] = box.lower[axis] + box.size()[axis] * randomUniform(seed, k, static_cast<uint64_t>(axis));
    return p;
}

inline std::vector<Vec3d> randomPoints(const Box& box, size_t count, uint64_t seed) {
    std::vector<Vec3d> points(count);
    for (size_t k = 0; k < count; ++k) points[k] = randomPoint(box, seed, k);
    return points;
}

/// A point whose coordinates are multiples of 2^-12: exact under the addition of whole numbers.
inline Vec3d dyadic(Vec3d p) {
    for (double& x : p.c) x = std::floor(x * 4096) / 4096;
    return p;
}

/// The largest of many numbers and where it was seen; NaN counts as the largest. Checked once at the end: an assertion
/// at each of 10^5 points would take longer than what it tests.
struct Worst {
    double value = 0;
    Vec3d where{};
    void see(double v, const Vec3d& p) {
        if (v <= value || std::isnan(value)) return;
        value = v;
        where = p;
    }
};

template <class J>
double difference(const J& a, const J& b, int begin, int end) {
    double worst = 0;
    for (int k = begin; k < end; ++k) {
        const double d = std::abs(static_cast<double>(a.component(k)) - static_cast<double>(b.component(k)));
        if (!(d <= worst)) worst = d;
    }
    return worst;
}
/// The largest difference in any component of two jets.
template <class J>
double difference(const J& a, const J& b) {
    return difference(a, b, 0, J::kSize);
}

} // namespace curlew::test
