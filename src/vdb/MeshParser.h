// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "Polygons.h"
#include "curlew/base/Csv.h"
#include "curlew/base/Error.h"

#include <fmt/format.h>

#include <filesystem>
#include <limits>
#include <string>
#include <string_view>

namespace curlew {

/// The extension of a file's name in lower case, with its dot.
std::string extensionOf(const std::filesystem::path& path);

/// All of a file. Throws FileError.
std::string contentOf(const std::filesystem::path& path);

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
    /// Throws FileError if some of the points are not finite, or if there are too many.
    void checkPoints(size_t bad, size_t points) const {
        if (points > std::numeric_limits<uint32_t>::max()) throw error("it has more than 2^32 points; split it");
        if (bad > 0)
            throw error(fmt::format("{} of its {} points have a coordinate that is not a finite number; repair them",
                                    bad, points));
    }
};

// The faces of a whole file of each kind. Throws FileError if the file is damaged, has no faces, or has a coordinate
// that is not finite: every corner of the result is a point, every face has three corners or more.

/// Points are numbered in the order in which faces use them. Normals, UVs, colours, groups and materials are skipped.
Polygons parseObj(std::string text, const MeshSource& source);
/// Text or binary, little- or big-endian.
Polygons parsePly(std::string_view data, const MeshSource& source);
/// The properties of the vertices of a .ply, but for lists, and its other elements' names. Throws FileError if it is
/// damaged or a vertex has no x, y and z.
struct PlyVertices {
    CsvTable table;
    std::vector<std::string> others;
};
PlyVertices parsePlyVertices(std::string_view data, const MeshSource& source);
/// Text or binary. Each face has three points of its own.
Polygons parseStl(std::string_view data, const MeshSource& source);

// ---- Lines, words and numbers of text files

/// Takes the next line off the text, without its end.
std::string_view takeLine(std::string_view& text);

/// Whether there is no word.
bool isBlank(std::string_view line);

/// Takes the next word off the line; empty at its end.
std::string_view takeWord(std::string_view& line);

/// Returns whether the whole word is an integer, and which.
bool parse(std::string_view word, int64_t& value);

/// Returns whether the whole word is a real number, and which; "nan", "inf" and numbers out of range are numbers that
/// are not finite.
///
/// The integral part, the first 15 decimals and the power of ten are each rounded to Real, as by the library with which
/// earlier versions read meshes: up to 2 units in the last place off, and the same meshes as ever.
template <class Real>
bool parse(std::string_view word, Real& value);

} // namespace curlew
