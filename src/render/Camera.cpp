// SPDX-License-Identifier: Apache-2.0
#include "curlew/render/Camera.h"

#include "curlew/base/Error.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace curlew {

namespace {

double focalLength(double fieldOfView, int width, int height) {
    if (!(fieldOfView > 0 && fieldOfView <= 170))
        throw ValueError(fmt::format("a field of view of {} degrees; it must be above 0 and at most 170", fieldOfView));
    if (width < 1 || height < 1)
        throw ValueError(fmt::format("a picture of {} x {} pixels; both must be at least 1", width, height));
    return std::max(width, height) / (2 * std::tan(fieldOfView * std::numbers::pi / 360));
}

} // namespace

Camera::Camera(const Vec3d& eye, const Vec3d& target, const Vec3d& up, double fieldOfView, int width, int height)
    : mEye(eye), mFocal(focalLength(fieldOfView, width, height)), mWidth(width), mHeight(height) {
    const Vec3d toTarget = target - eye;
    if (!(length(toTarget) > 0)) throw ValueError("the camera is at its target; move one of them");
    mForward = normalized(toTarget);
    const Vec3d across = cross(mForward, up);
    if (!(length(across) > 1e-9 * length(up)))
        throw ValueError("the camera looks along its up direction; give another up");
    mRight = normalized(across);
    mUp = cross(mRight, mForward);
}

Camera Camera::atOrigin(const CameraOptions& o) {
    if (!(length(o.from) > 0)) throw ValueError("from=0,0,0 is not a direction");
    return {{}, -o.from, o.up, o.fieldOfView, o.width, o.height};
}

Camera Camera::around(const Box& box, const CameraOptions& o) {
    if (!box.finite()) throw ValueError("the camera cannot see all of an infinite box; give a box, or eye and target");
    const Vec3d center = box.center();
    const Camera axes = atOrigin(o);
    // The nearest eye at which every corner is within the picture; each corner requires a minimum distance.
    const double halfWidth = 0.5 * (1 - 2 * o.margin) * o.width, halfHeight = 0.5 * (1 - 2 * o.margin) * o.height;
    double distance = 0;
    for (int corner = 0; corner < 8; ++corner) {
        Vec3d p;
        for (int axis = 0; axis < 3; ++axis)
            p[axis] = ((corner >> axis) & 1 ? box.upper : box.lower)[axis] - center[axis];
        const double needed = std::max(std::abs(dot(p, axes.mRight)) * axes.mFocal / halfWidth,
                                       std::abs(dot(p, axes.mUp)) * axes.mFocal / halfHeight);
        distance = std::max(distance, needed - dot(p, axes.mForward));
    }
    if (!(distance > 0)) throw ValueError("the box that the camera should show is a point");
    return {center + normalized(o.from) * distance, center, o.up, o.fieldOfView, o.width, o.height};
}

Camera Camera::around(const std::vector<Vec3d>& points, const CameraOptions& o) {
    const Camera axes = atOrigin(o);
    // With the eye at (x, y, -distance) in the camera's axes, a point (px, py, pz) is within the picture if |px - x| <=
    // slope (pz + distance). So each point requires x >= px - slope pz - slope distance and x <= px + slope pz + slope
    // distance, and likewise for y.
    Vec3d eye;
    double distance = -std::numeric_limits<double>::infinity();
    for (const bool across : {true, false}) {
        const Vec3d& axis = across ? axes.mRight : axes.mUp;
        const double slope = 0.5 * (1 - 2 * o.margin) * (across ? o.width : o.height) / axes.mFocal;
        double lower = std::numeric_limits<double>::infinity(), upper = -lower;
        for (const Vec3d& p : points) {
            const double place = dot(p, axis), depth = slope * dot(p, axes.mForward);
            upper = std::max(upper, place - depth);
            lower = std::min(lower, place + depth);
        }
        eye += axis * (0.5 * (lower + upper));
        distance = std::max(distance, (upper - lower) / (2 * slope));
    }
    double nearest = std::numeric_limits<double>::infinity();
    for (const Vec3d& p : points) nearest = std::min(nearest, dot(p, axes.mForward));
    if (!(nearest + distance > 0)) throw ValueError("the camera has nothing to show, or only a point");
    eye -= axes.mForward * distance;
    return {eye, eye + axes.mForward * (nearest + distance), o.up, o.fieldOfView, o.width, o.height};
}

Vec3d Camera::direction(double x, double y) const {
    return normalized(mForward * mFocal + mRight * (x - 0.5 * mWidth) + mUp * (0.5 * mHeight - y));
}

} // namespace curlew
