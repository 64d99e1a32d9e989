// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/app/language/Graph.h"

namespace curlew::app {

/// Returns warnings about constructs that are valid but rarely intended, each with a suggestion: points that restart in
/// each frame, values that do not change as they seem to, and options without effect; and, if no host reads the results
/// (`alone`), unused shapes and level sets.
std::vector<std::string> adviceOn(const Graph& graph, bool alone);

} // namespace curlew::app
