// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/app/language/Graph.h"

namespace curlew::app {

/// What is legal in a program and hardly ever meant, each with what to do: points that begin anew in each frame; and,
/// if nobody looks at the results but the program itself (`alone`), shapes and level sets that nothing uses.
std::vector<std::string> adviceOn(const Graph& graph, bool alone);

} // namespace curlew::app
