// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/base/Digest.h"

#include <filesystem>
#include <fstream>

namespace curlew {

/// Opens an existing file as a binary stream. The stream throws std::ios_base::failure if the file ends before a read
/// is complete. Throws FileError if the file does not exist, is not a regular file, cannot be opened or is empty.
std::ifstream openToRead(const std::filesystem::path& path);

/// Returns the digest of a file's bytes. Throws FileError like openToRead(), and if the file cannot be read to its end.
Digest digestOf(const std::filesystem::path& path);

} // namespace curlew
