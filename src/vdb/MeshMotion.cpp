// SPDX-License-Identifier: Apache-2.0
#include "curlew/vdb/MeshMotion.h"

#include <algorithm>
#include <cmath>
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

/// Turns axes p and q of a symmetric matrix so that its element (p, q) vanishes, and its eigenvectors so far with them.
void turn(Matrix3& S, std::array<Vec3d, 3>& vectors, int p, int q) {
    if (S[p][q] == 0) return;
    const double ratio = (S[q][q] - S[p][p]) / (2 * S[p][q]);
    const double tangent = std::copysign(1.0, ratio) / (std::abs(ratio) + std::sqrt(ratio * ratio + 1));
    const double cosine = 1 / std::sqrt(tangent * tangent + 1), sine = tangent * cosine;
    const auto pair = [&](double& a, double& b) {
        const double old = a;
        a = cosine * old - sine * b;
        b = sine * old + cosine * b;
    };
    for (int k = 0; k < 3; ++k) pair(S[k][p], S[k][q]);
    for (int k = 0; k < 3; ++k) pair(S[p][k], S[q][k]);
    for (int k = 0; k < 3; ++k) pair(vectors[static_cast<size_t>(p)][k], vectors[static_cast<size_t>(q)][k]);
}

/// Returns the eigenvectors of Hᵀ H, the one with the largest eigenvalue first, by cyclic Jacobi rotations (Golub and
/// Van Loan, Matrix Computations, 8.5). They are orthonormal even if eigenvalues are equal, as those of a ball; those
/// of openvdb::math::diagonalizeSymmetricMatrix() are not.
std::array<Vec3d, 3> rightVectors(const Matrix3& H) {
    constexpr int kSweeps = 10; // the remaining elements are squared in each, so four suffice
    Matrix3 S;
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) S[i][j] = H[0][i] * H[0][j] + H[1][i] * H[1][j] + H[2][i] * H[2][j];
    std::array<Vec3d, 3> vectors{Vec3d{{1, 0, 0}}, Vec3d{{0, 1, 0}}, Vec3d{{0, 0, 1}}};
    for (int sweep = 0; sweep < kSweeps; ++sweep)
        for (const auto& [p, q] : {std::pair(0, 1), std::pair(0, 2), std::pair(1, 2)}) turn(S, vectors, p, q);
    std::array<int, 3> order{0, 1, 2};
    std::sort(order.begin(), order.end(), [&](int a, int b) { return S[a][a] > S[b][b]; });
    return {vectors[static_cast<size_t>(order[0])], vectors[static_cast<size_t>(order[1])],
            vectors[static_cast<size_t>(order[2])]};
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
