// SPDX-License-Identifier: Apache-2.0
#include "MeshShells.h"

#include "MeshEdges.h"
#include "WindingMoments.h"
#include "curlew/vdb/Openvdb.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <optional>
#include <span>

namespace curlew {

namespace {

using openvdb::Index32;

constexpr size_t kMinFaces = 4;  ///< No closed shell has fewer.
constexpr size_t kExamined = 32; ///< Triangles of a shell.

/// Returns the k-th of the triangles to examine, k < kExamined. Steps of the golden ratio, since equal ones may meet
/// the same place of each ring of faces.
size_t examined(size_t k, size_t faces) {
    if (faces <= kExamined) return k;
    const double turns = static_cast<double>(k) * (std::numbers::phi - 1);
    return static_cast<size_t>((turns - std::floor(turns)) * static_cast<double>(faces));
}

/// Returns whether both sides of a triangle are inside the solid.
bool isHidden(const Mesh& mesh, size_t face, const SolidWinding& winding) {
    const winding::Triangle triangle = winding::triangleOf(mesh, face);
    const double size = std::sqrt(length(triangle.area()));
    if (!(size > 0)) return true;
    const auto [above, below] = winding.beside(triangle.middle(), triangle.area() * (1e-3 / size));
    return SolidWinding::isInside(above) && SolidWinding::isInside(below);
}

} // namespace

MeshShells shellsOf(const Mesh& mesh) {
    Groups joined(mesh.points.size());
    for (const auto& t : mesh.triangles)
        for (int k = 1; k < 3; ++k) joined.join(t[k], t[0]);
    constexpr uint32_t kNone = ~uint32_t{0};
    MeshShells shells;
    std::vector<uint32_t> numbers(mesh.points.size(), kNone);
    shells.ofTriangle.reserve(mesh.triangles.size());
    for (const auto& t : mesh.triangles) {
        uint32_t& number = numbers[joined.of(t[0])];
        if (number == kNone) number = static_cast<uint32_t>(shells.count++);
        shells.ofTriangle.push_back(number);
    }
    return shells;
}

namespace {

/// The triangles by shell.
struct ByShell {
    explicit ByShell(const MeshShells& shells) : first(shells.count + 1, 0), order(shells.ofTriangle.size()) {
        for (const uint32_t shell : shells.ofTriangle) ++first[shell + 1];
        std::partial_sum(first.begin(), first.end(), first.begin());
        std::vector<size_t> next(first.begin(), first.end() - 1);
        for (size_t face = 0; face < order.size(); ++face) order[next[shells.ofTriangle[face]]++] = face;
    }
    std::span<const size_t> of(size_t shell) const {
        return std::span(order).subspan(first[shell], first[shell + 1] - first[shell]);
    }

