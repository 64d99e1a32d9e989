// SPDX-License-Identifier: Apache-2.0
#include "curlew/base/Text.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>

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

std::string lowerCase(std::string_view text) {
    std::string lower(text);
    for (char& c : lower) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    return lower;
}

size_t editDistance(std::string_view a, std::string_view b) {
    std::vector<std::vector<size_t>> d(a.size() + 1, std::vector<size_t>(b.size() + 1));
    for (size_t i = 0; i <= a.size(); ++i) d[i][0] = i;
    for (size_t j = 0; j <= b.size(); ++j) d[0][j] = j;
    for (size_t i = 1; i <= a.size(); ++i)
        for (size_t j = 1; j <= b.size(); ++j) {
            d[i][j] = std::min({d[i - 1][j] + 1, d[i][j - 1] + 1, d[i - 1][j - 1] + (a[i - 1] != b[j - 1])});
            if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1])
                d[i][j] = std::min(d[i][j], d[i - 2][j - 2] + 1);
        }
    return d[a.size()][b.size()];
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

std::string nearest(std::string_view given, const std::vector<std::string>& candidates) {
    const std::string word = lowerCase(given);
    std::string best;
    size_t fewest = std::max<size_t>(1, word.size() / 3) + 1;
    for (const auto& candidate : candidates) {
        const std::string known = lowerCase(candidate);
        const bool contained = word.size() >= 3 && (known.starts_with(word) || word.starts_with(known));
        const size_t edits = contained && word != known ? 1 : editDistance(word, known);
        if (edits < fewest) {
            fewest = edits;
            best = candidate;
        }
    }
    return best;
}

std::string didYouMean(std::string_view word, const std::vector<std::string>& candidates) {
    const std::string near = nearest(word, candidates);
    return near.empty() ? "" : fmt::format(" (did you mean '{}'?)", near);
}

} // namespace curlew
