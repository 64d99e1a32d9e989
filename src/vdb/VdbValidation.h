#pragma once

#include <filesystem>
#include <istream>
#include <string>

namespace curlew {

// The head of a .vdb file: magic number (8 bytes), version of the format and of the library (3 × 4), whether the grids
// carry offsets (1), UUID as text.
constexpr std::streamoff kUuidBegin = 21;
constexpr std::streamoff kUuidLength = 36;

/// Walks through a file before OpenVDB 10.0 reads it, because OpenVDB trusts every size that it finds: for a wrong one
/// it allocates gigabytes or writes past the end of an array. Only what is in the leaves of point, mask and bool grids
/// is not looked at.
/// Leaves the stream at its beginning. Throws FileError for a file that is damaged, foreign, or of another version.
void validateVdb(std::istream& in, const std::filesystem::path& path);

/// Text out of a file, fit for a line of a message.
inline std::string oneLine(std::string text) {
    for (char& c : text)
        if (static_cast<unsigned char>(c) < ' ') c = '?';
    return text;
}

} // namespace curlew
