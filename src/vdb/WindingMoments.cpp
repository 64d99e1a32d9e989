// SPDX-License-Identifier: Apache-2.0
#include "WindingMoments.h"

#include <algorithm>
#include <limits>

namespace curlew::winding {

namespace {

/// Returns the index of y_j y_k among xx xy xz yy yz zz.
constexpr size_t pair(int j, int k) {
    const int low = std::min(j, k), high = std::max(j, k);
    return static_cast<size_t>(low * (5 - low) / 2 + high);
}

void include(Moments& moments, const Vec3d& p) {
    for (int axis = 0; axis < 3; ++axis) {
        moments.lower[axis] = std::min(moments.lower[axis], p[axis]);
        moments.upper[axis] = std::max(moments.upper[axis], p[axis]);
    }
}

/// Returns the distance from the center to the farthest corner of the box.
double cornerDistance(const Moments& moments) {
    Vec3d farthest;
    for (int axis = 0; axis < 3; ++axis)
        farthest[axis] =
            std::max(moments.upper[axis] - moments.center[axis], moments.center[axis] - moments.lower[axis]);
    return length(farthest);
}

/// Adds the moments of `part` to `sum`, shifted to the center of `sum`; `s` is the center of `part` relative to it.
void addShifted(Moments& sum, const Moments& part, const Vec3d& s) {
    for (int i = 0; i < 3; ++i) {
        const auto n = static_cast<size_t>(i);
        const double a = part.zeroth[i];
        sum.zeroth[i] += a;
        for (int j = 0; j < 3; ++j) {
            sum.first[n][j] += part.first[n][j] + a * s[j];
            for (int k = j; k < 3; ++k)
                sum.second[n][pair(j, k)] +=
                    part.second[n][pair(j, k)] + part.first[n][j] * s[k] + part.first[n][k] * s[j] + a * s[j] * s[k];
        }
    }
}

/// Returns the moments of one triangle about its centroid: ∫ y_j y_k = area / 12 (Σ v_j v_k) over its vertices v.
Moments momentsOf(const Triangle& triangle) {
    Moments moments{.center = triangle.middle()};
    moments.zeroth = triangle.area();
    moments.area = length(moments.zeroth);
    moments.lower = moments.upper = triangle.corner[0];
    for (const Vec3d& p : triangle.corner) {
        include(moments, p);
        const Vec3d v = p - moments.center;
        moments.radius = std::max(moments.radius, length(v));
        for (int i = 0; i < 3; ++i)
            for (int j = 0; j < 3; ++j)
                for (int k = j; k < 3; ++k)
                    moments.second[static_cast<size_t>(i)][pair(j, k)] += moments.zeroth[i] / 12 * v[j] * v[k];
    }
    return moments;
}

} // namespace

Triangle triangleOf(const Mesh& mesh, size_t n) {
    Triangle triangle;
    for (int k = 0; k < 3; ++k) {
        const auto& p = mesh.points[mesh.triangles[n][k]];
        triangle.corner[static_cast<size_t>(k)] = {
            {static_cast<double>(p[0]), static_cast<double>(p[1]), static_cast<double>(p[2])}};
    }
    return triangle;
}

Moments merged(const Moments& a, const Moments& b) {
    Moments sum;
    sum.area = a.area + b.area;
    if (!(sum.area > 0)) return a;
    sum.center = a.center * (a.area / sum.area) + b.center * (b.area / sum.area);
    sum.lower = a.lower;
    sum.upper = a.upper;
    include(sum, b.lower);
    include(sum, b.upper);
    addShifted(sum, a, a.center - sum.center);
    addShifted(sum, b, b.center - sum.center);
    sum.radius = std::min(cornerDistance(sum),
                          std::max(length(a.center - sum.center) + a.radius, length(b.center - sum.center) + b.radius));
    return sum;
}

Moments momentsOf(std::span<const Triangle> triangles) {
    if (triangles.empty()) return {};
    Moments sum = momentsOf(triangles[0]);
    for (const Triangle& t : triangles.subspan(1)) sum = merged(sum, momentsOf(t));
    sum.radius = 0;
    for (const Triangle& t : triangles)
        for (const Vec3d& p : t.corner) sum.radius = std::max(sum.radius, length(p - sum.center));
    return sum;
}

Far farOf(const Moments& moments, double beta) {
    Far far{.center = moments.center, .a = moments.zeroth};
    far.reach2 = beta * beta * moments.radius * moments.radius;
    const auto& m = moments.first;
    const double trace = m[0][0] + m[1][1] + m[2][2];
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) {
            const double mixed = (i == j ? trace : 0) - 3 * m[static_cast<size_t>(i)][j];
            far.b[pair(i, j)] += mixed; // both orders of a mixed pair add up
        }
    constexpr auto triple = [](int i, int j, int k) -> size_t {
        std::array<int, 3> n{i, j, k};
        std::sort(n.begin(), n.end());
        // xxx xxy xxz xyy xyz xzz yyy yyz yzz zzz
        return n[0] == 0 ? pair(n[1], n[2]) : n[0] == 1 ? 6 + static_cast<size_t>(n[1] - 1 + n[2] - 1) : 9;
    };
    const auto& t = moments.second;
    for (int k = 0; k < 3; ++k) {
        double contracted = 0; // over each pair of the three indices
        for (int i = 0; i < 3; ++i)
            contracted += 2 * t[static_cast<size_t>(i)][pair(i, k)] + t[static_cast<size_t>(k)][pair(i, i)];
        for (int i = 0; i < 3; ++i) {
            far.c[triple(i, i, k)] -= 1.5 * contracted;
            for (int j = 0; j < 3; ++j) far.c[triple(i, j, k)] += 7.5 * t[static_cast<size_t>(i)][pair(j, k)];
        }
    }
    return far;
}

} // namespace curlew::winding
