#include "curlew/field/Shapes.h"

#include "curlew/field/Algebra.h"
#include "curlew/field/Dimensions.h"
#include "curlew/field/ShapeModels.h"

namespace curlew {

template <class Shape>
Sdf sdfOf(const Shape& shape) {
    shape.check();
    Sdf sdf{formulaField(shape), shape.bounds()};
    if constexpr (requires { Shape::kReach; }) sdf.reach = Shape::kReach;
    return sdf;
}

#define CURLEW_INSTANTIATE(Shape) template Sdf sdfOf(const shapes::Shape&);
CURLEW_SHAPES(CURLEW_INSTANTIATE)
#undef CURLEW_INSTANTIATE

template <int N>
SdfN<N> sphereSdf(double radius) {
    const shapes::Sphere sphere{radius};
    sphere.check();
    return {formulaField<N>(sphere), BoxN<N>{}.padded(radius)};
}

Sdf boxSdf(const Vec3d& size, double rounding) { return sdfOf(shapes::RoundedBox{size, rounding}); }
Sdf torusSdf(double radius, double tube) { return sdfOf(shapes::Torus{radius, tube}); }
Sdf capsuleSdf(double length, double radius) { return sdfOf(shapes::Capsule{length, radius}); }
Sdf gyroidSdf(double wavelength, double thickness) { return sdfOf(shapes::Gyroid{wavelength, thickness}); }

Sdf planeSdf(const Vec3d& normal, double offset) {
    const double size = length(normal);
    requirePositive(size, "length of the normal");
    return {rampField(normal * (1 / size), -offset / size), shapes::everywhere()};
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
