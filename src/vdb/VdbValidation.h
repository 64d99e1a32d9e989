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

// The header of a .vdb file: magic number (8 bytes), versions of the format and the library (3 × 4), a flag whether
// grids have offsets (1), UUID as text.
constexpr std::streamoff kUuidBegin = 21;
constexpr std::streamoff kUuidLength = 36;

/// The version digit of a UUID derived from the content (RFC 9562), its 15th character.
constexpr char kDigestVersion = '8';

/// Returns a UUID of version 8: 122 bits of the digest, and the bits that mark the version and variant.
std::string uuidOf(const Digest& digest);

/// Replaces the characters of the UUID by zeros in a block that begins at position `begin` of a file.
void maskUuid(std::vector<char>& block, std::streamoff begin);

/// Size of a file's content in memory.
struct VdbSizes {
    double bytes = 0; ///< Bytes of its grids.
};

/// Checks every size in a file before OpenVDB 10.0 reads it. OpenVDB trusts them: a wrong size makes it allocate
/// gigabytes, read or write past the end of an array, or end the program. Each grid must end where the file says. The
/// content of a file that writeVdb() wrote must also match its UUID. Leaves the stream at its beginning. Throws
/// FileError if the file is damaged, foreign, or of another version.
VdbSizes validateVdb(std::istream& in, const std::filesystem::path& path);

/// Checks the headers of a file and its grids in the same way and returns their content. If the grids have no offsets,
/// the whole file is scanned to find the next header.
std::vector<GridInfo> validateVdbHeaders(std::istream& in, const std::filesystem::path& path);

/// Returns the kind of a grid with this type and class.
GridKind gridKind(std::string_view type, openvdb::GridClass gridClass);

/// Makes text from a file safe for a one-line message: replaces control characters by '?'.
inline std::string oneLine(std::string text) {
    for (char& c : text)
        if (static_cast<unsigned char>(c) < ' ') c = '?';
    return text;
}

} // namespace curlew
