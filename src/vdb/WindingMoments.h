// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/math/Vec.h"
#include "curlew/vdb/MeshFile.h"

#include <array>
#include <span>

// Far-field approximation of a cluster of triangles, for WindingNumber.
namespace curlew::winding {

struct Triangle {
    std::array<Vec3d, 3> corner;

    Vec3d middle() const { return (corner[0] + corner[1] + corner[2]) * (1.0 / 3); }
    /// Returns the vector area: normal to the triangle, with the area as its length.
    Vec3d area() const { return cross(corner[1] - corner[0], corner[2] - corner[0]) * 0.5; }
};

/// Returns triangle n of a mesh.
Triangle triangleOf(const Mesh& mesh, size_t n);

/// Moments of the normals n of a surface, with y = x - center: ∫ n, ∫ n_i y_j, ∫ n_i y_j y_k (j ≤ k: xx xy xz yy yz
/// zz).
struct Moments {
    Vec3d center{}; ///< Centroid of the surface.
    double area = 0;
    Vec3d lower{}, upper{}; ///< Bounding box.
    double radius = 0;      ///< Upper bound of the distance of any point from the center.
    Vec3d zeroth{};
    std::array<Vec3d, 3> first{};
    std::array<std::array<double, 6>, 3> second{};
};

Moments momentsOf(std::span<const Triangle> triangles);
Moments merged(const Moments& a, const Moments& b);

/// The solid angle of a cluster as seen from afar. With r = center - x, it is the Taylor series of n · r / |r|³ to
/// second order,
///     (A · r + (rᵀ B r + C(r, r, r) / r²) / r²) / r³,  B = tr(M) - 3 M,  C = (15 T - 3 t) / 2,
/// where A, M and T are the moments of order 0, 1 and 2, and t is T contracted over each pair of indices.
struct Far {
    Vec3d center{};
    double reach2 = 0; ///< Valid beyond this squared distance.
    Vec3d a{};
    std::array<double, 6> b{};  ///< xx xy xz yy yz zz; mixed ones are doubled
    std::array<double, 10> c{}; ///< xxx xxy xxz xyy xyz xzz yyy yyz yzz zzz, each summed over its permutations
};

Far farOf(const Moments& moments, double beta);

} // namespace curlew::winding
