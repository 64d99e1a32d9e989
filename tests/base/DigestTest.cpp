// SPDX-License-Identifier: Apache-2.0
#include "curlew/base/Digest.h"
#include "support/Catch.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <random>
#include <unordered_set>

using namespace curlew;

namespace {

Digest digestOf(std::string_view bytes, uint64_t seed = 0) {
    return DigestBuilder(seed).addBytes(bytes.data(), bytes.size()).digest();
}

} // namespace

TEST_CASE("Digest: matches published values of MurmurHash3 x64 128", "[base]") {
    CHECK(digestOf("").hex() == "00000000000000000000000000000000");
    CHECK(digestOf("hello").hex() == "cbd8a7b341bd9b025b1e906a48ae1d19");
    CHECK(digestOf("The quick brown fox jumps over the lazy dog").hex() == "e34bbc7bbc071b6c7a433ca9c49a9347");

    // The verification value of SMHasher (Appleby): the digest of the digests of the keys "", 0, 01, 012, … with the
    // seeds 256, 255, ….
    std::string key, digests;
    const auto append = [](std::string& bytes, const Digest& digest) {
        for (const uint64_t word : digest.words)
            for (int k = 0; k < 8; ++k) bytes += static_cast<char>(word >> 8 * k & 255);
    };
    for (int n = 0; n < 256; ++n) {
        append(digests, digestOf(key, static_cast<uint64_t>(256 - n)));
        key += static_cast<char>(n);
    }
    CHECK(static_cast<uint32_t>(digestOf(digests).words[0]) == 0x6384ba69u);
}

TEST_CASE("Digest: does not depend on how the bytes are split into calls", "[base]") {
    std::mt19937 random(1);
    std::string bytes(1000, '\0');
    for (char& byte : bytes) byte = static_cast<char>(random());
    const Digest whole = digestOf(bytes);
    for (int n = 0; n < 200; ++n) {
        DigestBuilder builder;
        for (size_t at = 0; at < bytes.size();) {
            const size_t size = std::min<size_t>(random() % 50, bytes.size() - at);
            builder.addBytes(&bytes[at], size);
            at += size;
        }
        REQUIRE(builder.digest() == whole);
        REQUIRE(builder.digest() == whole); // digest() does not change the state
    }
}

TEST_CASE("Digest: flipping one input bit flips half of the output bits", "[base]") {
    const size_t size = GENERATE(1, 8, 15, 16, 17, 100);
    CAPTURE(size);
    std::mt19937 random(2);
    int flips = 0;
    constexpr int kRuns = 1000;
    for (int n = 0; n < kRuns; ++n) {
        std::string bytes(size, '\0');
        for (char& byte : bytes) byte = static_cast<char>(random());
        const Digest before = digestOf(bytes);
        const size_t bit = random() % (8 * size);
        bytes[bit / 8] = static_cast<char>(bytes[bit / 8] ^ 1 << bit % 8);
        const Digest after = digestOf(bytes);
        for (const size_t k : {0, 1}) flips += std::popcount(before.words[k] ^ after.words[k]);
    }
    CHECK(std::abs(flips - 64 * kRuns) < 5 * std::sqrt(128 * kRuns * 0.25)); // 5 sigma of 128,000 coin tosses
}

TEST_CASE("Digest: numbers and strings are hashed unambiguously", "[base]") {
    const auto of = [](const auto&... values) {
        DigestBuilder builder;
        (builder.add(values), ...);
        return builder.digest();
    };
    CHECK(of(int32_t{-1}) == of(int64_t{-1}));
    CHECK(of(uint8_t{7}) == of(size_t{7}));
    CHECK(of(0x0807060504030201) == digestOf("\1\2\3\4\5\6\7\10")); // little-endian
    CHECK(of(1.0) == of(0x3ff0000000000000));                       // IEEE 754
    CHECK(of(0.0) != of(-0.0));
    CHECK(of("a", "bc") != of("ab", "c"));
    CHECK(of("", "a") != of("a", ""));
    CHECK(of("a") == of(std::string("a")));
    CHECK(of(of(1)) != of(1));
    std::unordered_set<Digest> seen;
    for (int n = 0; n < 1000; ++n) seen.insert(of(n));
    CHECK(seen.size() == 1000);
}
