// SPDX-License-Identifier: Apache-2.0
#include "curlew/vdb/MeshSolid.h"

#include "BandSize.h"
#include "ClosedMesh.h"
#include "Enclosed.h"
#include "MeshDistances.h"
#include "MeshShells.h"
#include "PartThickness.h"
#include "SolidBoundary.h"
#include "SolidChecks.h"
#include "SolidFaces.h"
#include "SolidSigns.h"
#include "VoxelSize.h"
#include "curlew/base/Memory.h"
#include "curlew/vdb/Openvdb.h"

#include <fmt/format.h>
#include <openvdb/tools/ChangeBackground.h>
#include <openvdb/tools/LevelSetMeasure.h>
#include <openvdb/tools/SignedFloodFill.h>

#include <algorithm>
#include <cmath>

namespace curlew {

namespace {

using openvdb::Coord;
using openvdb::FloatGrid;

/// Throws ValueError if the voxels are too small for OpenVDB's 32-bit coordinates or its transform.
void requireCoordinates(const Mesh& mesh, double voxel) {
    const auto bounds = boxOf(mesh);
    if (std::max(bounds.max().length(), bounds.min().length()) / voxel > 1e9)
        throw ValueError(fmt::format("a mesh of size {:.6g} cannot have voxels of {:.6g}; choose larger voxels",
                                     bounds.extents().length(), voxel));
    requireVoxel(voxel);
}

/// Describes the resolution of positions far from the origin.
std::string resolutionOf(const Mesh& mesh, double spacing) {
    const auto bounds = boxOf(mesh);
    return fmt::format("{:.3g} units from the origin, where positions in float are {:.2g} apart",
                       std::max(bounds.max().length(), bounds.min().length()), spacing);
}

/// Explains why a mesh has no size, if that may be so because its positions were rounded to float; otherwise returns
/// "".
std::string roundingOf(const Mesh& mesh) {
    constexpr double kFar = 1e3;
    const auto bounds = boxOf(mesh);
    if (!(bounds.max().length() > kFar)) return "";
    return fmt::format("; it is {}, so move it to the origin before you export it",
                       resolutionOf(mesh, spacingOf(mesh)));
}

/// Throws ValueError if the positions of the mesh are too coarse for these voxels.
void requirePrecision(const Mesh& mesh, double voxel) {
    const double spacing = spacingOf(mesh), enough = spacing / kMaxSpacing;
    if (spacing <= kMaxSpacing * voxel) return;
    const auto extents = boxOf(mesh).extents();
    const bool coarser = std::max({extents[0], extents[1], extents[2]}) > 10 * enough;
    throw ValueError(
        fmt::format("the mesh is {}: too coarse for voxels of {:.3g}; move it to the origin before you "
                    "export it{}",
                    resolutionOf(mesh, spacing), voxel,
                    coarser ? fmt::format(", or use voxels of at least {:.2g}", 1.05 * enough) : ""));
}

double voxelFor(const Mesh& mesh, const SolidOptions& options) {
    if (options.voxel < 0 || !std::isfinite(options.voxel))
        throw ValueError(fmt::format("voxel size {} must be positive", options.voxel));
    if (options.voxel == 0 && options.dim < 1) throw ValueError(fmt::format("dim {} must be at least 1", options.dim));
    if (!(options.halfWidth >= 1))
        throw ValueError(fmt::format("half width {} must be at least 1 voxel", options.halfWidth));
    if (!(options.thickness >= 0 && std::isfinite(options.thickness)))
        throw ValueError(fmt::format("thickness {} must be positive", options.thickness));
    const auto extents = boxOf(mesh).extents();
    const double longest = std::max({extents[0], extents[1], extents[2]});
    if (!(longest > 0)) throw ValueError("the mesh has no size" + roundingOf(mesh));
    return options.voxel > 0 ? options.voxel : longest / options.dim;
}

/// Gives distances in the band the sign of the solid.
void giveSigns(FloatGrid& grid, SolidBoundary& solid, const Monitor& monitor) {
    const auto near = static_cast<float>(kNearSurface * grid.voxelSize()[0]);
    std::vector<Coord> voxels;
    for (auto value = grid.cbeginValueOn(); value; ++value)
        if (*value < near) voxels.push_back(value.getCoord());
    const std::vector<uint8_t> inside = solid.inside(voxels, monitor);
    openvdb::tree::ValueAccessor<openvdb::FloatTree> access(grid.tree());
    for (size_t n = 0; n < voxels.size(); ++n)
        if (inside[n] != 0) access.setValueOnly(voxels[n], -access.getValue(voxels[n]));
    spreadSigns(grid, monitor);
}

/// Makes the solid of triangles that need winding numbers.
FloatGrid::Ptr judged(const SolidFaces& faces, const openvdb::math::Transform& transform, double halfWidth,
                      SolidFigures& figures, double& area, const Monitor& monitor) {
    SolidBoundary solid(faces, transform, monitor);
    figures.clean = false;
    figures.turned = solid.turned();
    figures.undecided = solid.undecided();
    figures.hidden = solid.hidden();
    const FilledShells filled = filledShells(faces, solid.winding(), monitor.quiet());
    figures.filledShells = filled.count;
    figures.filledFaces = filled.faces;
    figures.filledVolume = filled.volume;
    area = areaOf(solid.surface());
    auto grid = solid.surface().faces() > 0
                    ? distancesTo(solid.surface(), transform, halfWidth, monitor.quiet()).distance
                    : FloatGrid::create(static_cast<float>(halfWidth * transform.voxelSize()[0]));
    grid->setTransform(transform.copy());
    giveSigns(*grid, solid, monitor.quiet());
    return grid;
}

/// Makes the solid of triangles.
FloatGrid::Ptr solidOfTriangles(const SolidFaces& faces, const openvdb::math::Transform& transform, double halfWidth,
                                SolidFigures& figures, double& area, const Monitor& monitor) {
    figures.duplicateFaces = faces.duplicates;
    figures.boundaryEdges = faces.boundaryEdges;
    figures.reversedFaces = faces.reversed;
    figures.turnedShells = faces.turnedShells;
    if (faces.oriented && faces.manifold) {
        if (auto grid = closedLevelSet(faces.triangles, transform, halfWidth, figures.turned, monitor)) {
            area = areaOf(faces.triangles);
            return grid;
        }
    }
    return judged(faces, transform, halfWidth, figures, area, monitor);
}

/// Makes a sheet: the distance to the mesh minus half the thickness.
FloatGrid::Ptr sheet(const Mesh& mesh, const openvdb::math::Transform& transform, const SolidOptions& options,
                     const Monitor& monitor) {
    const double voxel = transform.voxelSize()[0];
    auto grid = distancesTo(mesh, transform, options.halfWidth + options.thickness / 2 / voxel, monitor).distance;
    const auto half = static_cast<float>(options.thickness / 2), width = static_cast<float>(options.halfWidth * voxel);
    openvdb::tools::changeBackground(grid->tree(), width);
    for (auto leaf = grid->tree().beginLeaf(); leaf; ++leaf)
        for (auto value = leaf->beginValueOn(); value; ++value) {
            const float d = *value - half;
            leaf->setValueOnly(value.pos(), std::clamp(d, -width, width));
            if (!(std::abs(d) < width)) leaf->setValueOff(value.pos());
        }
    grid->insertMeta(kThickness, openvdb::DoubleMetadata(options.thickness));
    return grid;
}

std::string encloses(const SolidFigures& figures, double voxel) {
    return fmt::format("the mesh encloses nothing at a voxel size of {:.6g}; {}", voxel,
                       figures.undecided > 0.5 || figures.boundaryEdges > 0
                           ? fmt::format("if it is a sheet, such as cloth or terrain, give it a thickness: "
                                         "thickness={:.3g} is four voxels",
                                         4 * voxel)
                           : std::string("use smaller voxels"));
}

/// Turns signed distances in a band into a level set. Throws ValueError if it encloses nothing.
void finish(FloatGrid& grid, const SolidFigures& figures) {
    grid.setGridClass(openvdb::GRID_LEVEL_SET);
    grid.setName("surface");
    openvdb::tools::signedFloodFill(grid.tree());
    if (!enclosesSomething(grid)) throw ValueError(encloses(figures, grid.voxelSize()[0]));
}

/// Makes the level set of a mesh that is no sheet, and measures it.
FloatGrid::Ptr solid(const Mesh& mesh, const MeshTopology& topology, const openvdb::math::Transform& transform,
                     const SolidOptions& options, SolidFigures& figures, const Monitor& monitor) {
    const SolidFaces faces = solidFacesOf(mesh, topology, monitor.quiet());
    double area = 0;
    FloatGrid::Ptr grid = solidOfTriangles(faces, transform, options.halfWidth, figures, area, monitor);
    finish(*grid, figures);
    if (options.measureParts) {
        const PartThickness parts = partThickness(faces.triangles, *grid, monitor.quiet());
        figures.thin = parts.thin;
        figures.missing = parts.below;
        figures.enough = parts.thinnest / kThinVoxels;
    }
    const double volume = figures.clean ? std::abs(volumeOf(mesh)) : openvdb::tools::levelSetVolume(*grid);
    figures.meanThickness = 2 * volume / (area * transform.voxelSize()[0]);
    return grid;
}

} // namespace

int mostVoxels(const Mesh& mesh) {
    const auto size = boxOf(mesh).extents();
    constexpr double kMost = 1e6;
    const double longest = std::max({size[0], size[1], size[2]});
    if (!(longest > 0)) return static_cast<int>(kMost); // solidOf() says what is wrong
    return static_cast<int>(std::clamp(longest / kSmallestVoxel, 1.0, kMost));
}

MeshSolid solidOf(std::shared_ptr<const Mesh> mesh, const SolidOptions& options, const Monitor& monitor) {
    if (mesh->faces() == 0) throw ValueError("the mesh has no faces");
    const MeshTopology topology = topologyOf(*mesh);
    if (topology.degenerateFaces == mesh->faces())
        throw ValueError("every face of the mesh is degenerate (no area)" + roundingOf(*mesh));
    const double voxel = voxelFor(*mesh, options);
    const double halfWidth = options.halfWidth + options.thickness / 2 / voxel;
    const Extent extent = extentOf(*mesh, voxel);
    // Triangles, their edges, a tree over them, points in double, and the lists of those near each leaf.
    constexpr double kBytesPerTriangle = 90;
    constexpr double kListed = 20; // bytes per voxel of a wide band, if it is compared with all faces
    const double lists = halfWidth > 3 ? kListed * samplesInBand(extent, halfWidth) : 0;
    requireMemory(bandBytes(extent, halfWidth) + lists +
                      kBytesPerTriangle * static_cast<double>(mesh->triangles.size() + 2 * mesh->quads.size()),
                  fmt::format("a level set of {:.2g} voxels", samplesInBand(extent, halfWidth)),
                  "choose larger voxels, a smaller dim or a smaller half width");
    requirePrecision(*mesh, voxel);
    requireCoordinates(*mesh, voxel);

    const auto transform = openvdb::math::Transform::createLinearTransform(voxel);
    SolidFigures figures{.boundaryEdges = topology.boundaryEdges, .degenerateFaces = topology.degenerateFaces};
    FloatGrid::Ptr grid;
    if (options.thickness > 0) {
        grid = sheet(*mesh, *transform, options, monitor);
        finish(*grid, figures);
    } else {
        grid = solid(*mesh, topology, *transform, options, figures, monitor);
    }
    return {{grid, std::move(mesh)}, figures};
}

} // namespace curlew
