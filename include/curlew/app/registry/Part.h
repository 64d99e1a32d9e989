// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>

namespace curlew::app {

/// One of several parts of a whole, or each of them.
struct Part {
    int64_t number = 1; ///< From 1; 0: each of them, one after the other.
    int64_t count = 1;

    bool operator==(const Part&) const = default;
};

/// Reads "3/8", the third of eight parts, or "each/8". Throws ValueError if there is no such part.
Part partOf(const std::string& text);

} // namespace curlew::app
