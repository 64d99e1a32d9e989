// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace curlew {

/// Compiles a compute shader in GLSL 4.50 to SPIR-V for Vulkan 1.1. Throws std::runtime_error with the compiler's
/// messages.
std::vector<uint32_t> spirvOf(const std::string& glsl);

} // namespace curlew
