// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/shader/ShaderText.h"

namespace curlew {

/// Returns the helper functions that a text calls, and those that these call.
std::string preambleFor(const std::string& text, Dialect dialect, ShaderCoordinates coordinates);

} // namespace curlew
