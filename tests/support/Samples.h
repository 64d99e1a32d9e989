// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/base/Sanitizer.h"

#include <algorithm>
#include <cstddef>

namespace curlew::test {

inline constexpr bool kSanitized = kAddressSanitizer || kThreadSanitizer;

/// Returns the number of samples that a numerical test takes: `count`, but with sanitizers, which make it up to a
/// hundred times slower, only a sixteenth of it.
constexpr size_t samples(size_t count) { return kSanitized ? std::max<size_t>(count / 16, 1) : count; }

} // namespace curlew::test
