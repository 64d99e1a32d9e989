#include "curlew/vdb/LevelSet.h"

#include "VoxelSize.h"
#include "curlew/base/Memory.h"
#include "curlew/vdb/Interrupter.h"

#include <fmt/format.h>
#include <openvdb/tools/FastSweeping.h>
#include <openvdb/tools/MeshToVolume.h>

#include <algorithm>
#include <numbers>

namespace curlew {

namespace {

/// A mesh in the index space of a grid, as OpenVDB wants it.
class MeshAdapter {
  public:
    MeshAdapter(const Mesh& mesh, const openvdb::math::Transform& transform) : mMesh(mesh), mTransform(transform) {}

    size_t polygonCount() const { return mMesh.faces(); }
    size_t pointCount() const { return mMesh.points.size(); }
    size_t vertexCount(size_t face) const { return face < mMesh.triangles.size() ? 3 : 4; }
    void getIndexSpacePoint(size_t face, size_t corner, openvdb::Vec3d& position) const {
        const auto c = static_cast<int>(corner);
        const openvdb::Index32 vertex =
            face < mMesh.triangles.size() ? mMesh.triangles[face][c] : mMesh.quads[face - mMesh.triangles.size()][c];
        position = mTransform.worldToIndex(openvdb::Vec3d(mMesh.points[vertex]));
    }

