#pragma once

#include "curlew/vdb/VdbFile.h"

#include <filesystem>
#include <istream>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace curlew {

// The header of a .vdb file: magic number (8 bytes), version of the format and of the library (3 × 4), whether the
// grids carry offsets (1), UUID as text.
constexpr std::streamoff kUuidBegin = 21;
constexpr std::streamoff kUuidLength = 36;

/// Checks every size in a file before OpenVDB 10.0 reads it, because OpenVDB trusts them: for a wrong one it allocates
/// gigabytes or writes past the end of an array. The leaves of point, mask and bool grids are not checked. Leaves the
/// stream at its beginning. Throws FileError if the file is damaged, foreign, or of another version.
void validateVdb(std::istream& in, const std::filesystem::path& path);

/// Checks the headers of a file and its grids in the same way and returns what they say; nullopt if the grids carry no
/// offsets, so that the trees would have to be read to find the next header.
std::optional<std::vector<GridInfo>> validateVdbHeaders(std::istream& in, const std::filesystem::path& path);

/// The kind of a grid of this type and class.
GridKind gridKind(std::string_view type, openvdb::GridClass gridClass);

/// Text from a file as one line of a message.
inline std::string oneLine(std::string text) {
    for (char& c : text)
        if (static_cast<unsigned char>(c) < ' ') c = '?';
    return text;
}

} // namespace curlew
