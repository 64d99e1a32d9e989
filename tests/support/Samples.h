// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/base/Sanitizer.h"

#include <algorithm>

namespace curlew::test {

inline constexpr bool kSanitized = kAddressSanitizer || kThreadSanitizer;

/// Returns the number of samples that a numerical test takes: `count`, but with sanitizers, which make it up to a
/// hundred times slower, only a sixteenth of it.
template <class Count>
constexpr Count samples(Count count) {
    return kSanitized ? std::max<Count>(count / 16, 1) : count;
}

} // namespace curlew::test
