// SPDX-License-Identifier: Apache-2.0
#include "curlew/base/Random.h"
#include "curlew/math/Range.h"

#include <catch2/catch.hpp>

#include <array>
#include <vector>

using namespace curlew;

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr Range kAll{};

/// Intervals of each kind: of both signs, with zero inside and at either end, of one number, and endless ones.
std::vector<Range> ranges() {
    std::vector<Range> all;
    const std::array<double, 9> ends{-kInfinity, -1e100, -3, -0.7, 0, 0.25, 2, 1e100, kInfinity};
    for (size_t i = 0; i < ends.size(); ++i)
        for (size_t j = i; j < ends.size(); ++j)
            if (i != j || std::isfinite(ends[i])) all.push_back({ends[i], ends[j]});
    return all;
}

/// Finite numbers of an interval, its finite ends among them.
std::vector<double> samples(const Range& a, uint64_t seed) {
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

TEST_CASE("a range knows what it contains and its bound", "[math]") {
    CHECK(kAll.contains(-1e300));
    CHECK(kAll.contains(kInfinity));
    CHECK_FALSE(kAll.finite());
    CHECK(kAll.bound() == kInfinity);
    CHECK_FALSE(kAll.contains(std::nan("")));
    const Range a = Range::within(2);
    CHECK(a == Range{-2, 2});
    CHECK((a.contains(-2) && a.contains(0) && a.contains(2)));
    CHECK_FALSE(a.contains(std::nextafter(2, 3)));
    CHECK_FALSE(a.contains(std::nextafter(-2, -3)));
    CHECK(a.finite());
    CHECK(a.bound() == 2);
    CHECK(Range{-3, 1}.bound() == 3);
    CHECK(Range{1, 4}.bound() == 4);
    CHECK(Range{-4, -1}.bound() == 4);
    CHECK_FALSE(Range{0, kInfinity}.finite());
    CHECK_FALSE(Range{-kInfinity, 0}.finite());
}

TEST_CASE("results of numbers from ranges lie in the range of results", "[math]") {
    uint64_t pair = 0;
    for (const Range& a : ranges())
        for (const Range& b : ranges()) {
            ++pair;
            CAPTURE(a.lower, a.upper, b.lower, b.upper);
            const Range sum = a + b, minus = a - b, product = a * b;
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

TEST_CASE("ranges of results are no larger than they need be", "[math]") {
    CHECK(Range{-1, 2} + Range{3, 5} == Range{2, 7});
    CHECK(Range{-1, 2} - Range{3, 5} == Range{-6, -1});
    CHECK(-Range{-1, 2} == Range{-2, 1});
    CHECK(Range{-1, 2} * Range{3, 5} == Range{-5, 10});
    CHECK(Range{-3, -2} * Range{-5, 7} == Range{-21, 15});
    CHECK(Range{-1, 2} * Range{-4, 3} == Range{-8, 6});
    CHECK(-2.0 * Range{-1, 3} == Range{-6, 2});
    CHECK(reciprocal(Range{2, 4}) == Range{0.25, 0.5});
    CHECK(reciprocal(Range{-4, -2}) == Range{-0.5, -0.25});
    CHECK(reciprocal(Range{2, kInfinity}) == Range{0, 0.5});
    CHECK(reciprocal(Range{-kInfinity, -2}) == Range{-0.5, 0});
}

TEST_CASE("a range with zero has no range of reciprocals", "[math]") {
    for (const Range& a : {Range{-1, 1}, Range{0, 1}, Range{-1, 0}, Range{0, 0}, Range{-0.0, 2}, kAll}) {
        CAPTURE(a.lower, a.upper);
        CHECK(reciprocal(a) == kAll);
    }
}

TEST_CASE("zero times an endless range is zero", "[math]") {
    CHECK(Range{0, 0} * kAll == Range{0, 0});
    CHECK(kAll * Range{0, 0} == Range{0, 0});
    CHECK(0.0 * kAll == Range{0, 0});
    CHECK(-0.0 * kAll == Range{0, 0});
    CHECK(Range{0, 2} * Range{0, kInfinity} == Range{0, kInfinity});
    CHECK(Range{0, 2} * Range{-kInfinity, -1} == Range{-kInfinity, 0});
    CHECK(Range{-2, 0} * kAll == kAll);
    CHECK(Range{1, kInfinity} * Range{-kInfinity, -1} == Range{-kInfinity, -1});
    CHECK(kAll + kAll == kAll);
    CHECK(kAll - kAll == kAll);
    CHECK(Range{0, kInfinity} - Range{0, kInfinity} == kAll);
}

TEST_CASE("ranges are constant expressions", "[math]") {
    STATIC_REQUIRE(Range{-1, 2} * Range{3, 4} - Range{0, 1} == Range{-5, 8});
    STATIC_REQUIRE(reciprocal(Range{1, 2}).contains(0.75));
}
