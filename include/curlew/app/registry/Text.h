// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace curlew::app {

/// The candidate with the fewest edits from `given` (insert, delete, replace, swap of neighbours), if they are few
/// enough to be a slip; else "". Upper and lower case count as the same.
std::string nearest(std::string_view given, const std::vector<std::string>& candidates);

/// " (did you mean 'x'?)" or "".
std::string didYouMean(std::string_view word, const std::vector<std::string>& candidates);

std::vector<std::string> split(std::string_view text, char separator);
std::string join(const std::vector<std::string>& parts, std::string_view separator);

/// The text with line breaks instead of some of its spaces, so that no line is longer than `width` bytes where that can
/// be, and each begins with `indent` spaces.
std::string wrapped(std::string_view text, size_t indent, size_t width);

/// The words of a line: separated by white space; "…" and '…' keep what is in them; # starts a comment.
/// Throws ValueError for a quote that does not end.
std::vector<std::string> wordsOf(std::string_view line);

/// Text as a number. The whole text has to be one; infinities and NaN are not. False otherwise.
bool parseReal(std::string_view text, double& value);

} // namespace curlew::app