    std::vector<size_t> first, order; ///< Those of shell k are order[first[k]] to order[first[k + 1] - 1].
};

/// Returns the part of a shell's triangles that is outside the other shells. `inward`: the shell's faces point inward.
/// `open`: of the open shells, if there are any.
double outsideOthers(const Mesh& mesh, std::span<const size_t> faces, bool inward, const WindingNumber& closed,
                     const std::optional<WindingNumber>& open) {
    const size_t count = std::min(faces.size(), kExamined);
    size_t outside = 0;
    for (size_t k = 0; k < count; ++k) {
        const winding::Triangle triangle = winding::triangleOf(mesh, faces[examined(k, faces.size())]);
        const double size = std::sqrt(length(triangle.area()));
        if (!(size > 0)) continue;
        const auto [above, below] = closed.beside(triangle.middle(), triangle.area() * (1e-3 / size));
        const double others = 0.5 * (above + below) + (inward ? 0.5 : -0.5); // without the shell itself
        if (SolidWinding::isInside(others) || (open && SolidWinding::isInside(open->at(triangle.middle())))) continue;
        ++outside;
    }
    return static_cast<double>(outside) / static_cast<double>(count);
}

/// Returns the signed volumes of the shells.
std::vector<double> volumesOf(const Mesh& mesh, const MeshShells& shells) {
    std::vector<double> volumes(shells.count, 0);
    const openvdb::Vec3d middle = openvdb::Vec3d(mesh.points[mesh.triangles.front()[0]]);
    for (size_t n = 0; n < mesh.triangles.size(); ++n) {
        const auto& t = mesh.triangles[n];
        const openvdb::Vec3d p = openvdb::Vec3d(mesh.points[t[0]]) - middle,
                             q = openvdb::Vec3d(mesh.points[t[1]]) - middle,
                             r = openvdb::Vec3d(mesh.points[t[2]]) - middle;
        volumes[shells.ofTriangle[n]] += p.dot(q.cross(r)) / 6;
    }
    return volumes;
}

/// Returns whether a shell lies within those of `winding`: w is 1/2 on average, and more than 1/4 nearly everywhere.
bool isWithin(const Mesh& mesh, std::span<const size_t> faces, const WindingNumber& winding) {
    const size_t count = std::min(faces.size(), kExamined);
    double sum = 0, outside = 0;
    for (size_t k = 0; k < count; ++k) {
        const double w = winding.at(winding::triangleOf(mesh, faces[examined(k, faces.size())]).middle());
        sum += w;
        outside += w > 0.25 ? 0 : 1;
    }
    return sum > 0.5 * static_cast<double>(count) && outside <= 0.1 * static_cast<double>(count);
}

} // namespace

size_t turnProtruding(SolidFaces& faces, const Monitor& monitor) {
    constexpr double kOutside = 0.1;
    const Mesh mesh = faces.closedOnes();
    const MeshShells shells = shellsOf(mesh);
    if (shells.count < 2) return 0;
    const std::vector<double> volumes = volumesOf(mesh, shells);
    const double largest =
        *std::max_element(volumes.begin(), volumes.end(), [](double a, double b) { return std::abs(a) < std::abs(b); });
    const auto against = [&](double volume) { return volume * largest < 0; };
    if (std::none_of(volumes.begin(), volumes.end(), against)) return 0;
    const WindingNumber closed(mesh, monitor);
    std::optional<WindingNumber> open;
    if (faces.hasOpen()) open.emplace(faces.openOnes(), monitor);
    const ByShell triangles(shells);
    size_t turned = 0;
    for (size_t shell = 0; shell < shells.count; ++shell) {
        const auto ofShell = triangles.of(shell);
        if (!against(volumes[shell]) || ofShell.size() < kMinFaces) continue;
        monitor.check();
        if (outsideOthers(mesh, ofShell, volumes[shell] < 0, closed, open) < kOutside) continue;
        for (const size_t n : ofShell) std::swap(faces.triangles.triangles[n][1], faces.triangles.triangles[n][2]);
        ++turned;
    }
    return turned;
}

SolidShells solidShells(const SolidFaces& faces, const Monitor& monitor) {
    SolidShells parts{.closed = faces.closedOnes(), .others = faces.openOnes()};
    if (parts.closed.faces() == 0 || parts.others.faces() == 0) return parts;
    const WindingNumber open(parts.others, monitor);
    const MeshShells shells = shellsOf(parts.closed);
    const std::vector<double> volumes = volumesOf(parts.closed, shells);
    const ByShell triangles(shells);
    parts.closed.triangles.clear();
    for (size_t shell = 0; shell < shells.count; ++shell) {
        monitor.check();
        const auto ofShell = triangles.of(shell);
        const bool cavity = volumes[shell] < 0 && isWithin(faces.triangles, ofShell, open);
        for (const size_t n : ofShell)
            (cavity ? parts.others : parts.closed).triangles.push_back(faces.triangles.triangles[n]);
    }
    return parts;
}

FilledShells filledShells(const SolidFaces& faces, const SolidWinding& winding, const Monitor& monitor) {
    constexpr double kFlat = 1e-6; // volume of a shell that encloses nothing, for its area
    const Mesh mesh = faces.closedOnes();
    const MeshShells shells = shellsOf(mesh);
    if (shells.count == 0 || (shells.count == 1 && !faces.hasOpen())) return {};
    const std::vector<double> volumes = volumesOf(mesh, shells);
    const ByShell triangles(shells);
    FilledShells filled;
    for (size_t shell = 0; shell < shells.count; ++shell) {
        const auto ofShell = triangles.of(shell);
        if (ofShell.size() < kMinFaces) continue;
        monitor.check();
        bool hidden = true;
        for (size_t k = 0; k < std::min(ofShell.size(), kExamined) && hidden; ++k)
            hidden = isHidden(mesh, ofShell[examined(k, ofShell.size())], winding);
        double area = 0;
        for (const size_t face : ofShell) area += length(winding::triangleOf(mesh, face).area());
        if (!hidden || std::abs(volumes[shell]) < kFlat * area * std::sqrt(area)) continue;
        ++filled.count;
        filled.faces += ofShell.size();
        filled.volume += std::abs(volumes[shell]);
    }
    return filled;
}

} // namespace curlew
