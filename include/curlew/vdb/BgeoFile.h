// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/track/Curves.h"
#include "curlew/track/Points.h"

#include <filesystem>
#include <functional>
#include <string>
#include <variant>
#include <vector>

namespace curlew {

// Houdini's classic .bgeo: version 5, binary, big-endian, as Houdini up to 11 wrote it and later versions read it
// (GPD.txt of the Houdini Development Kit). The newer .bgeo and .bgeo.sc are other formats.

/// Writes particles as points with the attributes v (vector), id (integer) and, if known, age, life, fade, f and g
/// (floats). Throws ValueError if the arrays differ in length, a position or velocity is not finite, or an id does not
/// fit in 32 bits; FileError as writeAtomically() does; Interrupted once `cancelled` returns true.
void writeBgeo(const std::filesystem::path& path, const Points& particles, const std::function<bool()>& cancelled = {});

/// Writes curves as polylines: open polygons, or closed ones for closed curves. The points have the attributes v,
/// length (time, if the curves are stepped by time), f and g, and the polygons have the attribute id. Curves without
/// vertices are omitted. Errors as above.
void writeBgeo(const std::filesystem::path& path, const Curves& curves, const std::function<bool()>& cancelled = {});

/// The content of a .bgeo.
struct BgeoContent {
    std::variant<Points, Curves> geometry;
    std::vector<std::string> skipped; ///< Names of the point attributes that were ignored.
};

/// Reads points, or curves if there are polygons that are open or have an id. Reads the attributes that writeBgeo()
/// writes, whatever their order; particle systems are read as points. Without ids, points and curves are numbered from
/// 0. Throws FileError, naming the file, if it is missing, damaged or of another version, holds faces or other
/// primitives, or has a position that is not finite; ResourceError if the content would not fit in memory.
BgeoContent readBgeo(const std::filesystem::path& path);

/// Returns whether readBgeo() would return curves, unless it throws. Reads up to the first curve, but not the
/// points. Throws FileError as readBgeo() does.
bool bgeoHasCurves(const std::filesystem::path& path);

} // namespace curlew
