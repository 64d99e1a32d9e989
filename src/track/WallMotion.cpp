// SPDX-License-Identifier: Apache-2.0
#include "curlew/track/WallMotion.h"

#include "AroundWall.h"
#include "BatchAdvector.h"
#include "PerDistance.h"
#include "RigidPotentials.h"
#include "curlew/field/Algebra.h"
#include "curlew/field/ForEachBatch.h"
#include "curlew/math/Fade.h"
#include "curlew/math/Rotation.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace curlew {

using namespace detail;

namespace {

constexpr double kRounding = 1e-12; ///< Of an angle in radians, or relative to a length.

/// Returns the maximum difference between two distances, the second taken at moved(x).
template <class Moved>
double greatestDifference(const Wall& from, const Wall& to, const Box& box, const Moved& moved) {
    double greatest = 0;
    visitAround(from, box, [&](const PointBatch& points) {
        PointBatch there;
        for (int i = 0; i < points.size; ++i) there.push(moved(points[i]));
        JetBatch<double, 0> before, after;
        from.sdf.distance.eval(points, before);
        to.sdf.distance.eval(there, after);
        for (int i = 0; i < points.size; ++i) greatest = std::max(greatest, std::abs(after[i].value - before[i].value));
    });
    return greatest;
}

Vec3d stay(const Vec3d& x) { return x; }

/// Returns an upper bound on the speed of a surface; 0 if its velocity is unknown.
double mostSpeed(const Sdf& sdf) {
    if (!sdf.surfaceVelocity) return 0;
    double squared = 0;
    for (const ScalarField& component : *sdf.surfaceVelocity) {
        const double most = component.range().maxAbs();
        squared += most * most;
    }
    return std::sqrt(squared);
}

/// Returns the number of steps for which none is longer than a quarter of the wall's layer.
int stepsFor(double travel, const Wall& wall) {
    return static_cast<int>(std::clamp(std::ceil(4 * travel / wall.width), 1.0, 64.0));
}

/// Moves the points for one second as seen from the wall, where the wall rests. In that frame, points far away move
/// with the negative of the wall's velocity ∇a × ∇b, and points at the wall rest. f = -alpha a and b are constant along
/// their paths. `travel`: distance that the wall moves; `size`: extent of the region.
void driftBack(const Wall& wall, double size, const Flow::Potentials& motion, double travel, int steps,
               std::vector<Vec3d>& points, const Monitor& monitor) {
    const auto& [a, b] = motion;
    const Flow flow(-1.0 * (layerFade(wall) * a), b, {.box = {}, .wall = wall});
    const AdvectOptions options{.time = 1, .steps = steps};
    const auto stepper = advectionStepper(flow, options, {.tolerance = {1e-9 * travel * size, 1e-9 * size}});
    forEachBatch(
        points,
        [&](const PointBatch& start, size_t begin) {
            BatchAdvector<3> advector(stepper, options, 0, {start});
            advector.run(monitor);
            storeBatch(advector.parts().front().tips.position, points, begin);
        },
        monitor);
}

} // namespace

WallMotion::WallMotion(const Wall& from, const Wall& to, const Box& box, double seconds)
    : mFrom(from), mTo(to), mBox(box), mSeconds(seconds) {
    if (from.side != to.side) throw ValueError("the flow cannot change sides of a moving wall");
    const Pose &before = from.sdf.pose, &after = to.sdf.pose;
    const bool samePose = before.axes == after.axes && before.origin == after.origin;
    if (samePose) {
        mMaxChange = greatestDifference(from, to, box, stay);
        if (seconds != 0 && from.sdf.surfaceVelocity && to.sdf.surfaceVelocity)
            mSlide = std::abs(seconds) * std::max(mostSpeed(from.sdf), mostSpeed(to.sdf));
        mStill = mMaxChange == 0 && mSlide == 0;
        return;
    }
    const auto turn = after.axes * transpose(before.axes);
    const Vec3d rotation = rotationVector(turn);
    mCentre = WallExtent(from, box).middle;
    mTranslation = after.origin + turn * (mCentre - before.origin) - mCentre;
    if (length(mTranslation) <= kRounding * (length(mCentre) + from.width)) mTranslation = {};
    mAngle = length(rotation) > kRounding ? length(rotation) : 0;
    mAxis = mAngle > 0 ? rotation * (1 / mAngle) : Vec3d{{0, 0, 1}};
    const auto moved = [&](const Vec3d& x) { return mCentre + mTranslation + turned(x - mCentre, mAxis, mAngle); };
    mRigid = greatestDifference(from, to, box, moved) <= 1e-6 * from.width;
    if (!mRigid) mMaxChange = greatestDifference(from, to, box, stay);
}

