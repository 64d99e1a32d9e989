// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>

namespace curlew {

/// Returns the memory in bytes that this process can still allocate without swapping: the minimum of the system's
/// available memory, the remainder of its control groups' limits, and the remainder of its address space limit (ulimit
/// -v).
size_t availableMemory();

/// Returns the memory in bytes that remains below the limits of a process's control groups (versions 1 and 2, including
/// all parent groups), or the largest size_t if there is no limit. File pages that can be dropped count as free.
/// `groups` is usually /proc/self/cgroup; `root` is the mount point of the groups, usually /sys/fs/cgroup.
size_t controlGroupMemory(const std::filesystem::path& groups, const std::filesystem::path& root);

/// Returns the peak resident memory of this process so far, in bytes.
size_t peakMemory();

/// Formats a number of bytes for people: "3.2 GiB".
std::string formatBytes(double bytes);

/// Throws ResourceError if `bytes`, the approximate memory that `what` takes, exceeds the available memory. `remedy`
/// tells the user what to do.
void requireMemory(double bytes, const std::string& what, const std::string& remedy);

} // namespace curlew
