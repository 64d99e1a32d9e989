// SPDX-License-Identifier: Apache-2.0
#include "curlew/base/Text.h"

#include <fmt/format.h>

#include <algorithm>

namespace curlew {

namespace {

unsigned char byteOf(std::string_view text, size_t k) { return static_cast<unsigned char>(text[k]); }

/// Returns the length of the UTF-8 sequence at the start of the text; 0 if it is invalid (Unicode 15, table 3-7).
size_t sequenceLength(std::string_view text) {
    const unsigned char first = byteOf(text, 0);
    if (first < 0x80) return 1;
    const size_t length = first >= 0xc2 && first <= 0xdf ? 2 : first >= 0xe0 && first <= 0xef ? 3 : 4;
    if (first < 0xc2 || first > 0xf4 || text.size() < length) return 0;
    const auto continues = [&](size_t k) { return (byteOf(text, k) & 0xc0) == 0x80; };
    for (size_t k = 1; k < length; ++k)
        if (!continues(k)) return 0;
    const unsigned char second = byteOf(text, 1);
    const bool overlong = (first == 0xe0 && second < 0xa0) || (first == 0xf0 && second < 0x90);
    const bool surrogate = first == 0xed && second > 0x9f, beyond = first == 0xf4 && second > 0x8f;
    return overlong || surrogate || beyond ? 0 : length;
}

/// Returns whether the sequence is a C0 or C1 control or DEL.
bool isControl(std::string_view sequence) {
    const unsigned char first = byteOf(sequence, 0);
    return first < ' ' || first == 0x7f || (first == 0xc2 && byteOf(sequence, 1) < 0xa0);
}

} // namespace

std::string printable(std::string_view text) {
    std::string result;
    while (!text.empty()) {
        const size_t length = sequenceLength(text);
        const std::string_view sequence = text.substr(0, std::max<size_t>(length, 1));
        if (length > 0 && !isControl(sequence))
            result += sequence;
        else
            for (const char c : sequence) result += fmt::format("\\x{:02x}", static_cast<unsigned char>(c));
        text.remove_prefix(sequence.size());
    }
    return result;
}

std::string grouped(uint64_t count) {
    const std::string digits = fmt::format("{}", count);
    std::string result;
    for (size_t k = 0; k < digits.size(); ++k) {
        if (k > 0 && (digits.size() - k) % 3 == 0) result += ',';
        result += digits[k];
    }
    return result;
}

} // namespace curlew
