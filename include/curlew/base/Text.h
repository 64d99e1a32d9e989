// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace curlew {

/// The text as valid UTF-8 on one line: control characters and bytes that are no UTF-8 are escaped as \xNN. File names
/// may hold either; a terminal would act on the former, and JSON and SVG cannot hold the latter.
std::string printable(std::string_view text);

/// A count for people: "1,234,567".
std::string grouped(uint64_t count);

} // namespace curlew
