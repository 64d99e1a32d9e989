// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/vdb/HostProfile.h"

#include <filesystem>
#include <string>
#include <vector>

namespace curlew {

/// Returns what a .vdb file lacks for a host, one sentence each: the name, type, class and vector type of its velocity
/// grid, a density beside it, point grids that the host does not read, and the frame rate if the file's name ends in a
/// number. Reads the headers and the metadata only. Throws FileError as vdbContents() does. Safe to call from several
/// threads.
std::vector<std::string> hostProblems(const std::filesystem::path& vdb, const HostProfile& host);

} // namespace curlew
