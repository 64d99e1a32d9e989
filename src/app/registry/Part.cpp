// SPDX-License-Identifier: Apache-2.0
#include "curlew/app/registry/Part.h"

#include "curlew/app/registry/Text.h"
#include "curlew/base/Error.h"

#include <fmt/format.h>

namespace curlew::app {

Part partOf(const std::string& text) {
    const auto words = split(text, '/');
    const bool each = words.front() == "each";
    const int number = each ? 0 : wholeNumber(words.front()).value_or(0), count = wholeNumber(words.back()).value_or(0);
    if (words.size() != 2 || count < 1 || number > count || (number < 1 && !each))
        throw ValueError(fmt::format("part={} must be one part of several, as in 3/8 or 8/8", text));
    return {.number = number, .count = count};
}

} // namespace curlew::app
