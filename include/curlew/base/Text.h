// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace curlew {

/// Returns the text as valid UTF-8 on one line. Control characters and bytes that are not UTF-8 are escaped as \xNN.
/// File names may contain both: a terminal would interpret the control characters, and JSON and SVG cannot hold invalid
/// bytes.
std::string printable(std::string_view text);

/// Formats a count for people: "1,234,567".
std::string grouped(uint64_t count);

} // namespace curlew
