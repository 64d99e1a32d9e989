// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/app/language/Frames.h"
#include "curlew/app/language/Graph.h"

namespace curlew::app {

/// Throws ValueError if a program would overwrite its own files: a file that it reads and then writes; its checkpoint;
/// or, unless overwrite=1, a file of -write that every frame or part or another -write overwrites. Throws FileError if
/// an input other than those of -read is missing. `before` is the moment before the frames.
/// Ignores nodes that are not `needed`, names that the caller has `provided`, pipes and devices. Checks at most the
/// first 1000 frames.
void requireFileNames(const Graph& graph, const std::optional<FramePlan>& plan, const Moment& before,
                      const std::vector<bool>& needed, const std::vector<bool>& inParts,
                      const std::function<bool(const std::string& name)>& provided);

} // namespace curlew::app
