// SPDX-License-Identifier: Apache-2.0
#include "curlew/base/Memory.h"
#include "curlew/track/WallVelocity.h"
#include "curlew/vdb/Interrupter.h"
#include "curlew/vdb/LevelSetAdvection.h"
#include "curlew/vdb/Openvdb.h"

#include <fmt/format.h>
#include <openvdb/tools/LevelSetAdvect.h>

#include <algorithm>
#include <mutex>
#include <optional>

namespace curlew {

namespace {

/// Adapts a flow to the velocity field interface of OpenVDB's level set tools. Each thread has a copy.
class VelocityField {
  public:
    using ValueType = float;
    using VectorType = openvdb::Vec3f;

    VelocityField(FlowInTime flow, double begin, double end)
        : mShared(std::make_shared<Shared>(std::move(flow), begin, end)) {}

    /// Differs from that of any grid, so that positions come in world units.
    openvdb::math::Transform transform() const { return {}; }

    VectorType operator()(const openvdb::Vec3d& position, ValueType time) const {
        if (!mNow || time != mTime) {
            mNow = mShared->at(time);
            mTime = time;
        }
        PointBatch points;
        points.push({{position[0], position[1], position[2]}});
        VecBatch<float> velocity;
        mNow->flow.velocity(points, velocity);
        Vec3f v = velocity[0];
        if (mNow->wall) {
            VecBatch<double> w;
            mNow->wall->eval(points, w);
            for (int axis = 0; axis < 3; ++axis) v[axis] += static_cast<float>(w[0][axis]);
        }
        return {v[0], v[1], v[2]};
    }
    VectorType operator()(const openvdb::Coord& voxel, ValueType time) const { return (*this)(voxel.asVec3d(), time); }

  private:
    /// The flow at a moment, and the velocity that its wall adds if it moves.
    struct Frozen {
        Flow flow;
        std::optional<WallVelocity> wall;
    };
    /// The flow at the moment that was requested last.
    class Shared {
      public:
        Shared(FlowInTime flow, double begin, double end) : mFlow(std::move(flow)), mBegin(begin), mEnd(end) {}

        std::shared_ptr<const Frozen> at(ValueType time) {
            const std::lock_guard lock(mMutex);
            if (mLast && time == mTime) return mLast;
            // The wall's motion is taken from times between the beginning and the end.
            const auto now = static_cast<double>(time);
            const double most = std::min(kFrozenSeconds, std::abs(mEnd - mBegin) / 2);
            const double way = std::abs(now - mBegin) < std::abs(mEnd - now) ? most : -most;
            mLast =
                std::make_shared<Frozen>(Frozen{mFlow.at(now), wallVelocity(mFlow, now, mEnd < mBegin ? -way : way)});
            mTime = time;
            return mLast;
        }

      private:
        FlowInTime mFlow;
        double mBegin, mEnd;
        std::mutex mMutex;
        std::shared_ptr<const Frozen> mLast;
        ValueType mTime = 0;
    };
    std::shared_ptr<Shared> mShared;
    mutable std::shared_ptr<const Frozen> mNow; // at mTime
    mutable ValueType mTime = 0;
};

} // namespace

LevelSet advectLevelSetWeno5(const LevelSet& levelSet, const FlowInTime& flow, double begin, double time,
                             const Monitor& monitor) {
    if (!std::isfinite(begin) || !std::isfinite(time)) throw ValueError("time must be finite");
    // The copy, three buffers of the time integration, and what the rebuilt band adds.
    requireMemory(4.0 * static_cast<double>(levelSet.grid->memUsage()), "OpenVDB's level set advection",
                  "use larger voxels");
    const auto grid = levelSet.grid->deepCopy();
    Interrupter interrupter(monitor);
    openvdb::tools::LevelSetAdvection<openvdb::FloatGrid, VelocityField> advection(
        *grid, VelocityField(flow, begin, begin + time), &interrupter);
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
