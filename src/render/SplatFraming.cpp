// SPDX-License-Identifier: Apache-2.0
#include "curlew/base/Error.h"
#include "curlew/math/Percentile.h"
#include "curlew/render/Splat.h"
#include "curlew/track/Scatter.h"

#include <algorithm>
#include <cmath>

namespace curlew {

namespace {

constexpr double kStrays = 0.5; ///< Outliers are this far outside the percentile range, relative to its size.

Vec3d positionOf(const Splats& splats, size_t k) { return {{splats.x[k], splats.y[k], splats.z[k]}}; }
bool isFinite(const Vec3d& p) { return std::isfinite(p[0]) && std::isfinite(p[1]) && std::isfinite(p[2]); }

Box boundsOf(const Splats& splats) {
    Box box{Vec3d{{1, 1, 1}} * HUGE_VAL, Vec3d{{1, 1, 1}} * -HUGE_VAL};
    for (size_t k = 0; k < splats.x.size(); ++k) {
        const Vec3d p = positionOf(splats, k);
        if (!isFinite(p)) continue;
        for (int axis = 0; axis < 3; ++axis) {
            box.lower[axis] = std::min(box.lower[axis], p[axis]);
            box.upper[axis] = std::max(box.upper[axis], p[axis]);
        }
    }
    if (!(box.lower[0] <= box.upper[0])) throw ValueError("there is nothing to draw: no point has a finite position");
    return box;
}

/// Returns enough positions of the splats, without the outliers in the picture. Of few positions none is an outlier.
std::vector<Vec3d> withoutStrays(const Splats& splats, const Camera& axes) {
    constexpr size_t kFew = 200; // the outermost of these are at the percentiles 0.5 and 99.5
    std::vector<Vec3d> points;
    std::vector<double> across, upwards;
    const size_t most = std::min(splats.x.size(), kEnoughSplats);
    points.reserve(most), across.reserve(most), upwards.reserve(most);
    forEnough(splats.x.size(), [&](size_t k) {
        const Vec3d p = positionOf(splats, k);
        if (!isFinite(p)) return;
        points.push_back(p);
        across.push_back(dot(p, axes.right()));
        upwards.push_back(dot(p, axes.up()));
    });
    if (points.size() < kFew) return points;
    const auto rangeOf = [](std::vector<double> values) {
        const Interval range = percentiles(std::move(values), 0.005, 0.995);
        const double margin = kStrays * (range.upper - range.lower);
        return Interval{range.lower - margin, range.upper + margin};
    };
    const Interval x = rangeOf(std::move(across)), y = rangeOf(std::move(upwards));
    std::erase_if(points,
                  [&](const Vec3d& p) { return !x.contains(dot(p, axes.right())) || !y.contains(dot(p, axes.up())); });
    return points;
}

/// Returns enough points of the wall's surface to frame it; empty if the wall is unbounded.
std::vector<Vec3d> placesOnWall(const Domain& domain) {
    constexpr size_t kPlaces = 2000;
    std::vector<Vec3d> places;
    if (!domain.wall || !domain.wall->sdf.bounds.finite()) return places;
    const Domain around{.box = domain.wall->sdf.bounds, .wall = domain.wall};
    const Points points = scatterFrom(around, 0, kPlaces, ScatterOptions{.on = ScatterOn::surface});
    for (size_t k = 0; k < points.size(); ++k) places.push_back(points.position(k));
    return places;
}

} // namespace

Splats Splats::of(const Points& points) { return {.x = points.x, .y = points.y, .z = points.z, .fade = points.fade}; }

Splats Splats::of(const Curves& curves) {
    Splats splats{.x = curves.x, .y = curves.y, .z = curves.z, .start = curves.start};
    for (size_t k = 0; k < curves.size(); ++k) splats.closed.push_back(curves.closed(k) ? 1 : 0);
    return splats;
}

Box Splats::bounds() const { return boundsOf(*this); }

Camera framing(const Splats& splats, const std::optional<Domain>& domain, CameraOptions options) {
    std::vector<Vec3d> points = domain ? placesOnWall(*domain) : std::vector<Vec3d>();
    if (splats.x.empty() && points.empty() && domain) return Camera::around(domain->box, options);
    if (!splats.x.empty()) {
        const std::vector<Vec3d> seen = withoutStrays(splats, Camera::atOrigin(options));
        const bool onePlace = std::all_of(seen.begin(), seen.end(), [&](const Vec3d& p) { return p == seen.front(); });
        if (onePlace) {
            const Box bounds = boundsOf(splats);
            const double margin = std::max(1e-6 * length(bounds.size()), 1e-9);
            if (points.empty()) return Camera::around(bounds.padded(margin), options);
        }
        points.insert(points.end(), seen.begin(), seen.end());
    }
    options.margin = kFramingMargin;
    return Camera::around(points, options);
}

} // namespace curlew
