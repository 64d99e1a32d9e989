#pragma once

#include "curlew/base/Error.h"

#include <fmt/format.h>

#include <filesystem>
#include <string>
#include <string_view>

namespace curlew {

/// The mesh file that is being read, for messages.
struct MeshSource {
    const std::filesystem::path& path;

    FileError error(const std::string& what) const {
        return FileError(fmt::format("'{}' cannot be read as a mesh: {}", path.string(), what));
    }
    FileError cutShort() const { return error("it is cut short or damaged; write or copy it again"); }
    FileError noFaces() const { return error("it has no faces; give a surface, not points or curves"); }
    FileError badLine(size_t line, std::string_view why) const {
        return error(fmt::format("line {} {}; it is damaged or of another kind", line, why));
    }
    void checkFinite(size_t bad, size_t points) const {
        if (bad > 0)
            throw error(fmt::format("{} of its {} points have a coordinate that is not a finite number; repair them",
                                    bad, points));
    }
};

/// Checks all of a mesh file ("obj", "ply" or "stl") and returns the number of its faces; what Assimp would stumble
/// over is taken out of an OBJ. Throws FileError.
///
/// Assimp 5.2 is not safe with damaged files: an index out of range, a face of fewer than three corners or a damaged
/// PLY heading ends the process, an odd count in a text PLY loops for ever, and a line of an OBJ that it cannot read is
/// left out, which renumbers all points after it. So each file is checked first, and Assimp sees only what has passed.
size_t checkMesh(std::string& content, std::string_view extension, const MeshSource& source);

} // namespace curlew
