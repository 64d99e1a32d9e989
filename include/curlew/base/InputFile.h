// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/base/Digest.h"

#include <filesystem>
#include <fstream>

namespace curlew {

/// A binary stream of an existing file that throws std::ios_base::failure if it ends before a read is complete.
/// Throws FileError if there is no such file, it is not a regular file, it cannot be opened or it is empty.
std::ifstream openToRead(const std::filesystem::path& path);

/// The digest of the bytes of a file. Throws FileError as openToRead(), and if the file cannot be read to its end.
Digest digestOf(const std::filesystem::path& path);

} // namespace curlew
