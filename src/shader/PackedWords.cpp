// SPDX-License-Identifier: Apache-2.0
#include "PackedWords.h"

#include "curlew/base/Error.h"

#include <zlib.h>

#include <algorithm>
#include <string_view>

namespace curlew {

namespace {

std::string planesOf(const std::vector<uint32_t>& words) {
    const size_t count = words.size();
    std::string planes(4 * count, '\0');
    uint32_t last = 0;
    for (size_t k = 0; k < count; ++k) {
        const uint32_t difference = words[k] - last;
        const uint32_t folded = (difference << 1) ^ (difference >> 31 ? 0xffffffff : 0);
        for (size_t plane = 0; plane < 4; ++plane)
            planes[plane * count + k] = static_cast<char>(folded >> (8 * plane) & 0xff);
        last = words[k];
    }
    return planes;
}

std::string compressed(std::string bytes) {
    z_stream stream{};
    constexpr int kWindow = 15, kGzip = 16, kMemory = 8;
    if (deflateInit2(&stream, Z_DEFAULT_COMPRESSION, Z_DEFLATED, kWindow + kGzip, kMemory, Z_DEFAULT_STRATEGY) != Z_OK)
        throw ResourceError("not enough memory to compress the data of a page");
    std::string packed(deflateBound(&stream, bytes.size()), '\0');
    stream.next_in = reinterpret_cast<Bytef*>(bytes.data()); // NOLINT: zlib's bytes
    stream.avail_in = static_cast<uInt>(bytes.size());
    stream.next_out = reinterpret_cast<Bytef*>(packed.data()); // NOLINT
    stream.avail_out = static_cast<uInt>(packed.size());
    deflate(&stream, Z_FINISH); // always ends: there is room for all
    packed.resize(stream.total_out);
    deflateEnd(&stream);
    return packed;
}

std::string base64(const std::string& bytes) {
    constexpr std::string_view kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string text;
    text.reserve((bytes.size() + 2) / 3 * 4);
    for (size_t k = 0; k < bytes.size(); k += 3) {
        const size_t have = std::min<size_t>(bytes.size() - k, 3);
        uint32_t word = 0;
        for (size_t i = 0; i < 3; ++i) word = word << 8 | (i < have ? static_cast<unsigned char>(bytes[k + i]) : 0u);
        for (size_t i = 0; i < 4; ++i) text += i <= have ? kDigits[word >> (18 - 6 * i) & 63] : '=';
    }
    return text;
}

} // namespace

std::string packedWords(const std::vector<uint32_t>& words) { return base64(compressed(planesOf(words))); }

} // namespace curlew
