// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/app/registry/Json.h"

#include <string>
#include <string_view>

namespace curlew::app {

/// Returns a figure in the report by its path, such as "check/outside". Throws ValueError, listing the existing names,
/// if the path does not lead to a number.
double figureOf(const Json& report, const std::string& path);

/// Replaces each [path] in a text by its figure, with 3 significant digits if it is a floating-point number, and [[ by
/// [. Throws ValueError as figureOf() does, and if a [ is not closed.
std::string withFigures(const Json& report, std::string_view text);

} // namespace curlew::app
