// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/base/Text.h"

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace curlew::app {

std::vector<std::string> split(std::string_view text, char separator);
std::string join(const std::vector<std::string>& parts, std::string_view separator);

/// Wraps the text at spaces, so that lines have at most `width` bytes if possible. Each line begins with `indent`
/// spaces.
std::string wrapped(std::string_view text, size_t indent, size_t width);

/// Splits a line into words at white space. "…" and '…' quote a word; # starts a comment.
/// Throws ValueError if a quote is not closed.
std::vector<std::string> wordsOf(std::string_view line);

inline constexpr int kMostWhole = 10'000'000;

/// Parses the whole text as a number from 0 to kMostWhole, without a sign. Returns nullopt if it is not one.
std::optional<int> wholeNumber(std::string_view text);

/// Parses the whole text as a finite number. Returns false if it is not one.
bool parseReal(std::string_view text, double& value);

} // namespace curlew::app
