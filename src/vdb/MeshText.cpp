// SPDX-License-Identifier: Apache-2.0
#include "MeshParser.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>

namespace curlew {

namespace {

bool isSpace(char c) { return c == ' ' || c == '\t' || c == '\r'; }

std::string_view takeDigits(std::string_view& text) {
    const auto end = std::find_if(text.begin(), text.end(), [](char c) { return c < '0' || c > '9'; });
    const std::string_view digits(text.begin(), end);
    text.remove_prefix(digits.size());
    return digits;
}

constexpr size_t kDigits = 19; // digits that fit in 64 bits

uint64_t valueOf(std::string_view digits) {
    uint64_t value = 0;
    for (const char c : digits.substr(0, kDigits)) value = 10 * value + static_cast<uint64_t>(c - '0');
    return value;
}

} // namespace

std::string_view takeLine(std::string_view& text) {
    const size_t end = std::min(text.find('\n'), text.size());
    const std::string_view line = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    return line;
}

bool isBlank(std::string_view line) { return std::all_of(line.begin(), line.end(), isSpace); }

std::string_view takeWord(std::string_view& line) {
    const auto begin = std::find_if_not(line.begin(), line.end(), isSpace);
    const auto end = std::find_if(begin, line.end(), isSpace);
    const std::string_view word(begin, end);
    line.remove_prefix(static_cast<size_t>(end - line.begin()));
    return word;
}

bool parse(std::string_view word, int64_t& value) {
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    return error == std::errc() && end == word.data() + word.size();
}

template <class Real>
bool parse(std::string_view word, Real& value) {
    static constexpr std::array kTenths{1e0,  1e-1, 1e-2,  1e-3,  1e-4,  1e-5,  1e-6,  1e-7,
                                        1e-8, 1e-9, 1e-10, 1e-11, 1e-12, 1e-13, 1e-14, 1e-15};
    if (word.starts_with('+')) word.remove_prefix(1);
    const bool negative = word.starts_with('-');
    std::string_view rest = word.substr(negative ? 1 : 0);
    const std::string_view whole = takeDigits(rest);
    std::string_view fraction;
    if (rest.starts_with('.')) {
        rest.remove_prefix(1);
        fraction = takeDigits(rest);
    }
    if (whole.size() + fraction.size() == 0 || whole.size() > kDigits) { // "nan", "inf" or a very large number
        const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
        if (error == std::errc::result_out_of_range) value = std::numeric_limits<Real>::infinity();
        return error != std::errc::invalid_argument && end == word.data() + word.size();
    }
    value = static_cast<Real>(valueOf(whole));
    fraction = fraction.substr(0, kTenths.size() - 1);
    if (!fraction.empty())
        value += static_cast<Real>(static_cast<double>(valueOf(fraction)) * kTenths[fraction.size()]);
    if (rest.starts_with('e') || rest.starts_with('E')) {
        rest.remove_prefix(1);
        const bool small = rest.starts_with('-');
        if (small || rest.starts_with('+')) rest.remove_prefix(1);
        const std::string_view exponent = takeDigits(rest);
        if (exponent.empty()) return false;
        const auto power = static_cast<Real>(valueOf(exponent));
        value *= std::pow(Real(10), small ? -power : power);
    }
    if (negative) value = -value;
    return rest.empty();
}

template bool parse(std::string_view word, float& value);
template bool parse(std::string_view word, double& value);

} // namespace curlew
