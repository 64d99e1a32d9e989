// SPDX-License-Identifier: Apache-2.0
#include "curlew/track/WallVelocity.h"

#include "AroundWall.h"
#include "PerDistance.h"
#include "RigidPotentials.h"
#include "curlew/base/Error.h"
#include "curlew/field/Algebra.h"
#include "curlew/field/ForEachBatch.h"
#include "curlew/math/Fade.h"
#include "curlew/math/Rotation.h"
#include "curlew/track/WallMotion.h"

#include <algorithm>
#include <utility>

namespace curlew {

namespace {

/// The fraction of the interval over which the pose of a rigid wall is differentiated. The errors of the differences
/// and of rounding are then both far below the precision of float.
constexpr double kRigidStep = 0.01;

/// Returns the derivative of f by time at the first of three equidistant times.
template <class T>
T derivative(const T& now, const T& next, const T& afterNext, double step) {
    return (next * 4.0 - afterNext - now * 3.0) * (1 / (2 * step));
}

/// 1 − α as a function of the distance: 1 at the wall, 0 beyond its layer.
struct Share {
    Side side;
    double width;

    Univariate<double> at(double distance) const {
        // The inside of a rigid body moves with it.
        const double sign = side == Side::outside || distance > 0 ? 1 : -1, rate = sign / width;
        const Univariate<double> fade = quinticFade(distance * rate);
        return {1 - fade.value, -fade.first * rate, -fade.second * rate * rate, -fade.third * rate * rate * rate};
    }
};

struct ShareField {
    ScalarField distance;
    Share share;

