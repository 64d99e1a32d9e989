// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace curlew {

/// Returns words as text that a page can unpack: differences between neighbours, with the sign in the lowest bit; the
/// four bytes of all, one plane after the other; compressed (gzip), in base64. Throws ResourceError without memory.
std::string packedWords(const std::vector<uint32_t>& words);

} // namespace curlew
