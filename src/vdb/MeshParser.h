// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "Polygons.h"
#include "curlew/base/Csv.h"
#include "curlew/base/Monitor.h"
#include "curlew/track/Curves.h"

#include <fmt/format.h>

#include <filesystem>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

namespace curlew {

/// Returns the extension of a file name in lower case, with its dot.
std::string extensionOf(const std::filesystem::path& path);

/// Reads a whole file. Throws FileError.
std::string contentOf(const std::filesystem::path& path);

/// The file being read, who waits for it, and what the caller expects in it.
struct MeshSource {
    const std::filesystem::path& path;
    const Monitor& monitor = kUnmonitored;
    std::string_view kind = "a mesh";
    static const Monitor kUnmonitored;

    /// Throws Interrupted at some of the lines, faces or points if the caller has asked to stop.
    void check(size_t line) const {
        if (line % 4096 == 0) monitor.check();
    }

    FileError error(const std::string& what) const {
        return FileError(fmt::format("'{}' cannot be read as {}: {}", path.string(), kind, what));
    }
    FileError cutShort() const { return error("it is cut short or damaged; write or copy it again"); }
    FileError noFaces() const { return error("it has no faces; give a surface, not points or curves"); }
    FileError badLine(size_t line, std::string_view why) const {
        return error(fmt::format("line {} {}; it is damaged or in another format", line, why));
    }
    /// Throws FileError if a point is not finite (`bad` counts them), or if there are too many points.
    void checkPoints(size_t bad, size_t points) const {
        if (points > std::numeric_limits<uint32_t>::max()) throw error("it has more than 2^32 points; split it");
        if (bad > 0)
            throw error(fmt::format("{} of its {} points have a coordinate that is not a finite number; repair them",
                                    bad, points));
    }
};
inline const Monitor MeshSource::kUnmonitored;

// Parsers for a whole file of each kind. They throw FileError if the file is damaged, has no faces, or has a coordinate
// that is not finite. In the result every vertex index is valid, and every face has at least three vertices.

/// Numbers points in the order in which faces use them. Skips normals, UVs, colours, groups and materials.
Polygons parseObj(std::string text, const MeshSource& source);
/// Reads text or binary, little- or big-endian.
Polygons parsePly(std::string_view data, const MeshSource& source);
/// The vertex properties of a .ply without its lists, and its edges. Throws FileError if the file is damaged, a vertex
/// has no x, y and z, or an edge refers to a vertex that does not exist.
struct PlyVertices {
    CsvTable table;
    std::vector<CurveEdge> edges;
};
PlyVertices parsePlyVertices(std::string_view data, const MeshSource& source);
/// Reads text or binary. Each face has three points of its own.
Polygons parseStl(std::string_view data, const MeshSource& source);

// ---- Lines, words and numbers of text files

/// Joins the continued lines of an .obj and makes all its line ends \n.
void unifyLines(std::string& text);

/// Removes and returns the next line of the text, without its line end.
std::string_view takeLine(std::string_view& text);

/// Returns whether the line has no words.
bool isBlank(std::string_view line);

/// Removes and returns the next word of the line; empty at the end of the line.
std::string_view takeWord(std::string_view& line);

/// Parses a word as an integer. Returns false if any part of the word is not.
bool parse(std::string_view word, int64_t& value);

/// Parses a word as a real number. Returns false if any part of the word is not one. "nan", "inf" and numbers out of
/// range give values that are not finite.
///
/// The integral part, the first 15 decimals and the power of ten are each rounded to Real, as in the library that
/// earlier versions used, so meshes stay identical to those of earlier versions. Further decimals are dropped: before
/// the power of ten is applied, a number is off by up to 1e-15, and 1e-16 without an exponent is 0. Apart from that,
/// results are off by up to 2 units in the last place, or more if the power of ten alone is subnormal or out of range.
template <class Real>
bool parse(std::string_view word, Real& value);

} // namespace curlew
