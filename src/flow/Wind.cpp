// SPDX-License-Identifier: Apache-2.0
#include "curlew/flow/Wind.h"

#include "curlew/base/Require.h"
#include "curlew/field/Algebra.h"

#include <fmt/format.h>

#include <cmath>

namespace curlew {

namespace {

Vec3d unitOf(const Vec3d& v, const char* what) {
    const double size = length(v);
    if (!(size > 0) || !std::isfinite(size)) throw ValueError(fmt::format("{} must not be zero", what));
    return v * (1 / size);
}

/// Returns the component of v perpendicular to the unit vector n.
Vec3d acrossOf(const Vec3d& v, const Vec3d& n) { return v - n * dot(v, n); }

/// Returns the extent of a box along a direction.
double extent(const Box& box, const Vec3d& direction) {
    double sum = 0;
    for (int i = 0; i < 3; ++i) sum += std::abs(direction[i]) * box.size()[i];
    return sum;
}

} // namespace

Vec3d windAcross(const Sdf& shape, const WindOptions& options) {
    const Vec3d n = unitOf(options.direction, "the direction of the wind");
    if (options.across) {
        const Vec3d b = acrossOf(*options.across, n);
        if (!(length(b) > 1e-6 * length(*options.across)))
            throw ValueError("across= is parallel to the wind; choose another direction");
        return unitOf(b, "the direction across the wind (across=)");
    }
    std::optional<Vec3d> narrowest;
    for (const int i : {1, 2, 0}) { // of equal extents, up comes first
        Vec3d axis;
        axis[i] = 1;
        const Vec3d b = acrossOf(axis, n);
        if (!(length(b) > 0.5)) continue;
        const Vec3d unit = b * (1 / length(b));
        if (!narrowest || extent(shape.bounds, unit) < 0.999 * extent(shape.bounds, *narrowest)) narrowest = unit;
    }
    return *narrowest;
}

double windWidth(const Sdf& shape, const WindOptions& options) {
    if (!shape.bounds.finite()) throw ValueError("the shape in the wind is unbounded; give layer=");
    return extent(shape.bounds, windAcross(shape, options)) / 2;
}

Flow windFlow(const Wall& wall, const std::optional<ScalarField>& noise, const WindOptions& options) {
    requirePositive(options.speed, "the speed of the wind");
    requirePositive(wall.width, "width");
    if (!(options.gusts >= 0) || !std::isfinite(options.gusts))
        throw ValueError(fmt::format("gusts {} must be 0 or more", options.gusts));
    const Vec3d n = unitOf(options.direction, "the direction of the wind"), b = windAcross(wall.sdf, options),
                a = cross(b, n); // a × b = n
    const Box& bounds = wall.sdf.bounds;
    const Vec3d centre = bounds.finite() ? bounds.center() : Vec3d{};
    const ScalarField along = rampField(b, -dot(b, centre));
    // clipped() levels off at half its range.
    const double sign = wall.side == Side::inside ? -1 : 1;
    const ScalarField ramp = (sign * 2 / wall.width) * clipped(wall.sdf.distance, wall.width);
    ScalarField f = rampField(a * options.speed, -options.speed * dot(a, centre));
    Domain domain = Domain::of(wall, options.padding);
    if (noise && options.gusts > 0) {
        const double now = rmsOf(Flow(*noise, along, {.box = domain.box, .wall = {}})).speed;
        if (!(now > 0)) throw ValueError("the noise makes no gusts: it is constant across the wind");
        f = f + (options.gusts * options.speed / now) * *noise;
    }
    constexpr double kJudged = 0.25; // of the ramp's width
    domain.wall->width *= kJudged;
    return Flow(f, ramp * along, domain);
}

} // namespace curlew
