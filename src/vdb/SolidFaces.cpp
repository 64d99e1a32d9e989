// SPDX-License-Identifier: Apache-2.0
#include "SolidFaces.h"

#include "MeshEdges.h"
#include "MeshShells.h"
#include "SolidChecks.h"

#include <tbb/parallel_sort.h>

#include <algorithm>
#include <numeric>
#include <utility>

namespace curlew {

namespace {

using Sides = std::span<const TriangleSide>;

/// Returns for each triangle whether it is part of a sheet. A sheet is a part of the mesh, joined across edges of two
/// triangles, that ends at an open edge, or would if all other sheets were removed.
std::vector<bool> inSheets(const Mesh& mesh) {
    const std::vector<TriangleSide> sides = sidesByEdge(mesh);
    Groups parts(mesh.triangles.size());
    std::vector<Sides> seams; // between parts, or open
    forEachEdge(sides, [&](Sides edge) {
        if (edge.size() == 2)
            parts.join(edge[0].triangle, edge[1].triangle);
        else
            seams.push_back(edge);
    });
    std::vector<std::pair<uint32_t, uint32_t>> around; // each part with the seams around it
    for (uint32_t k = 0; k < seams.size(); ++k)
        for (const TriangleSide& side : seams[k]) around.emplace_back(parts.of(side.triangle), k);
    tbb::parallel_sort(around);
    std::vector<bool> isSheet(mesh.triangles.size(), false); // for the one that stands for its part
    std::vector<uint32_t> unseen(seams.size());
    std::iota(unseen.begin(), unseen.end(), 0u);
    while (!unseen.empty()) {
        const Sides edge = seams[unseen.back()];
        unseen.pop_back();
        const auto stays = [&](const TriangleSide& side) { return !isSheet[parts.of(side.triangle)]; };
        if (std::count_if(edge.begin(), edge.end(), stays) != 1) continue;
        const uint32_t part = parts.of(std::find_if(edge.begin(), edge.end(), stays)->triangle);
        isSheet[part] = true;
        for (auto next = std::lower_bound(around.begin(), around.end(), std::pair(part, 0u));
             next != around.end() && next->first == part; ++next)
            unseen.push_back(next->second);
    }
    for (uint32_t n = 0; n < isSheet.size(); ++n) isSheet[n] = isSheet[parts.of(n)];
    return isSheet;
}

/// Removes triangles that lie between two others, from number `first` on, except those that close a shell: without
/// them, it would have an open edge.
void removeBetween(Mesh& shells, size_t first) {
    const std::vector<TriangleSide> sides = sidesByEdge(shells);
    Groups walls(shells.triangles.size());
    std::vector<bool> closes(shells.triangles.size(), false); // for the one that stands for its wall
    const auto inWall = [&](const TriangleSide& side) { return side.triangle >= first; };
    forEachEdge(sides, [&](Sides edge) { // sorted by triangle: the last are in walls
        for (const TriangleSide& side : edge)
            if (inWall(side)) walls.join(side.triangle, edge.back().triangle);
    });
    forEachEdge(sides, [&](Sides edge) {
        if (std::count_if(edge.begin(), edge.end(), inWall) + 1 == std::ssize(edge) && edge.size() > 1)
            closes[walls.of(edge.back().triangle)] = true;
    });
    size_t left = first;
    for (size_t n = first; n < closes.size(); ++n)
        if (closes[walls.of(static_cast<uint32_t>(n))]) shells.triangles[left++] = shells.triangles[n];
    shells.triangles.resize(left);
}

/// Moves the triangles with a `true` to the end of `to`.
void move(Mesh& from, const std::vector<bool>& which, Mesh& to) {
    size_t left = 0;
    for (size_t n = 0; n < which.size(); ++n)
        (which[n] ? to.triangles.emplace_back() : from.triangles[left++]) = from.triangles[n];
    from.triangles.resize(left);
}

/// Separates closed shells from sheets, and makes neighbours in either agree. `pairs`: as from distinctTriangles().
void separate(SolidFaces& faces, const std::vector<openvdb::Vec3I>& pairs) {
    auto& triangles = faces.triangles.triangles;
    const size_t distinct = triangles.size();
    triangles.insert(triangles.end(), pairs.begin(), pairs.end());
    const std::vector<bool> isSheet = inSheets(faces.triangles);
    const auto open =
        static_cast<size_t>(std::count(isSheet.begin(), isSheet.begin() + static_cast<std::ptrdiff_t>(distinct), true));
    Mesh sheets{.points = {}, .triangles = {}, .quads = {}};
    move(faces.triangles, isSheet, sheets);
    sheets.triangles.resize(open); // without pairs
    removeBetween(faces.triangles, distinct - open);
    // Of a pair between a shell and a sheet, either has one.
    sheets.triangles.insert(sheets.triangles.end(), triangles.begin() + static_cast<std::ptrdiff_t>(distinct - open),
                            triangles.end());
    faces.duplicates -= 2 * (sheets.triangles.size() - open);
    faces.reversed = orient(faces.triangles, distinct - open) + orient(sheets, open);
    faces.closed = triangles.size();
    faces.oriented = open == 0 && isOriented(faces.triangles);
    triangles.insert(triangles.end(), sheets.triangles.begin(), sheets.triangles.end());
}

} // namespace

Mesh SolidFaces::closedOnes() const {
    Mesh mesh = triangles;
    mesh.triangles.resize(closed);
    return mesh;
}

Mesh SolidFaces::openOnes() const {
    Mesh mesh = triangles;
    mesh.triangles.erase(mesh.triangles.begin(), mesh.triangles.begin() + static_cast<std::ptrdiff_t>(closed));
    return mesh;
}

SolidFaces solidFacesOf(const Mesh& mesh, const MeshTopology& topology, const Monitor& monitor) {
    const auto manifold = [](const MeshTopology& t) { return t.closed() && t.nonManifoldEdges == 0; };
    const bool plain = manifold(topology);
    SolidFaces faces;
    std::vector<openvdb::Vec3I> pairs;
    faces.triangles = plain ? inTriangles(mesh) : distinctTriangles(mesh, faces.duplicates, pairs);
    const MeshTopology joined = plain ? topology : topologyOf(faces.triangles);
    faces.boundaryEdges = joined.boundaryEdges;
    faces.manifold = manifold(joined);
    faces.oriented = isOriented(faces.triangles);
    if (faces.oriented)
        faces.closed = faces.triangles.triangles.size();
    else
        separate(faces, pairs);
    faces.turnedShells = turnProtruding(faces, monitor);
    return faces;
}

} // namespace curlew
