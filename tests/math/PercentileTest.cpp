// SPDX-License-Identifier: Apache-2.0
#include "curlew/base/Random.h"
#include "curlew/math/Percentile.h"
#include "support/Catch.h"

using namespace curlew;

TEST_CASE("percentile: agrees with sorting for every rank", "[math]") {
    for (uint64_t seed = 0; seed < 200; ++seed) {
        std::vector<double> values;
        const auto size = 1 + static_cast<size_t>(100 * randomUniform(seed, 0));
        for (size_t k = 0; k < size; ++k) values.push_back(randomUniform(seed, 1, k));
        std::vector<double> sorted = values;
        std::sort(sorted.begin(), sorted.end());
        const double part = randomUniform(seed, 2), place = part * static_cast<double>(size - 1);
        CAPTURE(seed, size, part);
        const auto below = static_cast<size_t>(place);
        CHECK(percentile(values, part, PercentileRank::lower) == sorted[below]);
        CHECK(percentile(values, part, PercentileRank::nearest) ==
              sorted[place - static_cast<double>(below) < 0.5 ? below : below + 1]);
        CHECK(percentile(values, 0, PercentileRank::nearest) == sorted.front());
        CHECK(percentile(values, 1, PercentileRank::lower) == sorted.back());
        CHECK(percentiles(values, 0, part) == Interval{sorted.front(), sorted[below]});
    }
}
