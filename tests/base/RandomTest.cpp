// SPDX-License-Identifier: Apache-2.0
#include "curlew/base/Random.h"
#include "support/Catch.h"

#include <array>
#include <bit>
#include <cmath>
#include <set>

using namespace curlew;

TEST_CASE("randomBits: depends on seed and index and stream only", "[base]") {
    static_assert(randomBits(1, 2, 3) == randomBits(1, 2, 3));
    // The first output of the published SplitMix64 generator with seed 0.
    STATIC_REQUIRE(mixBits(0) == 0xe220a8397b1dcdafu);
    std::set<uint64_t> seen;
    for (uint64_t seed = 0; seed < 20; ++seed)
        for (uint64_t index = 0; index < 20; ++index)
            for (uint64_t stream = 0; stream < 20; ++stream) seen.insert(randomBits(seed, index, stream));
    CHECK(seen.size() == 8000); // 64-bit words: a collision has probability 2e-12
}

TEST_CASE("randomBits: flipping one input bit flips half of the output bits", "[base]") {
    const int bit = GENERATE(0, 1, 31, 63);
    CAPTURE(bit);
    int flips = 0;
    for (uint64_t k = 0; k < 1000; ++k)
        flips += std::popcount(randomBits(7, k) ^ randomBits(7, k ^ (uint64_t{1} << bit)));
    CHECK(std::abs(flips - 32000) < 5 * std::sqrt(64000 * 0.25)); // 5 sigma of 64,000 coin tosses
}

TEST_CASE("randomUniform: numbers are uniform in the unit interval and uncorrelated", "[base]") {
    constexpr int kBins = 16, kCount = 160000;
    const auto seed = static_cast<uint64_t>(GENERATE(0, 1, 12345));
    CAPTURE(seed);
    std::array<int, kBins> bins{};
    double sum = 0, product = 0;
    for (uint64_t k = 0; k < kCount; ++k) {
        const double u = randomUniform(seed, k);
        if (!(u >= 0 && u < 1)) FAIL("u = " << u << " at " << k);
        ++bins[static_cast<size_t>(u * kBins)];
        sum += u;
        product += (u - 0.5) * (randomUniform(seed, k + 1) - 0.5);
    }
    // Bounds of 5 sigma: binomial for each bin, variance 1/12 for the mean, (1/12)² for products of neighbours.
    const double share = 1.0 / kBins, sigma = std::sqrt(kCount * share * (1 - share));
    for (const int n : bins) CHECK(std::abs(n - kCount * share) < 5 * sigma);
    CHECK(std::abs(sum / kCount - 0.5) < 5 * std::sqrt(1.0 / 12 / kCount));
    CHECK(std::abs(product / kCount) < 5.0 / 12 / std::sqrt(double(kCount)));
}
