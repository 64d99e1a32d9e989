// SPDX-License-Identifier: Apache-2.0
#include "curlew/math/Vec.h"
#include "curlew/noise/SimplexVertex.h"
#include "support/Catch.h"
#include "support/Points.h"

#include <set>

using namespace curlew;
using namespace curlew::test;

namespace {

template <int N>
double unskew() {
    return (1 - 1 / std::sqrt(N + 1.0)) / N;
}

/// Returns skewed coordinates relative to the lowest corner of a simplex whose axes are in the order of their ranks.
template <int N>
std::array<int, N> skewed(const NearVertex<N>& v) {
    std::array<int, N> o{};
    for (int r = 0; r < N; ++r)
        o[static_cast<size_t>(r)] = (r < v.corner) + (r == v.step ? v.sign : 0) - (v.step == N ? v.sign : 0);
    return o;
}

} // namespace

TEMPLATE_TEST_CASE_SIG("NearVertex: all vertices near a simplex are listed once", "[noise]", ((int N), N), 2, 3, 4, 5,
                       6, 7) {
    std::set<std::array<int, N>> listed;
    for (int k = 0; k < NearVertex<N>::kCount; ++k) listed.insert(skewed(NearVertex<N>(k)));
    if (N >= 6) CHECK(listed.size() == NearVertex<N>::kCount); // in fewer dimensions some coincide

    std::set<std::array<int, N>> met;
    for (Vec<double, N> r : randomPoints(cube<N>(0.5), 300, 1)) {
        for (double& c : r.c) c += 0.5;
        std::sort(r.c.begin(), r.c.end(), std::greater<>());
        for (int code = 0; code < 1 << (2 * N); ++code) {
            std::array<int, N> o;
            double sum = 0, square = 0;
            for (int i = 0; i < N; ++i) {
                o[static_cast<size_t>(i)] = (code >> (2 * i)) % 4 - 1;
                sum += r[i] - o[static_cast<size_t>(i)];
            }
            for (int i = 0; i < N; ++i) {
                const double d = r[i] - o[static_cast<size_t>(i)] - unskew<N>() * sum;
                square += d * d;
            }
            if (square >= 0.75) continue;
            if (!listed.contains(o)) FAIL("a vertex is not listed");
            met.insert(o);
        }
    }
    CAPTURE(met.size());
    CHECK(met.size() > size_t{N} + 1); // not only the corners
}

TEMPLATE_TEST_CASE_SIG("NearVertex: the position agrees with the skewed coordinates", "[noise]", ((int N), N), 2, 5,
                       7) {
    for (int k = 0; k < NearVertex<N>::kCount; ++k) {
        const NearVertex<N> v(k);
        const auto o = skewed(v);
        double sum = 0;
        for (const int c : o) sum += c;
        CHECK(v.tilt(unskew<N>()) == Approx(-unskew<N>() * sum).margin(1e-15));
        for (int r = 0; r < N; ++r) {
            const double place = v.shift(unskew<N>()) + (r < v.corner ? 1 : 0) + (r == v.step ? v.sign : 0);
            CHECK(place == Approx(o[static_cast<size_t>(r)] - unskew<N>() * sum).margin(1e-15));
        }
    }
}