  private:
    const Mesh& mMesh;
    const openvdb::math::Transform& mTransform;
};

openvdb::BBoxd boundsOf(const Mesh& mesh) {
    openvdb::BBoxd bounds;
    for (const auto& p : mesh.points) bounds.expand(openvdb::Vec3d(p));
    return bounds;
}

double areaOf(const Mesh& mesh) {
    const auto triangle = [&](openvdb::Index32 a, openvdb::Index32 b, openvdb::Index32 c) {
        const openvdb::Vec3d p(mesh.points[a]), q(mesh.points[b]), r(mesh.points[c]);
        return 0.5 * (q - p).cross(r - p).length();
    };
    double area = 0;
    for (const auto& t : mesh.triangles) area += triangle(t[0], t[1], t[2]);
    for (const auto& q : mesh.quads) area += triangle(q[0], q[1], q[2]) + triangle(q[0], q[2], q[3]);
    return area;
}

/// A surface in voxels: its area and the edges of its box.
struct Extent {
    double area;
    openvdb::Vec3d size;
};

Extent extentOf(const Mesh& mesh, double voxel) {
    return {areaOf(mesh) / (voxel * voxel), boundsOf(mesh).extents() / voxel};
}

Extent extentOf(const LevelSet& levelSet) {
    const double halfWidth = levelSet.halfWidth(), voxels = static_cast<double>(levelSet.grid->activeVoxelCount());
    const Box box = boundsOf(levelSet);
    const Vec3d size = box.size() * (1 / levelSet.voxelSize());
    return {voxels / (2 * halfWidth), {size[0], size[1], size[2]}};
}

/// Inside, at most what the box holds; outside, what an edge or a small body adds too (Steiner's formula for the box).
double samplesInBand(const Extent& surface, double halfWidth) {
    const auto& size = surface.size;
    const double layer = surface.area * halfWidth;
    return std::min(layer, size[0] * size[1] * size[2]) + layer +
           std::numbers::pi * (size[0] + size[1] + size[2] + 4.0 / 3 * halfWidth) * halfWidth * halfWidth;
}

constexpr double kMostSamples = 1e8; ///< That a band is widened to: 1.4 GB.

/// Throws ResourceError unless a band can be widened to `halfWidth` voxels in reasonable memory and time.
void requireBand(const Extent& surface, double halfWidth, double voxel) {
    const double samples = samplesInBand(surface, halfWidth);
    requireMemory(samples * 14, fmt::format("a band of {:.3g} voxels on either side of the level set", halfWidth),
                  "choose a smaller width, or a coarser level set");
    if (samples <= kMostSamples) return;
    double fits = 0, tooWide = halfWidth;
    for (int k = 0; k < 50; ++k) {
        const double middle = (fits + tooWide) / 2;
        (samplesInBand(surface, middle) <= kMostSamples ? fits : tooWide) = middle;
    }
    throw ResourceError(fmt::format(
        "a band of {:.3g} voxels on either side of the level set would have about {:.2g} voxels; choose a width of at "
        "most {:.2g}, or a coarser level set",
        halfWidth, samples, std::max(0.0, fits - kSplineSupport) * voxel));
}

/// Throws where the voxels are too small for OpenVDB: for its 32-bit coordinates, or its transform.
void requireCoordinates(const Mesh& mesh, double voxel) {
    const auto bounds = boundsOf(mesh);
    if (std::max(bounds.max().length(), bounds.min().length()) / voxel > 1e9)
        throw ValueError(fmt::format("a mesh of size {:.6g} cannot have voxels of {:.6g}; choose larger voxels",
                                     bounds.extents().length(), voxel));
    requireVoxel(voxel);
}

double voxelFor(const Mesh& mesh, const MeshToLevelSetOptions& options) {
    if (options.voxel < 0 || !std::isfinite(options.voxel))
        throw ValueError(fmt::format("voxel size {} must be positive", options.voxel));
    if (options.voxel == 0 && options.dim < 1) throw ValueError(fmt::format("dim {} must be at least 1", options.dim));
    if (!(options.halfWidth >= 1))
        throw ValueError(fmt::format("half width {} must be at least 1 voxel", options.halfWidth));
    const auto extents = boundsOf(mesh).extents();
    const double longest = std::max({extents[0], extents[1], extents[2]});
    if (!(longest > 0)) throw ValueError("the mesh has no extent");
    return options.voxel > 0 ? options.voxel : longest / options.dim;
}

void requireSolid(const Mesh& mesh, bool acceptOpen) {
    const MeshTopology topology = topologyOf(mesh);
    if (mesh.faces() == 0) throw ValueError("the mesh has no faces");
    if (topology.degenerateFaces == mesh.faces()) throw ValueError("every face of the mesh is degenerate (no area)");
    if (topology.boundaryEdges > 0 && !acceptOpen)
        throw ValueError(
            fmt::format("the mesh is open ({} edges have a face on one side only); close its holes, or give open=1 "
                        "if they are narrower than a voxel",
                        topology.boundaryEdges));
}

/// More than what rounding makes of a flat surface.
bool enclosesSomething(const openvdb::FloatGrid& grid) {
    const auto depth = static_cast<float>(1e-3 * grid.voxelSize()[0]);
    for (auto leaf = grid.tree().cbeginLeaf(); leaf; ++leaf)
        for (auto value = leaf->cbeginValueOn(); value; ++value)
            if (*value < -depth) return true;
    return false;
}

} // namespace

LevelSet meshToLevelSet(std::shared_ptr<const Mesh> mesh, const MeshToLevelSetOptions& options,
                        const Monitor& monitor) {
    requireSolid(*mesh, options.open);
    const double voxel = voxelFor(*mesh, options);
    // Samples in the band, times what OpenVDB's conversion holds per sample: value, face index, and copies while it
    // works.
    const double samples = samplesInBand(extentOf(*mesh, voxel), options.halfWidth);
    requireMemory(samples * 14, fmt::format("a level set of {:.2g} voxels", samples),
                  "choose larger voxels, a smaller dim or a smaller width");
    requireCoordinates(*mesh, voxel);

    const auto transform = openvdb::math::Transform::createLinearTransform(voxel);
    Interrupter interrupter(monitor);
    const auto width = static_cast<float>(options.halfWidth);
    // Distances as they are: OpenVDB's renormalisation would move samples by a hundredth of a voxel, and differently
    // for each width of the band.
    const auto grid = openvdb::tools::meshToVolume<openvdb::FloatGrid>(
        interrupter, MeshAdapter(*mesh, *transform), *transform, width, width, openvdb::tools::DISABLE_RENORMALIZATION);
    monitor.check();
    if (!enclosesSomething(*grid))
        throw ValueError(fmt::format(
            "the mesh encloses nothing at a voxel size of {:.6g}; use smaller voxels, or close its holes", voxel));
    grid->setName("surface");
    return {grid, std::move(mesh)};
}

LevelSet levelSetOf(const openvdb::GridBase::ConstPtr& grid) {
    const auto floats = openvdb::GridBase::grid<openvdb::FloatGrid>(grid);
    if (!floats)
        throw ValueError(
            fmt::format("grid '{}' is a {} grid; a level set has float values", grid->getName(), grid->valueType()));
    if (floats->getGridClass() != openvdb::GRID_LEVEL_SET)
        throw ValueError(fmt::format("grid '{}' is not a level set; its class is '{}'", grid->getName(),
                                     openvdb::GridBase::gridClassToString(grid->getGridClass())));
    const auto voxel = floats->voxelSize();
    if (!floats->hasUniformVoxels() || !(voxel[0] > 0) || !floats->transform().isLinear())
        throw ValueError(fmt::format("level set '{}' must have cubic voxels", grid->getName()));
    if (!(floats->background() > 0) || !std::isfinite(floats->background()))
        throw ValueError(fmt::format("level set '{}' has background {}; it must be positive", grid->getName(),
                                     floats->background()));
    for (auto leaf = floats->tree().cbeginLeaf(); leaf; ++leaf)
        for (auto value = leaf->cbeginValueOn(); value; ++value)
            if (!std::isfinite(*value))
                throw ValueError(fmt::format("level set '{}' has values that are not finite", grid->getName()));
    if (!enclosesSomething(*floats)) throw ValueError(fmt::format("level set '{}' encloses nothing", grid->getName()));
    return {floats, nullptr};
}

LevelSet widened(const LevelSet& levelSet, double halfWidth, const Monitor& monitor) {
    if (levelSet.halfWidth() >= halfWidth - 1e-3) return levelSet;
    const double voxel = levelSet.voxelSize();
    requireBand(levelSet.mesh ? extentOf(*levelSet.mesh, voxel) : extentOf(levelSet), halfWidth, voxel);
    if (levelSet.mesh)
        return meshToLevelSet(levelSet.mesh, {.voxel = voxel, .halfWidth = halfWidth, .open = true}, monitor);
    const int dilation = static_cast<int>(std::ceil(halfWidth - levelSet.halfWidth()));
    // The new band is solved for outwards from the old one, which stays as it is.
    auto grid = openvdb::tools::dilateSdf(*levelSet.grid, dilation, openvdb::tools::NN_FACE, 1);
    const auto background = static_cast<float>(halfWidth * voxel);
    openvdb::tools::changeLevelSetBackground(grid->tree(), background);
    return {grid, nullptr};
}

} // namespace curlew
