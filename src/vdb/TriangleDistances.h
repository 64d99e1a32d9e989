// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/field/Batch.h"

#include <array>
#include <limits>
#include <span>

namespace curlew {

/// The corners of triangles relative to a position; independent of OpenVDB.
struct Triangles {
    int size = 0;
    std::array<PointBatch, 3> corner;
};

/// A triangle, and what distances from it need. One without area counts as its edges.
template <class T>
struct PreparedTriangle {
    PreparedTriangle() = default;
    PreparedTriangle(const Vec3<T>& a, const Vec3<T>& b, const Vec3<T>& c)
        : corner{a, b, c},
          edge{b - a, c - b, a - c},
          normal(cross(edge[0], edge[1])),
          inward{cross(normal, edge[0]), cross(normal, edge[1]), cross(normal, edge[2])},
          perSquare{reciprocal(square(0)), reciprocal(square(1)), reciprocal(square(2))} {
        constexpr double kFlat = 1e-16; // square of the sine of an angle, below which rounding turns the normal
        const T area = dot(normal, normal);
        perArea = select(area > T(kFlat) * square(0) * square(1), reciprocal(area), T(0));
    }

    std::array<Vec3<T>, 3> corner, edge; ///< Each edge begins at the corner of the same number.
    Vec3<T> normal;
    std::array<Vec3<T>, 3> inward; ///< Perpendicular to the edge, in the plane.
    std::array<T, 3> perSquare;    ///< The reciprocal of the edge's squared length.
    T perArea;                     ///< The reciprocal of the normal's squared length, or 0 without area.

  private:
    T square(size_t k) const { return dot(edge[k], edge[k]); }
    static T reciprocal(const T& x) { return T(1) / max(x, T(std::numeric_limits<double>::min())); }
};

/// The closest point of a triangle.
template <class T>
struct ClosestPoint {
    static constexpr double kInterior = 3;
    T square; ///< Of its distance.
    T corner; ///< The number of the nearest corner if it is on an edge, else kInterior.
};

/// Returns the square of the distance from the plane of a triangle, or 0 if that has no area.
template <class T, class Number>
T squareFromPlane(const PreparedTriangle<Number>& triangle, const Vec3<T>& position) {
    T height(0);
    for (int k = 0; k < 3; ++k) height = mulAdd(T(triangle.normal[k]), T(triangle.corner[0][k]) - position[k], height);
    return height * height * T(triangle.perArea);
}

/// Returns the closest point of a triangle to a position. The triangle may be a single one, of numbers, for positions
/// in lanes.
template <class T, class Number>
ClosestPoint<T> closestPoint(const PreparedTriangle<Number>& triangle, const Vec3<T>& position) {
    ClosestPoint<T> closest{T(std::numeric_limits<double>::max()), T(0)};
    auto interior = T(triangle.perArea) > T(0);
    for (size_t k = 0; k < 3; ++k) {
        const auto of = [](const Vec3<Number>& v) { return Vec3<T>{{T(v[0]), T(v[1]), T(v[2])}}; };
        const Vec3<T> from = of(triangle.corner[k]) - position, edge = of(triangle.edge[k]);
        const T along = max(T(0), min(T(1), -dot(from, edge) * T(triangle.perSquare[k])));
        const Vec3<T> there = from + edge * along;
        const T square = dot(there, there);
        const auto closer = square < closest.square;
        const auto first = static_cast<double>(k), second = static_cast<double>((k + 1) % 3);
        closest.square = select(closer, square, closest.square);
        closest.corner = select(closer, select(along < T(0.5), T(first), T(second)), closest.corner);
        interior = interior & !(dot(from, of(triangle.inward[k])) > T(0));
    }
    closest.square = select(interior, squareFromPlane(triangle, position), closest.square);
    closest.corner = select(interior, T(ClosestPoint<T>::kInterior), closest.corner);
    return closest;
}

/// Computes the closest points of triangles to the origin.
struct TriangleKernel {
    struct Result {
        alignas(64) std::array<double, kBatch> square, corner; ///< Of each ClosestPoint.
    };

    template <class T>
    static void run(const Triangles& triangles, Result& result) {
        for (int i = 0; i < triangles.size; i += kLanes<T>) {
            const auto corner = [&](size_t k) { return triangles.corner[k].template lanes<T>(i); };
            const auto closest = closestPoint(PreparedTriangle<T>(corner(0), corner(1), corner(2)), Vec3<T>{});
            store(closest.square, &result.square[static_cast<size_t>(i)]);
            store(closest.corner, &result.corner[static_cast<size_t>(i)]);
        }
    }
};

/// Computes the squares of the distances of positions from a triangle.
struct TriangleFromKernel {
    template <class T>
    static void run(const PreparedTriangle<double>& triangle, const PointBatch& positions,
                    std::array<double, kBatch>& squares) {
        for (int i = 0; i < positions.size; i += kLanes<T>)
            store(closestPoint(triangle, positions.template lanes<T>(i)).square, &squares[static_cast<size_t>(i)]);
    }
};

/// A triangle near a leaf of a grid, in voxels from the leaf's first one.
struct LeafTriangle {
    PreparedTriangle<double> triangle;
    double face = 0;                    ///< Its number.
    std::array<int, 3> first{}, last{}; ///< The voxels that it may be close to.
    Vec3d least{}, most{};              ///< Its box.
};

/// Compares the voxels of a leaf, z fastest, with triangles.
struct LeafTriangleKernel {
    static constexpr size_t kEdge = 8, kPlane = kEdge * kEdge;

    /// The squares of the distances, and the numbers of the closest faces. Values are replaced by smaller ones.
    struct Closest {
        alignas(64) std::array<double, kEdge * kPlane> square, face;
    };

    /// Returns the square of the distance from the box of a triangle.
    template <class T>
    static T squareFromBox(const LeafTriangle& one, const Vec3<T>& position) {
        T square(0);
        for (int k = 0; k < 3; ++k) {
            const T away = max(max(T(one.least[k]) - position[k], position[k] - T(one.most[k])), T(0));
            square = mulAdd(away, away, square);
        }
        return square;
    }

    template <class T>
    static void run(const std::span<const LeafTriangle>& triangles, Closest& closest) {
        constexpr size_t kCount{kLanes<T>};
        alignas(64) std::array<double, kPlane> y, z;
        for (size_t n = 0; n < kPlane; ++n) {
            const size_t row = n / kEdge, inRow = n % kEdge;
            y[n] = static_cast<double>(row);
            z[n] = static_cast<double>(inRow);
        }
        for (const LeafTriangle& one : triangles)
            for (int x = one.first[0]; x <= one.last[0]; ++x) {
                const auto rows = [](int count) { return static_cast<size_t>(count) * kEdge; };
                for (size_t n = rows(one.first[1]) / kCount * kCount; n < rows(one.last[1] + 1); n += kCount) {
                    const Vec3<T> position{{T(static_cast<double>(x)), load<T>(&y[n]), load<T>(&z[n])}};
                    const size_t at = static_cast<size_t>(x) * kPlane + n;
                    const T before = load<T>(&closest.square[at]);
                    const T least = max(squareFromPlane(one.triangle, position), squareFromBox(one, position));
                    if (!any(least < before)) continue;
                    const T square = closestPoint(one.triangle, position).square;
                    const auto closer = square < before;
                    store(select(closer, square, before), &closest.square[at]);
                    store(select(closer, T(one.face), load<T>(&closest.face[at])), &closest.face[at]);
                }
            }
    }
};

} // namespace curlew
