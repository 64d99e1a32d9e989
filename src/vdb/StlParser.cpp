// SPDX-License-Identifier: Apache-2.0
#include "MeshParser.h"

#include <bit>
#include <cstring>
#include <numeric>

namespace curlew {

namespace {

/// Makes triangles of three points each.
Polygons triangles(std::vector<openvdb::Vec3s> points, const MeshSource& source) {
    if (points.empty()) throw source.noFaces();
    size_t bad = 0;
    for (const auto& point : points) bad += !point.isFinite();
    source.checkPoints(bad, points.size());
    Polygons polygons;
    polygons.points = std::move(points);
    polygons.corners.resize(polygons.points.size());
    std::iota(polygons.corners.begin(), polygons.corners.end(), uint32_t{0});
    polygons.sizes.assign(polygons.points.size() / 3, 3);
    return polygons;
}

Polygons parseTextStl(std::string_view text, const MeshSource& source) {
    if (!text.starts_with("solid") || text.find('\0') != std::string_view::npos)
        throw source.error(
            "it is neither a text STL nor a binary STL of the size that its header gives; write or copy it again");
    std::vector<openvdb::Vec3s> points;
    size_t number = 0, facets = 0;
    bool closed = false;
    while (!text.empty()) {
        source.check(++number);
        std::string_view line = takeLine(text);
        const std::string_view keyword = takeWord(line);
        if (keyword.empty()) continue;
        closed = keyword == "endsolid";
        if (keyword == "facet") {
            if (points.size() != 3 * facets++)
                throw source.badLine(number, "begins a facet before the last one has three points");
        } else if (keyword == "vertex") {
            openvdb::Vec3s& point = points.emplace_back(0.0f);
            for (int axis = 0; axis < 3; ++axis)
                if (!parse(takeWord(line), point[axis]))
                    throw source.badLine(number, "has a point without three numbers");
            if (points.size() > 3 * facets) throw source.badLine(number, "has one point too many");
        } else if (keyword != "solid" && keyword != "outer" && keyword != "endloop" && keyword != "endfacet" &&
                   !closed) {
            throw source.badLine(number, "does not begin with an STL keyword");
        }
    }
    if (!closed || points.size() != 3 * facets) throw source.cutShort();
    return triangles(std::move(points), source);
}

} // namespace

/// Reads a binary STL: an 80-byte header, the number of triangles, and 50 bytes per triangle (normal, points, 2 bytes).
Polygons parseStl(std::string_view data, const MeshSource& source) {
    static_assert(std::endian::native == std::endian::little, "binary STL is little-endian");
    constexpr size_t kHeader = 84, kNormal = 12, kFacet = 50;
    uint32_t count = 0;
    if (data.size() >= kHeader) std::memcpy(&count, data.data() + kHeader - sizeof count, sizeof count);
    if (data.size() != kHeader + kFacet * count) return parseTextStl(data, source);
    std::vector<openvdb::Vec3s> points(size_t{3} * count);
    for (size_t n = 0; n < count; ++n)
        std::memcpy(points[3 * n].asV(), data.data() + kHeader + kFacet * n + kNormal, 3 * sizeof points[0]);
    return triangles(std::move(points), source);
}

} // namespace curlew
