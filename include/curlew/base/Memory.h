// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>

namespace curlew {

/// Memory that this process can still get without swapping, in bytes: the least of what the system has available, what
/// is left of the limits of its control groups, and of that on its address space (ulimit -v).
size_t availableMemory();

/// The memory that is left of the limits of the control groups of a process (versions 1 and 2, with all groups around
/// them), in bytes; the largest size_t if there is no limit. Pages of files that can be dropped count as left.
/// `groups`: /proc/self/cgroup. `root`: where the groups are mounted, /sys/fs/cgroup.
size_t controlGroupMemory(const std::filesystem::path& groups, const std::filesystem::path& root);

/// The most memory that this process has held so far, in bytes.
size_t peakMemory();

/// "3.2 GiB"
std::string formatBytes(double bytes);

/// Throws ResourceError if `what`, which takes about `bytes`, does not fit the available memory. `remedy` says what to
/// do.
void requireMemory(double bytes, const std::string& what, const std::string& remedy);

} // namespace curlew
