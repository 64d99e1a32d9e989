// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <bit>
#include <compare>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <string_view>

namespace curlew {

/// A 128-bit hash of a sequence of bytes. It is not cryptographic: two sequences with the same digest can be
/// constructed on purpose. Among n sequences that were not constructed so, two share a digest with a probability of
/// about n² / 2¹²⁹.
struct Digest {
    std::array<uint64_t, 2> words{};

    /// Returns 32 hexadecimal digits, the first word first.
    std::string hex() const;

    friend auto operator<=>(const Digest&, const Digest&) = default;
};

/// Computes a digest incrementally, with MurmurHash3 x64 128 (Appleby 2011). Numbers are hashed as little-endian, so
/// the digest is the same on every machine and with every compiler. How the bytes are split into calls of addBytes()
/// does not matter. Speed: about 4 GB/s.
class DigestBuilder {
  public:
    explicit DigestBuilder(uint64_t seed = 0) : mState{seed, seed} {}

    DigestBuilder& addBytes(const void* data, size_t size);

    /// Adds an integer as 8 bytes in two's complement, whatever its type.
    template <std::integral T>
    DigestBuilder& add(T value) {
        return addWord(static_cast<uint64_t>(value));
    }
    /// Adds a real number as the 8 bytes of an IEEE double. 0 and -0 differ.
    DigestBuilder& add(double value) { return addWord(std::bit_cast<uint64_t>(value)); }
    /// Adds the length of a text and its bytes, so "a", "bc" and "ab", "c" differ.
    DigestBuilder& add(std::string_view text) { return addWord(text.size()).addBytes(text.data(), text.size()); }
    DigestBuilder& add(const Digest& digest) { return addWord(digest.words[0]).addWord(digest.words[1]); }

    /// Returns the digest of everything added so far.
    Digest digest() const;

  private:
    static constexpr size_t kBlock = 16;
    DigestBuilder& addWord(uint64_t word);

    std::array<uint64_t, 2> mState;
    std::array<unsigned char, kBlock> mTail{}; ///< The last mSize % kBlock bytes.
    uint64_t mSize = 0;
};

} // namespace curlew

template <>
struct std::hash<curlew::Digest> {
    size_t operator()(const curlew::Digest& digest) const noexcept { return static_cast<size_t>(digest.words[0]); }
};
