// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/base/Error.h"

#include <fmt/format.h>

#include <cmath>
#include <string_view>

namespace curlew {

/// Throws ValueError, naming `what`, if the value is not positive and finite.
inline void requirePositive(double value, std::string_view what) {
    if (!(value > 0) || !std::isfinite(value))
        throw ValueError(fmt::format("{} is {}; it must be positive and finite", what, value));
}

} // namespace curlew
