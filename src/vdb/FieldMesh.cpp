// SPDX-License-Identifier: Apache-2.0
#include "curlew/vdb/FieldMesh.h"

#include "curlew/base/Error.h"
#include "curlew/base/Memory.h"
#include "curlew/field/ForEachBatch.h"
#include "curlew/track/Snap.h"
#include "curlew/vdb/GridField.h"
#include "curlew/vdb/LevelSetMesh.h"
#include "curlew/vdb/Openvdb.h"

#include <fmt/format.h>
#include <openvdb/tools/ValueTransformer.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace curlew {

namespace {

using openvdb::Index32;
using openvdb::Vec3s;

Vec3d position(const Vec3s& p) {
    return {{static_cast<double>(p[0]), static_cast<double>(p[1]), static_cast<double>(p[2])}};
}
Vec3s rounded(const Vec3d& v) { return {static_cast<float>(v[0]), static_cast<float>(v[1]), static_cast<float>(v[2])}; }

/// Calls use(corners, count) for each face.
template <class Use>
void forEachFace(const Mesh& mesh, const Use& use) {
    for (const auto& face : mesh.triangles) use(face.asV(), 3);
    for (const auto& face : mesh.quads) use(face.asV(), 4);
}

/// Removes the faces with a vertex outside of the box, and the vertices that no face uses.
void crop(Mesh& mesh, const Box& box) {
    std::vector<uint8_t> inside(mesh.points.size());
    for (size_t k = 0; k < inside.size(); ++k) {
        inside[k] = 1;
        const Vec3d p = position(mesh.points[k]);
        for (int axis = 0; axis < 3; ++axis)
            if (p[axis] < box.lower[axis] || p[axis] > box.upper[axis]) inside[k] = 0;
    }
    const auto keep = [&](auto& faces) {
        std::erase_if(faces, [&](const auto& face) {
            return std::any_of(face.asV(), face.asV() + face.size, [&](Index32 corner) { return !inside[corner]; });
        });
    };
    keep(mesh.triangles);
    keep(mesh.quads);
    constexpr Index32 kUnused = std::numeric_limits<Index32>::max();
    std::vector<Index32> renamed(mesh.points.size(), kUnused);
    forEachFace(mesh, [&](const Index32* corners, int count) {
        for (int k = 0; k < count; ++k) renamed[corners[k]] = 0;
    });
    Index32 used = 0;
    for (size_t k = 0; k < renamed.size(); ++k)
        if (renamed[k] != kUnused) {
            renamed[k] = used;
            mesh.points[used++] = mesh.points[k];
        }
    mesh.points.resize(used);
    const auto rename = [&](auto& faces) {
        for (auto& face : faces)
            for (int k = 0; k < face.size; ++k) face[k] = renamed[face[k]];
    };
    rename(mesh.triangles);
    rename(mesh.quads);
}

/// Moves the vertices onto the surface, by at most a voxel.
void moveOnto(Mesh& mesh, const ScalarField& field, double iso, double voxel, const Monitor& monitor) {
    double steepest = 0;
    Points vertices;
    for (const Vec3s& point : mesh.points) {
        const Vec3d p = position(point);
        vertices.x.push_back(p[0]);
        vertices.y.push_back(p[1]);
        vertices.z.push_back(p[2]);
    }
    PointBatch probe;
    const auto flush = [&] {
        JetBatch<double, 1> jets;
        field.eval(probe, jets);
        for (int i = 0; i < probe.size; ++i)
            if (const double slope = length(jets[i].gradient); std::isfinite(slope))
                steepest = std::max(steepest, slope);
        probe = {};
    };
    const size_t stride = std::max<size_t>(mesh.points.size() / 4096, 1);
    for (size_t k = 0; k < mesh.points.size(); k += stride) {
        probe.push(position(mesh.points[k]));
        if (probe.full()) flush();
    }
    if (probe.size > 0) flush();
    if (!(steepest > 0)) return;
    constexpr double kTolerance = 1e-8; // voxels
    snap(field, iso, vertices, voxel, kTolerance * voxel * steepest, monitor);
    for (size_t k = 0; k < mesh.points.size(); ++k) mesh.points[k] = rounded(vertices.position(k));
}

/// Returns the area-weighted average of the normals of the faces around each vertex.
std::vector<Vec3d> faceNormals(const Mesh& mesh) {
    std::vector<Vec3d> normals(mesh.points.size());
    forEachFace(mesh, [&](const Index32* corners, int count) {
        Vec3d area;
        for (int k = 2; k < count; ++k) {
            const Vec3d first = position(mesh.points[corners[0]]);
            area += cross(position(mesh.points[corners[k - 1]]) - first, position(mesh.points[corners[k]]) - first);
        }
        for (int k = 0; k < count; ++k) normals[corners[k]] += area;
    });
    return normals;
}

void setNormals(Mesh& mesh, const ScalarField& field, double sign, const Monitor& monitor) {
    mesh.normals.resize(mesh.points.size());
    const auto at = [&](size_t k) { return position(mesh.points[k]); };
    std::vector<uint8_t> known(mesh.points.size());
    forEachBatch(
        PointsBy{mesh.points.size(), at},
        [&](const PointBatch& points, size_t begin) {
            JetBatch<double, 1> jets;
            field.eval(points, jets);
            for (int i = 0; i < points.size; ++i) {
                const Vec3d gradient = jets[i].gradient;
                const double size = length(gradient);
                const size_t k = begin + static_cast<size_t>(i);
                known[k] = size > 0 && std::isfinite(size);
                if (known[k]) mesh.normals[k] = rounded(gradient * (sign / size));
            }
        },
        monitor);
    if (std::find(known.begin(), known.end(), uint8_t{0}) == known.end()) return;
    const std::vector<Vec3d> average = faceNormals(mesh);
    for (size_t k = 0; k < known.size(); ++k)
        if (const double size = length(average[k]); !known[k])
            mesh.normals[k] = size > 0 ? rounded(average[k] * (1 / size)) : Vec3s(0, 0, 1);
}

double sizeOrFrom(double size, double longest, int dim) { return size > 0 ? size : longest / dim; }

} // namespace

