// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace curlew {

/// The finaliser of SplitMix64 (Steele, Lea and Flood 2014): a bijection of 64-bit words that mixes their bits well.
/// Word is uint64_t, or lanes of it (math/Lanes.h).
template <class Word>
constexpr Word mixedWord(Word word) {
    word += Word(0x9e3779b97f4a7c15u);
    word = (word ^ (word >> 30)) * Word(0xbf58476d1ce4e5b9u);
    word = (word ^ (word >> 27)) * Word(0x94d049bb133111ebu);
    return word ^ (word >> 31);
}
constexpr uint64_t mixBits(uint64_t word) { return mixedWord(word); }

/// Counter-based random bits: a pure function of (seed, index, stream). Random points therefore need no state and are
/// the same for any number of threads.
constexpr uint64_t randomBits(uint64_t seed, uint64_t index, uint64_t stream = 0) {
    return mixBits(mixBits(mixBits(seed) ^ index) ^ stream);
}

/// Returns a uniform random number in [0, 1) with 53 random bits.
constexpr double randomUniform(uint64_t seed, uint64_t index, uint64_t stream = 0) {
    return static_cast<double>(randomBits(seed, index, stream) >> 11) * 0x1p-53;
}

} // namespace curlew
