// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/shader/ShaderText.h"

namespace curlew {

/// Returns GLSL as text in another dialect; unchanged if that is GLSL. Translates types, the names of built-in
/// functions that differ, headers of functions, declarations of one variable with a value, and loops that count up. The
/// text uses nothing else that differs: no conditional operator, no assignment to a parameter, braces around each
/// branch.
std::string translated(const std::string& glsl, Dialect dialect);

} // namespace curlew
