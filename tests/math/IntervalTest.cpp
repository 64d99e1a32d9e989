// SPDX-License-Identifier: Apache-2.0
#include "curlew/base/Random.h"
#include "curlew/math/Interval.h"
#include "support/Catch.h"

#include <array>
#include <vector>

using namespace curlew;

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr Interval kAll{};

/// Intervals of each kind: of both signs, with zero inside and at either end, of one number, and endless ones.
std::vector<Interval> ranges() {
    std::vector<Interval> all;
    const std::array<double, 9> ends{-kInfinity, -1e100, -3, -0.7, 0, 0.25, 2, 1e100, kInfinity};
    for (size_t i = 0; i < ends.size(); ++i)
        for (size_t j = i; j < ends.size(); ++j)
            if (i != j || std::isfinite(ends[i])) all.push_back({ends[i], ends[j]});
    return all;
}

/// Finite numbers of an interval, its finite ends among them.
std::vector<double> samples(const Interval& a, uint64_t seed) {
    const double low = std::max(a.lower, -1e200), high = std::min(a.upper, 1e200);
    std::vector<double> all{low, high};
    if (a.contains(0)) all.push_back(0);
    for (uint64_t k = 0; k < 4; ++k) {
        const double t = randomUniform(seed, k);
        all.push_back(std::clamp(low + t * (high - low), low, high));
        all.push_back(std::clamp(t * 10 - 5, low, high)); // not only very large ones
    }
    return all;
}

} // namespace

TEST_CASE("Interval: contains and bound and finite agree with its ends", "[math]") {
    CHECK(kAll.contains(-1e300));
    CHECK(kAll.contains(kInfinity));
    CHECK_FALSE(kAll.finite());
    CHECK(kAll.maxAbs() == kInfinity);
    CHECK_FALSE(kAll.contains(std::nan("")));
    const Interval a = Interval::within(2);
    CHECK(a == Interval{-2, 2});
    CHECK((a.contains(-2) && a.contains(0) && a.contains(2)));
    CHECK_FALSE(a.contains(std::nextafter(2, 3)));
    CHECK_FALSE(a.contains(std::nextafter(-2, -3)));
    CHECK(a.finite());
    CHECK(a.maxAbs() == 2);
    CHECK(Interval{-3, 1}.maxAbs() == 3);
    CHECK(Interval{1, 4}.maxAbs() == 4);
    CHECK(Interval{-4, -1}.maxAbs() == 4);
    CHECK_FALSE(Interval{0, kInfinity}.finite());
    CHECK_FALSE(Interval{-kInfinity, 0}.finite());
}

TEST_CASE("Interval: interval arithmetic contains every pointwise result", "[math]") {
    uint64_t pair = 0;
    for (const Interval& a : ranges())
        for (const Interval& b : ranges()) {
            ++pair;
            CAPTURE(a.lower, a.upper, b.lower, b.upper);
            const Interval sum = a + b, minus = a - b, product = a * b;
            REQUIRE((sum.lower <= sum.upper && minus.lower <= minus.upper && product.lower <= product.upper));
            for (const double x : samples(a, 2 * pair))
                for (const double y : samples(b, 2 * pair + 1)) {
                    const bool good = sum.contains(x + y) && minus.contains(x - y) && product.contains(x * y) &&
                                      (y * a).contains(y * x) && (-a).contains(-x) &&
                                      (x == 0 || reciprocal(a).contains(1 / x));
                    if (!good) FAIL("outside: " << x << " and " << y);
                }
        }
}

TEST_CASE("Interval: interval arithmetic is tight", "[math]") {
    CHECK(Interval{-1, 2} + Interval{3, 5} == Interval{2, 7});
    CHECK(Interval{-1, 2} - Interval{3, 5} == Interval{-6, -1});
    CHECK(-Interval{-1, 2} == Interval{-2, 1});
    CHECK(Interval{-1, 2} * Interval{3, 5} == Interval{-5, 10});
    CHECK(Interval{-3, -2} * Interval{-5, 7} == Interval{-21, 15});
    CHECK(Interval{-1, 2} * Interval{-4, 3} == Interval{-8, 6});
    CHECK(-2.0 * Interval{-1, 3} == Interval{-6, 2});
    CHECK(reciprocal(Interval{2, 4}) == Interval{0.25, 0.5});
    CHECK(reciprocal(Interval{-4, -2}) == Interval{-0.5, -0.25});
    CHECK(reciprocal(Interval{2, kInfinity}) == Interval{0, 0.5});
    CHECK(reciprocal(Interval{-kInfinity, -2}) == Interval{-0.5, 0});
}

TEST_CASE("Interval: the reciprocal of an interval with zero is unbounded", "[math]") {
    for (const Interval& a :
         {Interval{-1, 1}, Interval{0, 1}, Interval{-1, 0}, Interval{0, 0}, Interval{-0.0, 2}, kAll}) {
        CAPTURE(a.lower, a.upper);
        CHECK(reciprocal(a) == kAll);
    }
}

TEST_CASE("Interval: zero times an unbounded interval is zero", "[math]") {
    CHECK(Interval{0, 0} * kAll == Interval{0, 0});
    CHECK(kAll * Interval{0, 0} == Interval{0, 0});
    CHECK(0.0 * kAll == Interval{0, 0});
    CHECK(-0.0 * kAll == Interval{0, 0});
    CHECK(Interval{0, 2} * Interval{0, kInfinity} == Interval{0, kInfinity});
    CHECK(Interval{0, 2} * Interval{-kInfinity, -1} == Interval{-kInfinity, 0});
    CHECK(Interval{-2, 0} * kAll == kAll);
    CHECK(Interval{1, kInfinity} * Interval{-kInfinity, -1} == Interval{-kInfinity, -1});
    CHECK(kAll + kAll == kAll);
    CHECK(kAll - kAll == kAll);
    CHECK(Interval{0, kInfinity} - Interval{0, kInfinity} == kAll);
}

TEST_CASE("Interval: arithmetic is constexpr", "[math]") {
    STATIC_REQUIRE(Interval{-1, 2} * Interval{3, 4} - Interval{0, 1} == Interval{-5, 8});
    STATIC_REQUIRE(reciprocal(Interval{1, 2}).contains(0.75));
}
