// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/shader/FlowShader.h"

namespace curlew {

/// Returns the functions that a host calls, in a dialect: flowVelocity() … flowAdvance(), made of the functions of
/// FlowShaderOptions::parts. Each calls the flow at one place, in a loop if it needs it more than once, because
/// compilers put every call in line.
template <int N>
std::string stepText(const FlowN<N>& flow, const FlowShaderOptions& options);

} // namespace curlew
