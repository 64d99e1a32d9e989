// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "Catch.h"
#include "curlew/base/Random.h"
#include "curlew/field/Batch.h"

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
template <int N = 3>
BoxN<N> cube(double half) {
    return BoxN<N>{}.padded(half);
}

/// Point k of the pseudo-random sequence `seed`, uniform in the box.
template <int N>
Vec<double, N> randomPoint(const BoxN<N>& box, uint64_t seed, uint64_t k) {
    Vec<double, N> p;
    for (int axis = 0; axis < N; ++axis)
        p[axis] = box.lower[axis] + box.size()[axis] * randomUniform(seed, k, static_cast<uint64_t>(axis));
    return p;
}

template <int N>
std::vector<Vec<double, N>> randomPoints(const BoxN<N>& box, size_t count, uint64_t seed) {
    std::vector<Vec<double, N>> points(count);
    for (size_t k = 0; k < count; ++k) points[k] = randomPoint(box, seed, k);
    return points;
}

/// A point whose coordinates are multiples of 2^-12: exact under the addition of whole numbers.
template <int N>
Vec<double, N> dyadic(Vec<double, N> p) {
    for (double& x : p.c) x = std::floor(x * 4096) / 4096;
    return p;
}

/// The largest of many numbers and where it was seen; NaN counts as the largest. Checked once at the end: an assertion
/// at each of 10^5 points would take longer than what it tests.
template <int N>
struct WorstN {
    double value = 0;
    Vec<double, N> where{};
    void see(double v, const Vec<double, N>& p) {
        if (v <= value || std::isnan(value)) return;
        value = v;
        where = p;
    }
};
using Worst = WorstN<3>;

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
