#pragma once

#include <filesystem>
#include <fstream>

namespace curlew {

/// A binary stream of an existing file that throws std::ios_base::failure if it ends before a read is complete.
/// Throws FileError if there is no such file, it is not a regular file, it cannot be opened or it is empty.
std::ifstream openToRead(const std::filesystem::path& path);

} // namespace curlew
