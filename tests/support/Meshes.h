// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/base/Random.h"
#include "curlew/vdb/MeshFile.h"
#include "support/Places.h"

#include <openvdb/math/Proximity.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <numbers>

/// Test meshes with defects, and an exact inside test.
namespace curlew::test {

using openvdb::Vec3I;
using openvdb::Vec3s;

inline Mesh spot() { return readMesh(sourceDir() + "/scenes/spot.obj"); }

/// The triangles of a mesh, quads cut from their first corner to their third.
inline std::vector<Vec3I> trianglesOf(const Mesh& mesh) {
    std::vector<Vec3I> all = mesh.triangles;
    for (const auto& q : mesh.quads) {
        all.emplace_back(q[0], q[1], q[2]);
        all.emplace_back(q[0], q[2], q[3]);
    }
    return all;
}

/// The distance by comparing all triangles, with OpenVDB's formula.
inline double distanceTo(const Mesh& mesh, const openvdb::Vec3d& p) {
    double best = 1e300;
    for (const auto& t : trianglesOf(mesh)) {
        openvdb::Vec3d uvw;
        const openvdb::Vec3d closest = openvdb::math::closestPointOnTriangleToPoint(
            openvdb::Vec3d(mesh.points[t[0]]), openvdb::Vec3d(mesh.points[t[1]]), openvdb::Vec3d(mesh.points[t[2]]), p,
            uvw);
        best = std::min(best, (closest - p).length());
    }
    return best;
}

/// Two pyramids on a common base with n corners: n faces meet at either tip.
inline Mesh bipyramid(int n) {
    Mesh mesh;
    for (int k = 0; k < n; ++k) {
        const double angle = 2 * std::numbers::pi * k / n;
        mesh.points.emplace_back(static_cast<float>(std::cos(angle)), static_cast<float>(std::sin(angle)), 0.0F);
    }
    mesh.points.emplace_back(0.0F, 0.0F, -0.6F);
    mesh.points.emplace_back(0.0F, 0.0F, 0.6F);
    for (int k = 0; k < n; ++k) {
        mesh.triangles.emplace_back((k + 1) % n, k, n);
        mesh.triangles.emplace_back(k, (k + 1) % n, n + 1);
    }
    return mesh;
}

/// The winding number by summing all solid angles in long double, each from its three dihedral angles' spherical excess
/// (L'Huilier): another formula than the library's.
inline double windingNumberByExcess(const Mesh& mesh, const openvdb::Vec3d& at) {
    using Real = long double;
    Real sum = 0;
    for (const auto& t : trianglesOf(mesh)) {
        std::array<std::array<Real, 3>, 3> u{};
        bool onCorner = false;
        for (size_t k = 0; k < 3; ++k) {
            const auto& p = mesh.points[t[static_cast<int>(k)]];
            Real square = 0;
            for (size_t i = 0; i < 3; ++i) {
                u[k][i] = static_cast<Real>(p[static_cast<int>(i)]) - static_cast<Real>(at[static_cast<int>(i)]);
                square += u[k][i] * u[k][i];
            }
            onCorner = onCorner || square == 0;
            for (Real& x : u[k]) x /= std::sqrt(square);
        }
        if (onCorner) continue;
        const auto angle = [](const std::array<Real, 3>& a, const std::array<Real, 3>& b) {
            Real difference = 0;
            for (size_t i = 0; i < 3; ++i) difference += (a[i] - b[i]) * (a[i] - b[i]);
            return 2 * std::asin(std::min(Real(1), std::sqrt(difference) / 2));
        };
        const Real a = angle(u[1], u[2]), b = angle(u[2], u[0]), c = angle(u[0], u[1]), s = (a + b + c) / 2;
        const Real product = std::tan(s / 2) * std::tan((s - a) / 2) * std::tan((s - b) / 2) * std::tan((s - c) / 2);
        const Real excess = 4 * std::atan(std::sqrt(std::max(Real(0), product)));
        const Real det = u[0][0] * (u[1][1] * u[2][2] - u[1][2] * u[2][1]) +
                         u[0][1] * (u[1][2] * u[2][0] - u[1][0] * u[2][2]) +
                         u[0][2] * (u[1][0] * u[2][1] - u[1][1] * u[2][0]);
        sum += det > 0 ? excess : -excess;
    }
    return static_cast<double>(sum / (4 * std::numbers::pi_v<Real>));
}

/// The same by the formula of van Oosterom and Strackee, in double: for many positions.
inline double windingNumber(const Mesh& mesh, const openvdb::Vec3d& at) {
    double sum = 0;
    for (const auto& t : trianglesOf(mesh)) {
        const openvdb::Vec3d a = openvdb::Vec3d(mesh.points[t[0]]) - at, b = openvdb::Vec3d(mesh.points[t[1]]) - at,
                             c = openvdb::Vec3d(mesh.points[t[2]]) - at;
        const double la = a.length(), lb = b.length(), lc = c.length();
        sum += std::atan2(a.dot(b.cross(c)), la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb);
    }
    return sum / (2 * std::numbers::pi);
}

/// The same mesh, moved.
inline Mesh moved(Mesh mesh, const Vec3s& by) {
    for (auto& p : mesh.points) p += by;
    return mesh;
}

/// Both in one.
inline Mesh together(Mesh a, const Mesh& b) {
    const auto first = static_cast<openvdb::Index32>(a.points.size());
    a.points.insert(a.points.end(), b.points.begin(), b.points.end());
    for (auto t : b.triangles) a.triangles.push_back(t + Vec3I(first));
    for (auto q : b.quads) a.quads.push_back(q + openvdb::Vec4I(first));
    return a;
}

/// Faces in the other direction.
inline Mesh flipped(Mesh mesh) {
    for (auto& t : mesh.triangles) std::swap(t[0], t[2]);
    for (auto& q : mesh.quads) std::swap(q[0], q[3]), std::swap(q[1], q[2]);
    return mesh;
}

/// Without the faces whose middle is within `radius` of a place.
inline Mesh withHole(const Mesh& mesh, const openvdb::Vec3d& place, double radius) {
    Mesh open;
    open.points = mesh.points;
    for (const auto& t : trianglesOf(mesh)) {
        const openvdb::Vec3d middle = (openvdb::Vec3d(mesh.points[t[0]]) + openvdb::Vec3d(mesh.points[t[1]]) +
                                       openvdb::Vec3d(mesh.points[t[2]])) /
                                      3;
        if ((middle - place).length() > radius) open.triangles.push_back(t);
    }
    return open;
}

/// Each triangle with corners of its own, some of them moved by up to `by`.
inline Mesh soup(const Mesh& mesh, double by) {
    Mesh result;
    for (const auto& t : trianglesOf(mesh)) {
        const auto first = static_cast<openvdb::Index32>(result.points.size());
        for (int k = 0; k < 3; ++k) {
            Vec3s p = mesh.points[t[k]];
            for (int axis = 0; axis < 3; ++axis)
                p[axis] += static_cast<float>(
                    by * (2 * randomUniform(9, result.points.size(), static_cast<uint64_t>(axis)) - 1));
            result.points.push_back(p);
        }
        result.triangles.emplace_back(first, first + 1, first + 2);
    }
    return result;
}

/// A square in the plane y = 0, of n x n quads, its normal along y.
inline Mesh plane(double size, int n) {
    Mesh mesh;
    for (int i = 0; i <= n; ++i)
        for (int j = 0; j <= n; ++j)
            mesh.points.emplace_back(static_cast<float>(size * (double(i) / n - 0.5)), 0.0f,
                                     static_cast<float>(size * (double(j) / n - 0.5)));
    const auto at = [n](int i, int j) { return static_cast<openvdb::Index32>(i * (n + 1) + j); };
    for (int i = 0; i < n; ++i)
        for (int j = 0; j < n; ++j) mesh.quads.emplace_back(at(i, j), at(i, j + 1), at(i + 1, j + 1), at(i + 1, j));
    return mesh;
}

/// A Möbius strip of radius 1: one side, one edge.
inline Mesh moebius(double width, int n) {
    Mesh mesh;
    for (int i = 0; i < n; ++i)
        for (int j = 0; j < 2; ++j) {
            const double u = 2 * std::numbers::pi * i / n, v = width * (j - 0.5), r = 1 + v * std::cos(u / 2);
            mesh.points.emplace_back(static_cast<float>(r * std::cos(u)), static_cast<float>(r * std::sin(u)),
                                     static_cast<float>(v * std::sin(u / 2)));
        }
    for (int i = 0; i < n; ++i) {
        const auto a = static_cast<openvdb::Index32>(2 * i);
        const openvdb::Index32 b = i + 1 < n ? a + 2 : 1, step = i + 1 < n ? 1 : 0;
        mesh.quads.emplace_back(a, b, i + 1 < n ? b + step : 0, a + 1);
    }
    return mesh;
}

/// A ball of radius 1: the faces of an octahedron, cut into four `levels` times; all triangles, outward.
inline Mesh ball(int levels) {
    Mesh mesh;
    mesh.points = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
    mesh.triangles = {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4}, {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};
    for (int level = 0; level < levels; ++level) {
        std::map<std::pair<openvdb::Index32, openvdb::Index32>, openvdb::Index32> known;
        const auto middle = [&](openvdb::Index32 a, openvdb::Index32 b) {
            const auto [entry, isNew] =
                known.emplace(std::minmax(a, b), static_cast<openvdb::Index32>(mesh.points.size()));
            if (isNew) {
                openvdb::Vec3d p(mesh.points[a] + mesh.points[b]);
                p.normalize();
                mesh.points.emplace_back(p);
            }
            return entry->second;
        };
        std::vector<Vec3I> finer;
        for (const auto& t : mesh.triangles) {
            const auto a = middle(t[0], t[1]), b = middle(t[1], t[2]), c = middle(t[2], t[0]);
            finer.emplace_back(t[0], a, c);
            finer.emplace_back(a, t[1], b);
            finer.emplace_back(c, b, t[2]);
            finer.emplace_back(a, b, c);
        }
        mesh.triangles = std::move(finer);
    }
    return mesh;
}

} // namespace curlew::test