void WallMotion::carryRigidly(std::vector<Vec3d>& points, const Monitor& monitor) const {
    // In coordinates that move with the wall, in which the wall stays as it is in mFrom. Symmetric in time, and so of
    // second order.
    const WallExtent extent(mFrom, mBox);
    const double width = mFrom.width;
    const auto drift = [&](const Flow::Potentials& motion, double travel, double reach) {
        const double air = mFrom.sdf.bounds.finite() ? travel * (1 + 2 * reach / width) : travel;
        driftBack(mFrom, length(mBox.size()), motion, travel, stepsFor(air, mFrom), points, monitor);
    };
    const auto translate = [&](const Vec3d& travel, bool forward) {
        if (travel == Vec3d{}) return;
        std::vector<Push> parts = translationPotentials(travel, extent);
        if (!forward) std::reverse(parts.begin(), parts.end());
        for (const Push& part : parts) drift(part.potentials, length(travel) * part.share, part.reach);
    };
    translate(mTranslation * 0.5, true);
    if (mAngle > 0) {
        double farthest = 0;
        for (const Vec3d& p : points) farthest = std::max(farthest, length(p - mCentre));
        const Vec3d& half = extent.squares;
        drift(rotationPotentials(mAxis * mAngle, mCentre), mAngle * farthest,
              std::sqrt(std::max({half[0], half[1], half[2]})));
    }
    translate(turned(mTranslation * 0.5, mAxis, -mAngle), false);
    for (Vec3d& p : points) p = mCentre + mTranslation + turned(p - mCentre, mAxis, mAngle);
}

/// Returns how far points of the surface move during the whole motion, by the mean of their velocities at both ends,
/// weighted with s.
void WallMotion::evalSurface(const PointBatch& points, double s, VecBatch<double>& travel) const {
    for (size_t axis = 0; axis < 3; ++axis) {
        JetBatch<double, 0> before, after;
        (*mFrom.sdf.surfaceVelocity)[axis].eval(points, before);
        (*mTo.sdf.surfaceVelocity)[axis].eval(points, after);
        for (size_t i = 0; i < static_cast<size_t>(points.size); ++i)
            travel.c[axis][i] = mSeconds * ((1 - s) * before.c[0][i] + s * after.c[0][i]);
    }
}

void WallMotion::carryWithSurface(std::vector<Vec3d>& points, const Monitor& monitor) const {
    // The wall at s, 0 to 1, is the zero set of (1 - s) d_from + s d_to.
    const auto velocity = [&](const PointBatch& p, double s, VecBatch<double>& v) {
        JetBatch<double, 1> before, after;
        mFrom.sdf.distance.eval(p, before);
        mTo.sdf.distance.eval(p, after);
        VecBatch<double> slide;
        if (mSlide > 0) evalSurface(p, s, slide);
        for (int i = 0; i < p.size; ++i) {
            const auto b = before[i], a = after[i], d = b * (1 - s) + a * s;
            const double beta = 1 - quinticFade(std::abs(d.value) / mFrom.width).value;
            const Vec3d normal = perDistance(d.gradient);
            Vec3d u = normal * (b.value - a.value);
            if (mSlide > 0) u += slide[i] - normal * dot(slide[i], d.gradient);
            v.set(i, u * beta);
        }
    };
    const int steps = stepsFor(std::max(mMaxChange, mSlide), mFrom);
    std::array<double, kBatch> dt;
    dt.fill(1.0 / steps);
    forEachBatch(
        points,
        [&](PointBatch& p, size_t begin) {
            PointBatch to;
            for (int k = 0; k < steps; ++k) {
                StagesN<3> stages;
                velocity(p, static_cast<double>(k) / steps, stages[0]);
                const auto later = [&](const PointBatch& at, double node, VecBatch<double>& v) {
                    velocity(at, (k + node) / steps, v);
                };
                step(Scheme::rk4, p, dt, later, stages, to);
                p = to;
            }
            storeBatch(p, points, begin);
        },
        monitor);
}

