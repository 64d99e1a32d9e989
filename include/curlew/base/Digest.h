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

/// 128 bits that identify a sequence of bytes. Not for secrets: whoever wants to can make two sequences with the same
/// digest. Among n sequences that nobody chose for that, two share one with a probability of about n² / 2¹²⁹.
struct Digest {
    std::array<uint64_t, 2> words{};

    /// 32 hexadecimal digits, the first word first.
    std::string hex() const;

    friend auto operator<=>(const Digest&, const Digest&) = default;
};

/// Makes the digest of what is added, in order: MurmurHash3 x64 128 (Appleby 2011). All numbers are taken as
/// little-endian, so that the digest is the same on every machine and with every compiler. How the bytes are divided
/// into calls of addBytes() does not matter. About 4 GB/s.
class DigestBuilder {
  public:
    explicit DigestBuilder(uint64_t seed = 0) : mState{seed, seed} {}

    DigestBuilder& addBytes(const void* data, size_t size);

    /// An integer as 8 bytes, in two's complement: its type does not matter.
    template <std::integral T>
    DigestBuilder& add(T value) {
        return addWord(static_cast<uint64_t>(value));
    }
    /// A real number as the 8 bytes of an IEEE double: 0 and -0 differ.
    DigestBuilder& add(double value) { return addWord(std::bit_cast<uint64_t>(value)); }
    /// A text as its length and its bytes: "a", "bc" and "ab", "c" differ.
    DigestBuilder& add(std::string_view text) { return addWord(text.size()).addBytes(text.data(), text.size()); }
    DigestBuilder& add(const Digest& digest) { return addWord(digest.words[0]).addWord(digest.words[1]); }

    /// Of all that was added so far.
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
