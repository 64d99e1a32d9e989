// SPDX-License-Identifier: Apache-2.0
#include "curlew/render/Surface.h"

#include "MarchKernel.h"
#include "SurfaceModel.h"
#include "curlew/base/Error.h"
#include "curlew/math/Dispatch.h"
#include "curlew/vdb/Openvdb.h"

#include <openvdb/tools/LevelSetFilter.h>

#include <algorithm>
#include <array>
#include <optional>
#include <utility>

namespace curlew {

using namespace detail;

namespace {

/// The interval of a ray inside a box.
struct Part {
    double begin, end;
    int axis; ///< Axis of the face where it enters; -1: it begins inside.
};

std::optional<Part> partIn(const Box& box, const Ray& ray) {
    Part part{0, std::numeric_limits<double>::infinity(), -1};
    for (int axis = 0; axis < 3; ++axis) {
        const double o = ray.origin[axis], d = ray.direction[axis];
        if (d == 0) {
            if (o < box.lower[axis] || o > box.upper[axis]) return {};
            continue;
        }
        const double a = (box.lower[axis] - o) / d, b = (box.upper[axis] - o) / d;
        if (std::min(a, b) > part.begin) {
            part.begin = std::min(a, b);
            part.axis = axis;
        }
        part.end = std::min(part.end, std::max(a, b));
    }
    if (!(part.begin < part.end)) return {};
    return part;
}

/// The zero set of a field minus a value.
class FieldSurface final : public Surface::Model {
  public:
    FieldSurface(ScalarField field, const FieldBounds& bounds, double value, const Box& box, bool solid)
        : mField(std::move(field)), mBounds(bounds), mValue(value), mBox(box), mSolid(solid) {}

    void intersect(std::span<const Ray> rays, double resolution, std::span<RayHit> hits) const override {
        std::fill(hits.begin(), hits.end(), RayHit{});
        march(rays, resolution, true, [&](size_t ray, const Part& part, double t, bool cut, const Vec3d& gradient) {
            const Vec3d& direction = rays[ray].direction;
            RayHit& hit = hits[ray];
            hit.distance = t;
            if (cut)
                hit.normal[part.axis] = direction[part.axis] > 0 ? -1 : 1;
            else
                hit.normal = facing(gradient, direction);
        });
    }

    void occluded(std::span<const Ray> rays, double resolution, std::span<uint8_t> flags) const override {
        std::fill(flags.begin(), flags.end(), uint8_t{0});
        march(rays, resolution, false, [&](size_t ray, const Part&, double, bool, const Vec3d&) { flags[ray] = 1; });
    }

  private:
    /// Calls found(ray, its part in the box, distance, whether the box cuts the surface there, the field's gradient)
    /// for each ray that hits the surface. Rays march in a batch; where one has ended, the next one begins.
    template <class Found>
    void march(std::span<const Ray> rays, double resolution, bool refines, const Found& found) const {
        const MarchOptions options{.value = mValue, .bounds = mBounds, .resolution = resolution, .refines = refines};
        MarchBatch batch;
        std::array<size_t, kBatch> ray{};
        std::array<Part, kBatch> part{};
        JetBatch<double, 1> jets;
        for (size_t next = 0;;) {
            while (next < rays.size() && !batch.points.full()) {
                if (const auto inBox = partIn(mBox, rays[next])) {
                    const auto n = static_cast<size_t>(batch.points.size);
                    ray[n] = next;
                    part[n] = *inBox;
                    batch.push(rays[next], inBox->begin, inBox->end, mSolid && inBox->axis >= 0);
                }
                ++next;
            }
            if (batch.points.size == 0) return;
            mField.eval(batch.points, jets);
            runKernel<MarchKernel, double>(std::as_const(jets), options, batch);
            for (int k = batch.points.size; k-- > 0;) {
                const auto n = static_cast<size_t>(k);
                const double state = batch.state[n];
                if (state == MarchState::kNothingYet) continue;
                if (state != MarchState::kMissed)
                    found(ray[n], part[n], batch.t[n], state == MarchState::kCut, jets[k].gradient);
                batch.replaceByLast(n);
                ray[n] = ray[static_cast<size_t>(batch.points.size)];
                part[n] = part[static_cast<size_t>(batch.points.size)];
            }
        }
    }

    ScalarField mField;
    FieldBounds mBounds;
    double mValue;
    Box mBox;
    bool mSolid;
};

const Box& checked(const Box& box) {
    if (!box.finite()) throw ValueError("the surface is infinite; give a box");
    for (int axis = 0; axis < 3; ++axis)
        if (!(box.size()[axis] > 0)) throw ValueError("the box of the surface is empty");
    return box;
}

/// Pads a box slightly, so that it does not cut a surface that touches it.
Box loose(const Box& box) { return box.padded(1e-6 * length(box.size())); }

} // namespace

Surface::Surface(const Sdf& sdf, const Box& box)
    : mBox(checked(box)),
      mModel(std::make_shared<FieldSurface>(sdf.distance, FieldBounds{.slope = sdf.lipschitz}, 0, loose(box), true)) {}

Surface::Surface(const ScalarField& field, double value, const Box& box, bool solid)
    : mBox(checked(box)),
      mModel(std::make_shared<FieldSurface>(field, boundsOf(field, value, box), value, loose(box), solid)) {}

Surface::Surface(const LevelSet& levelSet) {
    if (levelSet.grid->tree().empty()) throw ValueError("the level set is empty");
    const Sdf sdf = sdfOf(levelSet);
    mBox = checked(sdf.bounds);
    mModel = levelSetModel(levelSet, sdf.distance);
}

Surface::Surface(const Mesh& mesh) : mModel(meshModel(mesh)) {
    mBox = {Vec3d{{1, 1, 1}} * HUGE_VAL, Vec3d{{1, 1, 1}} * -HUGE_VAL};
    for (const auto& p : mesh.points)
        for (int axis = 0; axis < 3; ++axis) {
            mBox.lower[axis] = std::min(mBox.lower[axis], static_cast<double>(p[axis]));
            mBox.upper[axis] = std::max(mBox.upper[axis], static_cast<double>(p[axis]));
        }
}

double Surface::rayOffset() const { return mModel->rayOffset(); }

void Surface::intersect(std::span<const Ray> rays, double resolution, std::span<RayHit> hits) const {
    mModel->intersect(rays, resolution, hits);
}

void Surface::occluded(std::span<const Ray> rays, double resolution, std::span<uint8_t> flags) const {
    mModel->occluded(rays, resolution, flags);
}

LevelSet smoothed(const LevelSet& levelSet, int voxels) {
    if (voxels == 0) return levelSet;
    const auto grid = levelSet.grid->deepCopy();
    // OpenVDB refuses some transforms (hasCubicVoxels() in vdb/DenseBox.h), which smoothing does not depend on.
    const auto transform = grid->transformPtr();
    grid->setTransform(openvdb::math::Transform::createLinearTransform(levelSet.voxelSize()));
    openvdb::tools::LevelSetFilter<openvdb::FloatGrid>(*grid).gaussian(voxels);
    grid->setTransform(transform);
    return {.grid = grid, .mesh = nullptr};
}

} // namespace curlew
