// SPDX-License-Identifier: Apache-2.0
#include "curlew/app/run/Value.h"
#include "curlew/vdb/Openvdb.h"

#include <algorithm>

namespace curlew::app {

namespace {

/// The bounding box of the finite positions.
class Around {
  public:
    void add(const Vec3d& p) {
        for (int axis = 0; axis < 3; ++axis)
            if (!std::isfinite(p[axis])) return;
        for (int axis = 0; axis < 3; ++axis) {
            mBox.lower[axis] = mEmpty ? p[axis] : std::min(mBox.lower[axis], p[axis]);
            mBox.upper[axis] = mEmpty ? p[axis] : std::max(mBox.upper[axis], p[axis]);
        }
        mEmpty = false;
    }
    std::optional<Box> box() const { return mEmpty ? std::nullopt : std::optional(mBox); }

  private:
    Box mBox;
    bool mEmpty = true;
};

Vec3d worldOf(const openvdb::Vec3d& p) { return {{p[0], p[1], p[2]}}; }

std::optional<Box> boxOf(const openvdb::GridBase& grid) {
    const openvdb::CoordBBox voxels = grid.evalActiveVoxelBoundingBox();
    if (voxels.empty()) return std::nullopt;
    const auto world =
        grid.constTransform().indexToWorld(openvdb::BBoxd(voxels.min().asVec3d(), voxels.max().asVec3d()));
    return Box{worldOf(world.min()), worldOf(world.max())};
}

struct BoxOfValue {
    std::optional<Box> operator()(const FieldValue& value) const {
        if (value.sdf) return app::boxOf(*value.sdf);
        if (!value.wall) return std::nullopt;
        return std::visit([](const auto& wall) { return app::boxOf(AnySdf(wall.sdf)); }, *value.wall);
    }
    std::optional<Box> operator()(const AnyFlow& flow) const {
        if (dimensionOf(flow) > 3) return std::nullopt;
        const Box box = inSpace(flow).domain().box;
        return box.finite() ? std::optional(box) : std::nullopt;
    }
    std::optional<Box> operator()(const GridValue& value) const {
        if (value.body) return boxOfBody(*value.body);
        if (value.mesh) return (*this)(value.mesh);
        if (value.grid->getGridClass() == openvdb::GRID_LEVEL_SET) return boundsOf(levelSetOf(value.grid));
        return boxOf(*value.grid);
    }
    std::optional<Box> operator()(const MeshPointer& mesh) const {
        Around around;
        for (const auto& p : mesh->points) around.add(worldOf(openvdb::Vec3d(p)));
        return around.box();
    }
    std::optional<Box> operator()(const PointsPointer& points) const {
        Around around; // empty in more than 3 dimensions
        for (size_t k = 0; k < points->particles.size(); ++k) around.add(points->particles.position(k));
        return around.box();
    }
    std::optional<Box> operator()(const CurvesPointer& curves) const {
        Around around;
        for (size_t k = 0; k < curves->vertices(); ++k) around.add(curves->position(k));
        return around.box();
    }
    std::optional<Box> boxOfBody(const RigidBody& body) const {
        const Matrix3 turn = body.now.axes * transpose(body.home.axes);
        Around around;
        const auto add = [&](const Vec3d& p) { around.add(turn * (p - body.home.origin) + body.now.origin); };
        if (body.first->mesh) {
            for (const auto& p : body.first->mesh->points) add(worldOf(openvdb::Vec3d(p)));
        } else if (const auto box = (*this)(*body.first)) {
            for (int corner = 0; corner < 8; ++corner) {
                Vec3d p = box->lower;
                for (int axis = 0; axis < 3; ++axis)
                    if (corner >> axis & 1) p[axis] = box->upper[axis];
                add(p);
            }
        }
        return around.box();
    }
    template <class Other>
    std::optional<Box> operator()(const Other&) const {
        return std::nullopt;
    }
};

} // namespace

std::optional<SampledRegion> sampledRegionOf(const openvdb::GridBase& grid) {
    const auto centres = boxOf(grid);
    if (!centres) return std::nullopt;
    const openvdb::Vec3d voxel = grid.voxelSize();
    const double size = std::max({voxel[0], voxel[1], voxel[2]});
    const auto* floats = dynamic_cast<const openvdb::FloatGrid*>(&grid);
    return SampledRegion{centres->padded(size / 2), size,
                         floats ? static_cast<double>(floats->background()) : std::nan("")};
}

std::optional<Box> regionOf(const FieldValue& field) {
    if (field.sdf) return boxOf(*field.sdf);
    return field.sampled ? std::optional(field.sampled->box) : std::nullopt;
}

std::optional<Box> regionOfSurface(const FieldValue& field, double iso) {
    const auto region = regionOf(field);
    if (!region) return std::nullopt;
    if (field.sdf) return region->padded(0.1 * length(region->size()));
    return field.sampled->background == iso ? *region : region->padded(2 * field.sampled->voxel);
}

std::optional<Box> boxOf(const Value& value) { return std::visit(BoxOfValue{}, value); }

} // namespace curlew::app
