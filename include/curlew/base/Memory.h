#pragma once

#include <cstddef>
#include <string>

namespace curlew {

/// Memory that this process can still get without swapping, in bytes: what the system has available, or what is left of
/// the limit of its control group, whichever is less.
size_t availableMemory();

/// The most memory that this process has held so far, in bytes.
size_t peakMemory();

/// "3.2 GiB"
std::string formatBytes(double bytes);

/// Throws ResourceError if `what`, which takes about `bytes`, does not fit the available memory. `remedy` says what to
/// do.
void requireMemory(double bytes, const std::string& what, const std::string& remedy);

} // namespace curlew