    template <int Order, class T>
    void evalBatch(const PointBatch& points, JetBatch<T, Order>& jets) const {
        distance.eval(points, jets);
        for (int i = 0; i < points.size; ++i) {
            const auto d = jets[i];
            const Univariate<double> s = share.at(static_cast<double>(d.value));
            jets.set(i, compose(d, Univariate<T>{static_cast<T>(s.value), static_cast<T>(s.first),
                                                 static_cast<T>(s.second), static_cast<T>(s.third)}));
        }
    }
    Interval range() const { return {0, 1}; }
};

} // namespace

WallVelocity::WallVelocity(const Wall& now, const Wall& next, const Wall& afterNext, double step, const Box& box)
    : mWall(now), mStep(step) {
    if (!std::isfinite(step) || step == 0) throw ValueError("the step must be finite and not zero");
    const WallMotion motion(now, afterNext, box, 2 * step), half(now, next, box, step);
    mStill = motion.still() && half.still();
    mRigid = (motion.rigid() || motion.still()) && (half.rigid() || half.still());
    if (mStill) return;
    if (!mRigid) {
        mLater = std::pair(next, afterNext);
        return;
    }
    const WallExtent extent(now, box);
    mCentre = extent.middle;
    differentiatePoses(now.sdf.pose, next.sdf.pose, afterNext.sdf.pose);
    const ScalarField share{ShareField{now.sdf.distance, {now.side, now.width}}};
    const auto add = [&](const Flow::Potentials& pair) { mTerms.push_back({share * pair[0], pair[1]}); };
    if (length(mTranslation) > 0)
        for (const Push& push : translationPotentials(mTranslation, extent)) add(push.potentials);
    if (length(mRotation) > 0) add(rotationPotentials(mRotation, mCentre));
    if (!mTerms.empty()) mSum.emplace(mTerms, Domain{});
}

void WallVelocity::differentiatePoses(const Pose& now, const Pose& next, const Pose& afterNext) {
    const auto turn = [&](const Pose& later) { return later.axes * transpose(now.axes); };
    const auto centre = [&](const Pose& later) { return later.origin + turn(later) * (mCentre - now.origin); };
    mTranslation = derivative(mCentre, centre(next), centre(afterNext), mStep);
    mRotation = derivative(Vec3d{}, rotationVector(turn(next)), rotationVector(turn(afterNext)), mStep);
    // Drop a component that is only rounding error.
    const double size = length(mCentre) + mWall.width, noise = 1e-14 / std::abs(mStep);
    if (length(mTranslation) <= noise * size) mTranslation = {};
    if (length(mRotation) <= noise) mRotation = {};
}

void WallVelocity::eval(const PointBatch& points, VecBatch<double>& velocity) const {
    for (auto& axis : velocity.c) axis.fill(0);
    if (mStill) return;
    if (mRigid) {
        if (mSum) mSum->velocity(points, velocity);
        return;
    }
    JetBatch<double, 1> now;
    JetBatch<double, 0> next, afterNext;
    mWall.sdf.distance.eval(points, now);
    mLater->first.sdf.distance.eval(points, next);
    mLater->second.sdf.distance.eval(points, afterNext);
    const auto& surface = mWall.sdf.surfaceVelocity;
    VecBatch<double> slide;
    for (size_t axis = 0; axis < 3 && surface; ++axis) {
        JetBatch<double, 0> component;
        (*surface)[axis].eval(points, component);
        slide.c[axis] = component.c[0];
    }
    const Share share{Side::both, mWall.width};
    for (int i = 0; i < points.size; ++i) {
        const auto d = now[i];
        const double change = derivative(d.value, next[i].value, afterNext[i].value, mStep);
        const Vec3d normal = perDistance(d.gradient);
        Vec3d w = normal * -change;
        if (surface) w += slide[i] - normal * dot(slide[i], d.gradient);
        velocity.set(i, w * share.at(d.value).value);
    }
}

WallVelocity::Speeds WallVelocity::speeds(const Box& box) const {
    Speeds speeds;
    if (!mRigid || mStill) return speeds;
    const auto moves = [this](double distance) {
        return distance < mWall.width && (mWall.side == Side::outside || distance > -mWall.width);
    };
    visitAround(mWall, box, [&](const PointBatch& points) {
        JetBatch<double, 0> distance;
        mWall.sdf.distance.eval(points, distance);
        VecBatch<double> velocity;
        eval(points, velocity);
        for (int i = 0; i < points.size; ++i) {
            if (!moves(distance[i].value)) continue;
            speeds.wall = std::max(speeds.wall, length(mTranslation + cross(mRotation, points[i] - mCentre)));
            speeds.air = std::max(speeds.air, length(velocity[i]));
        }
    });
    return speeds;
}

DistanceRange WallVelocity::range() const {
    if (mStill) return {std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity()};
    DistanceRange range{-mWall.width, mWall.width};
    if (mRigid && mWall.side == Side::outside) range.lower = -std::numeric_limits<double>::infinity();
    return range;
}

bool WallVelocity::isFar(const Vec3d& position, double radius) const {
    const DistanceRange moves = range();
    const double d = mWall.sdf.distance.at<0>(position).value, reach = mWall.sdf.lipschitz * radius;
    return d - reach >= moves.upper || d + reach <= moves.lower;
}

std::optional<WallVelocity> wallVelocity(const FlowInTime& flow, double time, double interval) {
    if (flow.steady()) return {};
    const Domain now = flow.at(time).domain();
    if (!now.wall) return {};
    const auto over = [&](double step) -> std::optional<WallVelocity> {
        const Domain next = flow.at(time + step).domain(), afterNext = flow.at(time + 2 * step).domain();
        if (!next.wall || !afterNext.wall) return {};
        return WallVelocity(*now.wall, *next.wall, *afterNext.wall, step, now.box);
    };
    auto wall = over(interval / 2);
    if (wall && wall->rigid() && !wall->still()) wall = over(kRigidStep * interval);
    if (!wall || wall->still()) return {};
    return wall;
}

void addWallVelocity(const WallVelocity& wall, Points& particles) {
    Points& p = particles;
    for (auto* array : {&p.vx, &p.vy, &p.vz}) array->resize(p.size());
    forEachBatch(PointsBy{p.size(), [&](size_t k) { return p.position(k); }},
                 [&](const PointBatch& points, size_t begin) {
                     VecBatch<double> w;
                     wall.eval(points, w);
                     for (int i = 0; i < points.size; ++i) {
                         const size_t k = begin + static_cast<size_t>(i);
                         p.vx[k] += static_cast<float>(w[i][0]);
                         p.vy[k] += static_cast<float>(w[i][1]);
                         p.vz[k] += static_cast<float>(w[i][2]);
                     }
                 });
}

} // namespace curlew