Mesh isosurface(const ScalarField& field, const IsosurfaceOptions& options, const Monitor& monitor) {
    if (!std::isfinite(options.iso)) throw ValueError(fmt::format("the value {} is not finite", options.iso));
    const Vec3d size = options.box.size();
    const double longest = *std::max_element(size.c.begin(), size.c.end());
    if (!options.box.finite() || !(*std::min_element(size.c.begin(), size.c.end()) > 0))
        throw ValueError("the box of an isosurface is empty or infinite; give box=");
    const double voxel = sizeOrFrom(options.voxel, longest, options.dim);
    // OpenVDB closes the surface at the end of the samples, which is two voxels beyond the box, and cut off.
    const auto grid = bakedGrid(field, {.box = options.box.padded(2 * voxel), .voxel = voxel, .dim = options.dim},
                                "isosurface", monitor);
    openvdb::tools::foreach (grid->beginValueOn(), [&](const openvdb::FloatGrid::ValueOnIter& value) {
        const auto above = static_cast<float>(static_cast<double>(*value) - options.iso);
        value.setValue(options.reversed ? -above : above);
    });
    grid->setGridClass(openvdb::GRID_LEVEL_SET);
    Mesh mesh = surfaceOf(*grid, options.adaptivity);
    crop(mesh, options.box);
    if (mesh.faces() == 0)
        throw ValueError(
            fmt::format("the field does not take the value {} in the box; see its range with -check", options.iso));
    monitor.check();
    moveOnto(mesh, field, options.iso, voxel, monitor);
    setNormals(mesh, field, options.reversed ? -1 : 1, monitor);
    return mesh;
}

Mesh heightMesh(const ScalarFieldN<2>& field, const HeightMeshOptions& options, const Monitor& monitor) {
    const Vec<double, 2> size = options.box.size();
    if (!options.box.finite() || !(std::min(size[0], size[1]) > 0))
        throw ValueError("the box of a height field is empty or infinite; give box=");
    const double edge = sizeOrFrom(options.edge, std::max(size[0], size[1]), options.dim);
    std::array<size_t, 2> n{};
    for (size_t axis = 0; axis < 2; ++axis) {
        const double count = std::max(1.0, std::round(size[static_cast<int>(axis)] / edge));
        if (!(count < 0x1p31)) throw ValueError(fmt::format("quads of {:.3g} are too small for the box", edge));
        n[axis] = static_cast<size_t>(count);
    }
    const size_t columns = n[0] + 1, count = columns * (n[1] + 1);
    constexpr double kBytes = 12 + 12 + 8 + 16; // position, normal, UV, face
    requireMemory(kBytes * static_cast<double>(count),
                  fmt::format("a mesh of {:.3g} quads", static_cast<double>(count)),
                  "use larger faces or a smaller box");
    if (count > std::numeric_limits<Index32>::max()) throw ValueError("a height field has more than 2^32 vertices");
    Mesh mesh;
    mesh.points.resize(count);
    mesh.normals.resize(count);
    mesh.uvs.resize(count);
    const auto fraction = [&](size_t k) {
        const size_t column = k % columns, row = k / columns;
        return Vec<double, 2>{{static_cast<double>(column) / static_cast<double>(n[0]),
                               static_cast<double>(row) / static_cast<double>(n[1])}};
    };
    const auto at = [&](size_t k) {
        const Vec<double, 2> uv = fraction(k);
        Vec<double, 2> p;
        for (int axis = 0; axis < 2; ++axis)
            p[axis] = uv[axis] < 1 ? options.box.lower[axis] + uv[axis] * size[axis] : options.box.upper[axis];
        return p;
    };
    forEachBatch(
        PointsBy{count, at},
        [&](const PointBatchN<2>& points, size_t begin) {
            JetBatchN<double, 2, 1> jets;
            field.eval(points, jets);
            for (int i = 0; i < points.size; ++i) {
                const size_t k = begin + static_cast<size_t>(i);
                const auto jet = jets[i];
                const Vec3d normal{{-jet.gradient[0], -jet.gradient[1], 1}};
                mesh.points[k] = rounded({{points[i][0], points[i][1], jet.value}});
                mesh.normals[k] = rounded(normal * (1 / length(normal)));
                const Vec<double, 2> uv = fraction(k);
                mesh.uvs[k] = {static_cast<float>(uv[0]), static_cast<float>(uv[1])};
            }
        },
        monitor);
    for (size_t j = 0; j < n[1]; ++j)
        for (size_t i = 0; i < n[0]; ++i) {
            const auto corner = static_cast<Index32>(j * columns + i), above = static_cast<Index32>(corner + columns);
            mesh.quads.emplace_back(corner, corner + 1, above + 1, above);
        }
    return mesh;
}

} // namespace curlew
