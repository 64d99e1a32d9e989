// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace curlew {

/// Returns the text as valid UTF-8 on one line. Control characters and bytes that are not UTF-8 are escaped as \xNN.
/// File names may contain both: a terminal would interpret the control characters, and JSON and SVG cannot hold invalid
/// bytes.
std::string printable(std::string_view text);

/// Formats a count for people: "1,234,567".
std::string grouped(uint64_t count);

/// Returns the candidate with the smallest edit distance from `given` (insertion, deletion, replacement, swap of
/// neighbours), or "" if no candidate is close enough to be a typing error. Ignores case.
std::string nearest(std::string_view given, const std::vector<std::string>& candidates);

/// Returns " (did you mean 'x'?)", or "" if no candidate is close.
std::string didYouMean(std::string_view word, const std::vector<std::string>& candidates);

} // namespace curlew
