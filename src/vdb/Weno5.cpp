// SPDX-License-Identifier: Apache-2.0
#include "curlew/vdb/Interrupter.h"
#include "curlew/vdb/LevelSetAdvection.h"

#include <fmt/format.h>
#include <openvdb/tools/LevelSetAdvect.h>

#include <mutex>
#include <optional>

namespace curlew {

namespace {

/// Adapts a flow to the velocity field interface of OpenVDB's level set tools. Each thread has a copy.
class VelocityField {
  public:
    using ValueType = float;
    using VectorType = openvdb::Vec3f;

    explicit VelocityField(FlowInTime flow) : mShared(std::make_shared<Shared>(std::move(flow))) {}

    /// Differs from that of any grid, so that positions come in world units.
    openvdb::math::Transform transform() const { return {}; }

    VectorType operator()(const openvdb::Vec3d& position, ValueType time) const {
        if (!mFlow || time != mTime) {
            const std::lock_guard lock(mShared->mutex);
            mFlow = mShared->flow.at(static_cast<double>(time));
            mTime = time;
        }
        PointBatch points;
        points.push({{position[0], position[1], position[2]}});
        VecBatch<float> velocity;
        mFlow->velocity(points, velocity);
        const Vec3f v = velocity[0];
        return {v[0], v[1], v[2]};
    }
    VectorType operator()(const openvdb::Coord& voxel, ValueType time) const { return (*this)(voxel.asVec3d(), time); }

  private:
    struct Shared {
        explicit Shared(FlowInTime f) : flow(std::move(f)) {}
        FlowInTime flow;
        std::mutex mutex;
    };
    std::shared_ptr<Shared> mShared;
    mutable std::optional<Flow> mFlow; // the flow at mTime
    mutable ValueType mTime = 0;
};

} // namespace

LevelSet advectLevelSetWeno5(const LevelSet& levelSet, const FlowInTime& flow, double begin, double time,
                             const Monitor& monitor) {
    if (!std::isfinite(begin) || !std::isfinite(time)) throw ValueError("time must be finite");
    const auto grid = levelSet.grid->deepCopy();
    Interrupter interrupter(monitor);
    openvdb::tools::LevelSetAdvection<openvdb::FloatGrid, VelocityField, Interrupter> advection(
        *grid, VelocityField(flow), &interrupter);
    advection.setSpatialScheme(openvdb::math::HJWENO5_BIAS);
    advection.setTemporalScheme(openvdb::math::TVD_RK3);
    advection.setTrackerSpatialScheme(openvdb::math::HJWENO5_BIAS);
    advection.setTrackerTemporalScheme(openvdb::math::TVD_RK3);
    try {
        advection.advect(static_cast<float>(begin), static_cast<float>(begin + time));
    } catch (const openvdb::Exception& e) {
        throw ValueError(
            fmt::format("OpenVDB's level set advection rejects level set '{}': {}", grid->getName(), e.what()));
    }
    monitor.check();
    if (grid->tree().empty()) throw ValueError("nothing is left of the level set; use smaller voxels");
    return {grid, nullptr};
}

} // namespace curlew
