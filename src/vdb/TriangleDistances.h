// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/field/Batch.h"

#include <limits>

namespace curlew {

/// The corners of triangles relative to a position; independent of OpenVDB.
struct Triangles {
    int size = 0;
    std::array<PointBatch, 3> corner;
};

/// Computes the squares of the distances of the origin from triangles, and which corner is nearest to the closest point
/// if that is on an edge, else kInterior. Triangles without area count as their edges.
struct TriangleKernel {
    static constexpr double kInterior = 3;

    struct Result {
        alignas(64) std::array<double, kBatch> square, corner;
    };

    template <class T>
    static void run(const Triangles& triangles, Result& result) {
        for (int i = 0; i < triangles.size; i += kLanes<T>) {
            const auto a = triangles.corner[0].template lanes<T>(i), b = triangles.corner[1].template lanes<T>(i),
                       c = triangles.corner[2].template lanes<T>(i);
            const Vec3<T> ab = b - a, bc = c - b, ca = a - c, normal = cross(ab, bc);
            T square(std::numeric_limits<double>::max()), corner(0);
            const auto compare = [&](const Vec3<T>& from, const Vec3<T>& edge, int first, int second) {
                const T length = max(dot(edge, edge), T(std::numeric_limits<double>::min()));
                const T along = max(T(0), min(T(1), -dot(from, edge) / length));
                const Vec3<T> closest = from + edge * along;
                const T here = dot(closest, closest);
                const auto closer = here < square;
                square = select(closer, here, square);
                corner = select(closer, select(along < T(0.5), T(first), T(second)), corner);
            };
            compare(a, ab, 0, 1);
            compare(b, bc, 1, 2);
            compare(c, ca, 2, 0);
            constexpr double kFlat = 1e-16; // square of the sine of an angle, below which rounding turns the normal
            const T area = dot(normal, normal), height = dot(normal, a);
            const auto above = [&](const Vec3<T>& from, const Vec3<T>& edge) {
                return !(dot(normal, cross(edge, from)) > T(0));
            };
            const auto interior =
                above(a, ab) & above(b, bc) & above(c, ca) & (area > T(kFlat) * dot(ab, ab) * dot(bc, bc));
            store(select(interior, height * height / area, square), &result.square[static_cast<size_t>(i)]);
            store(select(interior, T(kInterior), corner), &result.corner[static_cast<size_t>(i)]);
        }
    }
};

} // namespace curlew
