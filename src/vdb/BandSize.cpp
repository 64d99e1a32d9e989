// SPDX-License-Identifier: Apache-2.0
#include "BandSize.h"

#include "curlew/base/Memory.h"
#include "curlew/vdb/Openvdb.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace curlew {

namespace {

constexpr double kMaxSamples = 1e8; ///< The largest band that widened() makes: 1.4 GB.

} // namespace

openvdb::BBoxd boxOf(const Mesh& mesh) {
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

double spacingOf(const Mesh& mesh) {
    float farthest = 0;
    for (const auto& p : mesh.points)
        for (int axis = 0; axis < 3; ++axis) farthest = std::max(farthest, std::abs(p[axis]));
    return static_cast<double>(std::nextafter(farthest, std::numeric_limits<float>::infinity()) - farthest);
}

Extent extentOf(const Mesh& mesh, double voxel) {
    return {areaOf(mesh) / (voxel * voxel), boxOf(mesh).extents() / voxel};
}

Extent extentOf(const LevelSet& levelSet) {
    const double halfWidth = levelSet.halfWidth(), voxels = static_cast<double>(levelSet.grid->activeVoxelCount());
    const Box box = boundsOf(levelSet);
    const Vec3d size = box.size() * (1 / levelSet.voxelSize());
    return {voxels / (2 * halfWidth), {size[0], size[1], size[2]}};
}

/// Inside, the band is at most as large as the box. Outside, edges and small bodies add voxels (Steiner's formula for
/// the box).
double samplesInBand(const Extent& surface, double halfWidth) {
    const auto& size = surface.size;
    const double layer = surface.area * halfWidth;
    return std::min(layer, size[0] * size[1] * size[2]) + layer +
           std::numbers::pi * (size[0] + size[1] + size[2] + 4.0 / 3 * halfWidth) * halfWidth * halfWidth;
}

double bandBytes(const Extent& surface, double halfWidth) { return 18 * samplesInBand(surface, halfWidth + 4); }

void requireBand(const Extent& surface, double halfWidth, double voxel) {
    const double samples = samplesInBand(surface, halfWidth);
    requireMemory(bandBytes(surface, halfWidth),
                  fmt::format("a band of {:.3g} voxels on each side of the level set", halfWidth),
                  "choose a smaller width, or a coarser level set");
    if (samples <= kMaxSamples) return;
    double fits = 0, tooWide = halfWidth;
    for (int k = 0; k < 50; ++k) {
        const double middle = (fits + tooWide) / 2;
        (samplesInBand(surface, middle) <= kMaxSamples ? fits : tooWide) = middle;
    }
    throw ResourceError(
        fmt::format("a band of {:.3g} voxels on each side of the level set would have about {:.2g} voxels; choose a "
                    "width of at most {:.2g}, or a coarser level set",
                    halfWidth, samples, std::max(0.0, fits - kSplineSupport) * voxel));
}

} // namespace curlew
