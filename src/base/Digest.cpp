// SPDX-License-Identifier: Apache-2.0
#include "curlew/base/Digest.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>

namespace curlew {

namespace {

using Words = std::array<uint64_t, 2>;

constexpr uint64_t littleEndian(uint64_t word) {
    return std::endian::native == std::endian::little ? word : __builtin_bswap64(word);
}

/// The words of a block, scrambled.
Words scrambled(const unsigned char* block) {
    constexpr Words kFactors{0x87c37b91114253d5u, 0x4cf5ad432745937fu};
    Words words;
    std::memcpy(words.data(), block, sizeof words);
    for (const size_t k : {0, 1})
        words[k] = std::rotl(littleEndian(words[k]) * kFactors[k], k == 0 ? 31 : 33) * kFactors[1 - k];
    return words;
}

void addBlock(Words& state, const unsigned char* block) {
    const Words words = scrambled(block);
    auto& [a, b] = state;
    a = (std::rotl(a ^ words[0], 27) + b) * 5 + 0x52dce729u;
    b = (std::rotl(b ^ words[1], 31) + a) * 5 + 0x38495ab5u;
}

/// A bijection in which every output bit depends on all input bits.
uint64_t finalised(uint64_t word) {
    word = (word ^ (word >> 33)) * 0xff51afd7ed558ccdu;
    word = (word ^ (word >> 33)) * 0xc4ceb9fe1a85ec53u;
    return word ^ (word >> 33);
}

} // namespace

std::string Digest::hex() const { return fmt::format("{:016x}{:016x}", words[0], words[1]); }

DigestBuilder& DigestBuilder::addBytes(const void* data, size_t size) {
    if (size == 0) return *this;
    const auto* bytes = static_cast<const unsigned char*>(data);
    const size_t begun = mSize % kBlock;
    mSize += size;
    if (begun > 0) {
        const size_t part = std::min(size, kBlock - begun);
        std::memcpy(&mTail[begun], bytes, part);
        bytes += part, size -= part;
        if (begun + part < kBlock) return *this;
        addBlock(mState, mTail.data());
    }
    for (; size >= kBlock; bytes += kBlock, size -= kBlock) addBlock(mState, bytes);
    std::memcpy(mTail.data(), bytes, size);
    return *this;
}

DigestBuilder& DigestBuilder::addWord(uint64_t word) {
    word = littleEndian(word);
    return addBytes(&word, sizeof word);
}

Digest DigestBuilder::digest() const {
    std::array<unsigned char, kBlock> last{};
    std::memcpy(last.data(), mTail.data(), mSize % kBlock);
    const Words words = scrambled(last.data());
    auto [a, b] = mState;
    a ^= words[0] ^ mSize, b ^= words[1] ^ mSize;
    a += b, b += a;
    a = finalised(a), b = finalised(b);
    a += b, b += a;
    return {{a, b}};
}

} // namespace curlew
