// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/base/Digest.h"
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

/// The version of a UUID that is made from the content (RFC 9562), in its 15th letter.
constexpr char kDigestVersion = '8';

/// A UUID of version 8: 122 bits of the digest, the others say so.
std::string uuidOf(const Digest& digest);

/// Puts zeros where a block that begins at that place of a file has letters of the UUID.
void maskUuid(std::vector<char>& block, std::streamoff begin);

/// What a file will take in memory.
struct VdbSizes {
    double bytes = 0; ///< Of its grids.
};

/// Checks every size in a file before OpenVDB 10.0 reads it, because OpenVDB trusts them: for a wrong one it allocates
/// gigabytes, reads or writes past the end of an array, or ends the program. Each grid must end where the file says. A
/// file of writeVdb() must have the content that its UUID was made from, too. Leaves the stream at its beginning.
/// Throws FileError if the file is damaged, foreign, or of another version.
VdbSizes validateVdb(std::istream& in, const std::filesystem::path& path);

/// Checks the headers of a file and its grids in the same way and returns what they say; if the grids carry no offsets,
/// all of the file is walked to find the next header.
std::vector<GridInfo> validateVdbHeaders(std::istream& in, const std::filesystem::path& path);

/// The kind of a grid of this type and class.
GridKind gridKind(std::string_view type, openvdb::GridClass gridClass);

/// Text from a file as one line of a message.
inline std::string oneLine(std::string text) {
    for (char& c : text)
        if (static_cast<unsigned char>(c) < ' ') c = '?';
    return text;
}

} // namespace curlew
