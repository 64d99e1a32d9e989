// SPDX-License-Identifier: Apache-2.0
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

namespace {

template <int N>
Vec<double, N> filled(double value) {
    Vec<double, N> v;
    v.c.fill(value);
    return v;
}

} // namespace

template <int N>
SdfN<N> sphereSdf(double radius) {
    const shapes::Sphere sphere{radius};
    sphere.check();
    return {formulaField<N>(sphere), BoxN<N>{}.padded(radius)};
}

template <int N>
SdfN<N> boxSdf(const Vec<double, N>& size, double rounding) {
    const shapes::RoundedBox<N> box{size, rounding};
    box.check();
    return {formulaField<N>(box), box.bounds()};
}

Sdf torusSdf(double radius, double tube) { return sdfOf(shapes::Torus{radius, tube}); }
Sdf capsuleSdf(double length, double radius) { return sdfOf(shapes::Capsule{length, radius}); }
Sdf gyroidSdf(double wavelength, double thickness) { return sdfOf(shapes::Gyroid{wavelength, thickness}); }

template <int N>
SdfN<N> planeSdf(const Vec<double, N>& normal, double offset) {
    const double size = length(normal);
    requirePositive(size, "length of the normal");
    return {rampField(normal * (1 / size), -offset / size), shapes::everywhere<N>()};
}

template <int N>
SdfN<N> placed(const SdfN<N>& sdf, const PlacementN<N>& placement) {
    const double scale = placement.scale[0];
    if (!(scale > 0) || placement.scale != filled<N>(scale))
        throw ValueError("a signed distance can only be scaled by one positive factor for all axes");
    const Matrix<N, N> turn = rotationOf(placement);
    return {scale * placed(sdf.distance, placement),
            placed(sdf.bounds, placement),
            sdf.reach * scale,
            sdf.lipschitz,
            {turn * sdf.pose.axes, turn * (sdf.pose.origin * scale) + placement.offset}};
}

Sdf extruded(const SdfN<2>& sdf) {
    Sdf tall{.distance = projected(sdf.distance, Matrix<2, 3>{}),
             .bounds = shapes::everywhere(),
             .reach = sdf.reach,
             .lipschitz = sdf.lipschitz};
    for (int i = 0; i < 2; ++i) {
        tall.bounds.lower[i] = sdf.bounds.lower[i];
        tall.bounds.upper[i] = sdf.bounds.upper[i];
        tall.pose.origin[i] = sdf.pose.origin[i];
        for (int j = 0; j < 2; ++j) tall.pose.axes[i][j] = sdf.pose.axes[i][j];
    }
    return tall;
}

namespace {

/// Returns the box around a and b.
template <int N>
BoxN<N> around(const BoxN<N>& a, const BoxN<N>& b) {
    BoxN<N> box;
    for (int i = 0; i < N; ++i) {
        box.lower[i] = std::min(a.lower[i], b.lower[i]);
        box.upper[i] = std::max(a.upper[i], b.upper[i]);
    }
    return box;
}

template <int N>
BoxN<N> shared(const BoxN<N>& a, const BoxN<N>& b) {
    BoxN<N> box;
    for (int i = 0; i < N; ++i) {
        box.lower[i] = std::max(a.lower[i], b.lower[i]);
        box.upper[i] = std::min(a.upper[i], b.upper[i]);
    }
    return box;
}

} // namespace

template <int N>
SdfN<N> unite(const SdfN<N>& a, const SdfN<N>& b, double smoothing) {
    return {smoothMin(a.distance, b.distance, smoothing), around(a.bounds, b.bounds).padded(smoothing / 6), 0,
            std::max(a.lipschitz, b.lipschitz), a.pose};
}

template <int N>
SdfN<N> intersect(const SdfN<N>& a, const SdfN<N>& b, double smoothing) {
    return {smoothMax(a.distance, b.distance, smoothing), shared(a.bounds, b.bounds), 0,
            std::max(a.lipschitz, b.lipschitz), a.pose};
}

template <int N>
SdfN<N> subtract(const SdfN<N>& a, const SdfN<N>& b, double smoothing) {
    return {smoothMax(a.distance, -1.0 * b.distance, smoothing), a.bounds, 0, std::max(a.lipschitz, b.lipschitz),
            a.pose};
}

#define CURLEW_INSTANTIATE(N) template SdfN<N> sphereSdf<N>(double);
CURLEW_FOR_DIMENSIONS(CURLEW_INSTANTIATE)
#undef CURLEW_INSTANTIATE

#define CURLEW_INSTANTIATE(N)                                           \
    template SdfN<N> boxSdf(const Vec<double, N>&, double);             \
    template SdfN<N> planeSdf(const Vec<double, N>&, double);           \
    template SdfN<N> placed(const SdfN<N>&, const PlacementN<N>&);      \
    template SdfN<N> unite(const SdfN<N>&, const SdfN<N>&, double);     \
    template SdfN<N> intersect(const SdfN<N>&, const SdfN<N>&, double); \
    template SdfN<N> subtract(const SdfN<N>&, const SdfN<N>&, double);
CURLEW_INSTANTIATE(2)
CURLEW_INSTANTIATE(3)
#undef CURLEW_INSTANTIATE

} // namespace curlew
