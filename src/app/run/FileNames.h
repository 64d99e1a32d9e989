// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/app/language/Frames.h"
#include "curlew/app/language/Graph.h"

namespace curlew::app {

/// Throws ValueError for names of files by which a program would lose its own work: a file that it reads and then
/// writes, and one that it writes anew in each frame, unless overwrite=1. Nodes that are not `needed` do not count, nor
/// do names that are `provided` by the caller, and pipes and devices are written to as often as asked for. Of a longer
/// range, the first 1000 frames are looked at.
void requireFileNames(const Graph& graph, const std::optional<FramePlan>& plan, const std::vector<bool>& needed,
                      const std::function<bool(const std::string& name)>& provided);

} // namespace curlew::app
