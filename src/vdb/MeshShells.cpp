// SPDX-License-Identifier: Apache-2.0
#include "MeshShells.h"

#include "SolidBoundary.h"
#include "SolidChecks.h"
#include "WindingMoments.h"
#include "curlew/vdb/Openvdb.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace curlew {

namespace {

using openvdb::Index32;

constexpr size_t kMinFaces = 4;  ///< No closed shell has fewer.
constexpr size_t kExamined = 32; ///< Triangles of a shell.

/// Returns whether both sides of a triangle are inside the solid.
bool isHidden(const Mesh& mesh, size_t face, const WindingNumber& winding) {
    const winding::Triangle triangle = winding::triangleOf(mesh, face);
    const double size = std::sqrt(length(triangle.area()));
    if (!(size > 0)) return true;
    const auto [above, below] = winding.beside(triangle.middle(), triangle.area() * (1e-3 / size));
    return SolidBoundary::isInside(above) && SolidBoundary::isInside(below);
}

} // namespace

MeshShells shellsOf(const Mesh& mesh) {
    std::vector<Index32> parent(mesh.points.size());
    std::iota(parent.begin(), parent.end(), 0u);
    const auto root = [&](Index32 n) {
        while (parent[n] != n) n = parent[n] = parent[parent[n]];
        return n;
    };
    for (const auto& t : mesh.triangles)
        for (int k = 1; k < 3; ++k) parent[root(t[k])] = root(t[0]);
    constexpr uint32_t kNone = ~uint32_t{0};
    MeshShells shells;
    std::vector<uint32_t> numbers(mesh.points.size(), kNone);
    shells.ofTriangle.reserve(mesh.triangles.size());
    for (const auto& t : mesh.triangles) {
        uint32_t& number = numbers[root(t[0])];
        if (number == kNone) number = static_cast<uint32_t>(shells.count++);
        shells.ofTriangle.push_back(number);
    }
    return shells;
}

FilledShells filledShells(const Mesh& mesh, const WindingNumber& winding, const Monitor& monitor) {
    const MeshShells shells = shellsOf(mesh);
    if (shells.count < 2) return {};
    // The triangles by shell: those of shell k are order[first[k]] to order[first[k + 1] - 1].
    std::vector<size_t> first(shells.count + 1, 0), order(mesh.triangles.size());
    for (const uint32_t shell : shells.ofTriangle) ++first[shell + 1];
    std::partial_sum(first.begin(), first.end(), first.begin());
    std::vector<size_t> next(first.begin(), first.end() - 1);
    for (size_t face = 0; face < order.size(); ++face) order[next[shells.ofTriangle[face]]++] = face;

    FilledShells filled;
    for (size_t shell = 0; shell < shells.count; ++shell) {
        const size_t faces = first[shell + 1] - first[shell];
        if (faces < kMinFaces) continue;
        monitor.check();
        bool hidden = true;
        for (size_t k = 0; k < std::min(faces, kExamined) && hidden; ++k)
            hidden = isHidden(mesh, order[first[shell] + k * faces / std::min(faces, kExamined)], winding);
        if (!hidden) continue;
        Mesh part{.points = mesh.points, .triangles = {}, .quads = {}};
        for (size_t k = first[shell]; k < first[shell + 1]; ++k) part.triangles.push_back(mesh.triangles[order[k]]);
        if (!topologyOf(part).closed()) continue;
        ++filled.count;
        filled.faces += faces;
        filled.volume += std::abs(volumeOf(part));
    }
    return filled;
}

} // namespace curlew
