// SPDX-License-Identifier: Apache-2.0
#include "curlew/render/WallPicture.h"

#include "SurfaceModel.h"
#include "curlew/base/Error.h"
#include "curlew/field/ForEachBatch.h"
#include "curlew/picture/Display.h"
#include "curlew/render/SurfacePicture.h"
#include "curlew/vdb/Openvdb.h"

#include <openvdb/tools/SignedFloodFill.h>

#include <algorithm>

namespace curlew {

namespace {

constexpr int kSamples = 192; ///< Along the longest edge.
constexpr double kBand = 2;   ///< Samples on either side of the wall.

/// Samples the distance at the corners of cells around the wall; elsewhere the grid only has its sign.
openvdb::FloatGrid::Ptr sampledWall(const Domain& domain, double voxel, const Monitor& monitor) {
    const Vec3d origin = domain.box.lower;
    const auto cells = coveringCells(domain, origin, voxel, {-kBand * voxel, kBand * voxel}, size_t{1} << 24);
    std::vector<float> values(cells.size());
    const auto place = [&](size_t k) {
        Vec3d p;
        for (int axis = 0; axis < 3; ++axis) p[axis] = origin[axis] + voxel * cells[k][axis];
        return p;
    };
    forEachBatch(
        PointsBy{cells.size(), place},
        [&](const PointBatch& points, size_t begin) {
            JetBatch<double, 0> jets;
            domain.wall->sdf.distance.eval(points, jets);
            for (int i = 0; i < points.size; ++i)
                values[begin + static_cast<size_t>(i)] = static_cast<float>(jets[i].value);
        },
        monitor);
    auto grid = openvdb::FloatGrid::create(static_cast<float>((kBand + 2) * voxel));
    grid->setGridClass(openvdb::GRID_LEVEL_SET);
    auto access = grid->getAccessor();
    for (size_t k = 0; k < cells.size(); ++k)
        access.setValue({cells[k][0], cells[k][1], cells[k][2]},
                        std::clamp(values[k], -grid->background(), grid->background()));
    openvdb::tools::signedFloodFill(grid->tree());
    return grid;
}

} // namespace

Surface wallSurface(const Domain& domain, const Monitor& monitor) {
    if (!domain.wall) throw ValueError("there is no wall to draw");
    Domain around{.box = domain.box, .wall = domain.wall};
    around.wall->side = Side::both;
    if (domain.wall->sdf.bounds.finite()) around.box = domain.wall->sdf.bounds;
    if (!around.box.finite()) throw ValueError("the wall's domain is infinite; give it a box");
    const Vec3d size = around.box.size();
    const double voxel = std::max({size[0], size[1], size[2]}) / kSamples;
    around.box = around.box.padded((kBand + 1) * voxel);
    return {around.box, gridModel(*sampledWall(around, voxel, monitor), voxel, around.box.lower)};
}

Image obstaclePicture(const Domain& domain, const Camera& camera, const Vec3f& background, const Monitor& monitor) {
    constexpr Vec3f kDull{{0.16f, 0.18f, 0.22f}};
    Image picture = drawSurface(wallSurface(domain, monitor), camera,
                                {.samples = 2,
                                 .paint = {.color = kDull},
                                 .look = {.background = background, .gloss = 0.05},
                                 .shadows = false},
                                nullptr, monitor)
                        .image;
    // Make the background plain, as without an obstacle.
    const Image plain = plainPicture(camera.width(), camera.height(), background);
    for (size_t pixel = 0; pixel < plain.pixels.size() / 3; ++pixel)
        if (picture.pixels[5 * pixel + 3] == 0) std::copy_n(&plain.pixels[3 * pixel], 3, &picture.pixels[5 * pixel]);
    return picture;
}

} // namespace curlew