namespace {

struct WallSide {
    bool allowed;
    double distance;
};

std::vector<WallSide> sidesOf(const Wall& wall, const std::vector<Vec3d>& points) {
    std::vector<WallSide> sides(points.size());
    const Domain domain{.wall = wall};
    forEachBatch(points, [&](const PointBatch& p, size_t begin) {
        std::array<bool, kBatch> allowed;
        std::array<double, kBatch> distance;
        classify(domain, p, allowed, distance);
        for (size_t i = 0; i < static_cast<size_t>(p.size); ++i) sides[begin + i] = {allowed[i], distance[i]};
    });
    return sides;
}

bool sameSide(const WallSide& before, const WallSide& after) {
    return staysOnSide(after.allowed, after.distance, before.distance);
}

/// Moves a point along the gradient until it has its former distance again. Returns the last position if that fails.
Vec3d atDistance(const Wall& wall, Vec3d point, double distance) {
    for (int k = 0; k < 20; ++k) {
        const auto d = wall.sdf.distance.at<1>(point);
        const double squared = dot(d.gradient, d.gradient);
        if (!(squared > 0) || d.value == distance) break;
        point += d.gradient * ((distance - d.value) / squared);
    }
    return point;
}

/// Returns a position near `moved` on the former side of the wall. Tries the former distance first, then halves of it,
/// because a gap may be closing; never closer than the rounding of classify() allows. Returns `moved` if all fail.
Vec3d restoredSide(const Wall& wall, const Vec3d& moved, const Vec3d& former, const WallSide& before) {
    constexpr int kHalvings = 12;
    for (const Vec3d& start : {moved, former}) {
        const double least = 0x1p-21 * (std::abs(start[0]) + std::abs(start[1]) + std::abs(start[2]));
        double distance = std::abs(before.distance);
        for (int k = 0; k <= kHalvings; ++k, distance /= 2) {
            const double signedDistance = std::copysign(std::max(distance, least), before.distance);
            const Vec3d point = atDistance(wall, start, signedDistance);
            if (sameSide(before, sidesOf(wall, {point}).front())) return point;
        }
    }
    return moved;
}

} // namespace

size_t WallMotion::carry(std::vector<Vec3d>& points, const Monitor& monitor) const {
    if (mStill) return 0;
    const std::vector<WallSide> before = sidesOf(mFrom, points), without = sidesOf(mTo, points);
    // Only the points that the layer touches during its motion.
    const double travelOfCentre = length(mTranslation);
    std::vector<size_t> taken;
    std::vector<Vec3d> moved;
    for (size_t k = 0; k < points.size(); ++k) {
        if (!before[k].allowed) continue;
        const double travel = mRigid ? travelOfCentre + mAngle * length(points[k] - mCentre) : 0;
        const double nearest = std::min(std::abs(before[k].distance), std::abs(without[k].distance));
        if (nearest >= mFrom.width + mFrom.sdf.lipschitz * travel && sameSide(before[k], without[k])) continue;
        taken.push_back(k);
        moved.push_back(points[k]);
    }
    if (mRigid)
        carryRigidly(moved, monitor);
    else
        carryWithSurface(moved, monitor);
    std::vector<WallSide> after = sidesOf(mTo, moved);
    size_t overrun = 0;
    for (size_t n = 0; n < taken.size(); ++n) {
        const size_t k = taken[n];
        const Vec3d former = std::exchange(points[k], moved[n]);
        if (sameSide(before[k], after[n])) continue;
        points[k] = restoredSide(mTo, moved[n], former, before[k]);
        overrun += !sameSide(before[k], sidesOf(mTo, {points[k]}).front());
    }
    return overrun;
}

double offMean(const Wall& before, const Wall& middle, const Wall& after, const Box& box) {
    double most = 0;
    visitAround(before, box, [&](const PointBatch& points) {
        JetBatch<double, 0> first, mean, last;
        before.sdf.distance.eval(points, first);
        middle.sdf.distance.eval(points, mean);
        after.sdf.distance.eval(points, last);
        for (int i = 0; i < points.size; ++i)
            most = std::max(most, std::abs(mean[i].value - (first[i].value + last[i].value) / 2));
    });
    return most;
}

double partLost(const Wall& begin, const Wall& middle, const Wall& end, const Box& box) {
    if (middle.sdf.reach > 0 || !(begin.sdf.reach > 0)) return 0;
    size_t inside = 0, lost = 0;
    visitAround(begin, box, [&](const PointBatch& points) {
        JetBatch<double, 0> before, after;
        begin.sdf.distance.eval(points, before);
        end.sdf.distance.eval(points, after);
        for (int i = 0; i < points.size; ++i) {
            if (before[i].value >= 0) continue;
            ++inside;
            lost += after[i].value >= begin.sdf.reach;
        }
    });
    return inside > 0 ? static_cast<double>(lost) / static_cast<double>(inside) : 0;
}

size_t WallMotion::carry(Points& p, const Monitor& monitor) const {
    if (mStill) return 0;
    std::vector<Vec3d> points(p.size());
    for (size_t k = 0; k < points.size(); ++k) points[k] = p.position(k);
    const size_t overrun = carry(points, monitor);
    for (size_t k = 0; k < points.size(); ++k) p.setPosition(k, points[k]);
    return overrun;
}

} // namespace curlew
