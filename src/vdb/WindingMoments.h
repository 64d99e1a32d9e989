// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/math/Vec.h"
#include "curlew/vdb/MeshFile.h"

#include <array>
#include <span>

// What a cluster of triangles is from afar, for WindingNumber.
namespace curlew::winding {

struct Triangle {
    std::array<Vec3d, 3> corner;

    Vec3d middle() const { return (corner[0] + corner[1] + corner[2]) * (1.0 / 3); }
    /// Normal to it, as long as its area is large.
    Vec3d area() const { return cross(corner[1] - corner[0], corner[2] - corner[0]) * 0.5; }
};

/// A triangle of a mesh.
Triangle triangleOf(const Mesh& mesh, size_t n);

/// Moments of the normals n of a surface, with y = x - center: ∫ n, ∫ n_i y_j, ∫ n_i y_j y_k (j ≤ k: xx xy xz yy yz
/// zz).
struct Moments {
    Vec3d center{}; ///< Of the surface, by area.
    double area = 0;
    Vec3d lower{}, upper{}; ///< The box around its corners.
    double radius = 0;      ///< All of it is that close to the center.
    Vec3d zeroth{};
    std::array<Vec3d, 3> first{};
    std::array<std::array<double, 6>, 3> second{};
};

Moments momentsOf(std::span<const Triangle> triangles);
Moments merged(const Moments& a, const Moments& b);

/// The solid angle of a cluster as seen from afar: with r = center - x, the Taylor series of n · r / |r|³ to the second
/// order,
///   (A · r + (rᵀ B r + C(r, r, r) / r²) / r²) / r³,  B = tr(M) - 3 M,  C = (15 T - 3 t) / 2,
/// where A, M and T are the moments and t is what is left of T after contraction.
struct Far {
    Vec3d center{};
    double reach2 = 0; ///< It holds beyond this squared distance.
    Vec3d a{};
    std::array<double, 6> b{};  ///< xx xy xz yy yz zz, mixed ones doubled
    std::array<double, 10> c{}; ///< xxx xxy xxz xyy xyz xzz yyy yyz yzz zzz, each with all of its permutations
};

Far farOf(const Moments& moments, double beta);

} // namespace curlew::winding
