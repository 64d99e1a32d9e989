#include "curlew/field/Shapes.h"

#include "ShapeModels.h"
#include "curlew/base/Require.h"
#include "curlew/field/Algebra.h"
#include "curlew/field/Dimensions.h"

#include <fmt/format.h>

namespace curlew {

using namespace detail;

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr Box kEverywhere{{{-kInfinity, -kInfinity, -kInfinity}}, {{kInfinity, kInfinity, kInfinity}}};

Box boxOfSize(const Vec3d& size) { return {size * -0.5, size * 0.5}; }

} // namespace

template <int N>
SdfN<N> sphereSdf(double radius) {
    requirePositive(radius, "radius");
    return {formulaField<N>(Sphere{radius}), BoxN<N>{}.padded(radius)};
}

Sdf boxSdf(const Vec3d& size, double rounding) {
    double shortest = kInfinity;
    for (const double edge : size.c) {
        requirePositive(edge, "size");
        shortest = std::min(shortest, edge);
    }
    if (!(rounding >= 0) || rounding > shortest / 2)
        throw ValueError(
            fmt::format("rounding {} must lie between 0 and half the shortest edge, {}", rounding, shortest / 2));
    const Vec3d inner = size * 0.5 - Vec3d{{rounding, rounding, rounding}};
    return {formulaField(RoundedBox{inner, rounding}), boxOfSize(size)};
}

Sdf torusSdf(double radius, double tube) {
    requirePositive(radius, "radius");
    requirePositive(tube, "tube");
    if (tube >= radius) throw ValueError(fmt::format("tube {} must be below the radius {}", tube, radius));
    return {formulaField(Torus{radius, tube}), boxOfSize({{2 * (radius + tube), 2 * tube, 2 * (radius + tube)}})};
}

Sdf capsuleSdf(double length, double radius) {
    requirePositive(length, "length");
    requirePositive(radius, "radius");
    return {formulaField(Capsule{length, radius}), boxOfSize({{2 * radius, length + 2 * radius, 2 * radius}})};
}

Sdf planeSdf(const Vec3d& normal, double offset) {
    const double size = length(normal);
    requirePositive(size, "length of the normal");
    return {rampField(normal * (1 / size), -offset / size), kEverywhere};
}

Sdf gyroidSdf(double wavelength, double thickness) {
    requirePositive(wavelength, "wavelength");
    requirePositive(thickness, "thickness");
    return {formulaField(Gyroid{wavelength, thickness}), kEverywhere, 0};
}

Sdf placed(const Sdf& sdf, const Placement& placement) {
    const double scale = placement.scale[0];
    if (!(scale > 0) || placement.scale != Vec3d{{scale, scale, scale}})
        throw ValueError("a signed distance can only be scaled by one positive factor for all axes");
    const Matrix3 turn = rotationOf(placement);
    Box bounds = sdf.bounds;
    if (bounds.finite()) {
        // The sphere around the box turns with it.
        const Vec3d corner{{1, 1, 1}};
        const Vec3d center =
            placement.rotate == Vec3d{} ? bounds.center() * scale + placement.offset : placement.offset;
        const double radius = (length(bounds.size()) / 2 + length(bounds.center())) * scale;
        bounds = placement.rotate == Vec3d{}
                     ? Box{bounds.lower * scale + placement.offset, bounds.upper * scale + placement.offset}
                     : Box{center - corner * radius, center + corner * radius};
    }
    return {scale * placed(sdf.distance, placement),
            bounds,
            sdf.reach * scale,
            sdf.steepness,
            {turn * sdf.pose.axes, turn * (sdf.pose.origin * scale) + placement.offset}};
}

namespace {

/// The box around a and b, or what they share.
Box around(const Box& a, const Box& b) {
    Box box;
    for (int i = 0; i < 3; ++i) {
        box.lower[i] = std::min(a.lower[i], b.lower[i]);
        box.upper[i] = std::max(a.upper[i], b.upper[i]);
    }
    return box;
}

Box shared(const Box& a, const Box& b) {
    Box box;
    for (int i = 0; i < 3; ++i) {
        box.lower[i] = std::max(a.lower[i], b.lower[i]);
        box.upper[i] = std::min(a.upper[i], b.upper[i]);
    }
    return box;
}

} // namespace

Sdf unite(const Sdf& a, const Sdf& b, double smoothing) {
    return {smoothMin(a.distance, b.distance, smoothing), around(a.bounds, b.bounds).padded(smoothing / 6), 0,
            std::max(a.steepness, b.steepness), a.pose};
}

Sdf intersect(const Sdf& a, const Sdf& b, double smoothing) {
    return {smoothMax(a.distance, b.distance, smoothing), shared(a.bounds, b.bounds), 0,
            std::max(a.steepness, b.steepness), a.pose};
}

Sdf subtract(const Sdf& a, const Sdf& b, double smoothing) {
    return {smoothMax(a.distance, -1.0 * b.distance, smoothing), a.bounds, 0, std::max(a.steepness, b.steepness),
            a.pose};
}

#define CURLEW_INSTANTIATE(N) template SdfN<N> sphereSdf<N>(double);
CURLEW_FOR_DIMENSIONS(CURLEW_INSTANTIATE)
#undef CURLEW_INSTANTIATE

} // namespace curlew
