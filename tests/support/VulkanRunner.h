// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "Catch.h"
#include "curlew/math/Symbol.h"

#include <string>
#include <vector>

namespace curlew::test {

/// Returns why shaders cannot be compiled and run here, or nothing.
std::string whyNoVulkan();

/// Returns whether they cannot, and warns of it.
inline bool skippedWithoutVulkan() {
    const std::string why = whyNoVulkan();
    if (!why.empty()) WARN("skipped: " + why);
    return !why.empty();
}

/// A shader that runs `body` for each i below `count`. The body reads the floats `inputs[]`, calls `functions`, and
/// writes `outputSize` floats to `outputs[]`. The buffers of the functions begin at the binding 2. With `hlsl`, all is
/// HLSL, but the body may use the vectors of GLSL, and `flowZero` is a variable.
struct ShaderRun {
    std::string functions, body;
    std::vector<SymbolBuffer> buffers;
    std::vector<float> inputs;
    size_t count, outputSize;
    bool hlsl = false;
};

/// Compiles a shader with glslang, validates it, runs it on Vulkan's software device, and returns its outputs. Throws
/// std::runtime_error with the compiler's messages.
std::vector<float> runShader(const ShaderRun& run);

} // namespace curlew::test
