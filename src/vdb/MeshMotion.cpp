// SPDX-License-Identifier: Apache-2.0
#include "curlew/vdb/MeshMotion.h"

#include <openvdb/math/Mat3.h>

#include <algorithm>
#include <limits>

namespace curlew {

namespace {

Vec3d at(const Mesh& mesh, size_t k) {
    const auto& p = mesh.points[k];
    return {{static_cast<double>(p[0]), static_cast<double>(p[1]), static_cast<double>(p[2])}};
}

Vec3d meanOf(const Mesh& mesh) {
    Vec3d sum;
    for (size_t k = 0; k < mesh.points.size(); ++k) sum += at(mesh, k);
    return sum * (1 / static_cast<double>(mesh.points.size()));
}

/// Returns the eigenvectors of Hᵀ H, the one with the largest eigenvalue first.
std::array<Vec3d, 3> rightVectors(const Matrix3& H) {
    openvdb::Mat3d squared, vectors;
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) {
            squared(i, j) = 0;
            for (int k = 0; k < 3; ++k) squared(i, j) += H[k][i] * H[k][j];
        }
    openvdb::Vec3d values;
    openvdb::math::diagonalizeSymmetricMatrix(squared, vectors, values);
    std::array<int, 3> order{0, 1, 2};
    std::sort(order.begin(), order.end(), [&](int a, int b) { return values[a] > values[b]; });
    std::array<Vec3d, 3> sorted;
    for (size_t k = 0; k < 3; ++k)
        for (int i = 0; i < 3; ++i) sorted[k][i] = vectors(i, order[k]);
    return sorted;
}

/// Returns the rotation R that minimises Σ |R p − q|², from H = Σ p qᵀ; nullopt if p or q are collinear.
std::optional<Matrix3> kabsch(const Matrix3& H, double rounding) {
    auto v = rightVectors(H);
    std::array<Vec3d, 3> u;
    for (size_t k = 0; k < 2; ++k) {
        u[k] = H * v[k];
        if (k == 1) u[1] -= u[0] * dot(u[0], u[1]);
        const double size = length(u[k]);
        if (!(size > rounding)) return {};
        u[k] *= 1 / size;
    }
    // Defined for flat meshes too, and never a reflection.
    u[2] = cross(u[0], u[1]);
    v[2] = cross(v[0], v[1]);
    Matrix3 R;
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) R[i][j] = v[0][i] * u[0][j] + v[1][i] * u[1][j] + v[2][i] * u[2][j];
    return R;
}

} // namespace

bool correspond(const Mesh& a, const Mesh& b) {
    return a.points.size() == b.points.size() && a.triangles == b.triangles && a.quads == b.quads;
}

Box boundsOf(const Mesh& mesh) {
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    Box box{{{kInfinity, kInfinity, kInfinity}}, {{-kInfinity, -kInfinity, -kInfinity}}};
    for (size_t k = 0; k < mesh.points.size(); ++k) {
        const Vec3d p = at(mesh, k);
        for (int axis = 0; axis < 3; ++axis) {
            box.lower[axis] = std::min(box.lower[axis], p[axis]);
            box.upper[axis] = std::max(box.upper[axis], p[axis]);
        }
    }
    return box;
}

RigidFit rigidFit(const Mesh& from, const Mesh& to) {
    RigidFit fit{.home = {.axes = {}, .origin = meanOf(from)}, .now = {.axes = {}, .origin = meanOf(to)}};
    if (from.points == to.points) return fit;
    const double size = length(boundsOf(from).size());
    Matrix3 H;
    for (Vec3d& row : H.rows) row = {};
    for (size_t k = 0; k < from.points.size(); ++k) {
        const Vec3d p = at(from, k) - fit.home.origin, q = at(to, k) - fit.now.origin;
        for (int i = 0; i < 3; ++i) H[i] += q * p[i];
    }
    fit.residual = std::numeric_limits<double>::infinity();
    const auto R = kabsch(H, 1e-12 * size * size * static_cast<double>(from.points.size()));
    if (!R) return fit;
    fit.now.axes = *R;
    double farthest = 0;
    for (size_t k = 0; k < from.points.size(); ++k)
        farthest = std::max(farthest, length(*R * (at(from, k) - fit.home.origin) + fit.now.origin - at(to, k)));
    fit.residual = farthest / size;
    return fit;
}

namespace {

/// Returns, for each point, the sum of its positions in the four frames with these weights.
std::vector<openvdb::Vec3s> weightedPoints(const MeshKeys& keys, const std::array<double, 4>& weights) {
    const std::array<const Mesh*, 4> frames{keys.before.get(), keys.from.get(), keys.to.get(), keys.after.get()};
    std::vector<openvdb::Vec3s> points(keys.from->points.size());
    for (size_t k = 0; k < points.size(); ++k) {
        Vec3d p;
        for (size_t n = 0; n < 4; ++n)
            if (frames[n]) p += at(*frames[n], k) * weights[n];
        for (int axis = 0; axis < 3; ++axis) points[k][axis] = static_cast<float>(p[axis]);
    }
    return points;
}

} // namespace

Mesh meshBetween(const MeshKeys& keys, double part) {
    if (part <= 0) return *keys.from;
    if (part >= 1) return *keys.to;
    Mesh mesh = *keys.from;
    mesh.points = weightedPoints(keys, hermiteWeights(keys.before != nullptr, keys.after != nullptr, part));
    return mesh;
}

std::vector<openvdb::Vec3s> velocitiesBetween(const MeshKeys& keys, double part, double seconds) {
    auto weights = hermiteSlopes(keys.before != nullptr, keys.after != nullptr, part);
    for (double& weight : weights) weight /= seconds;
    return weightedPoints(keys, weights);
}

} // namespace curlew
