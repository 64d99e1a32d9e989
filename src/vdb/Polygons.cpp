// SPDX-License-Identifier: Apache-2.0
#include "Polygons.h"

#include <tbb/parallel_sort.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <tuple>
#include <utility>

namespace curlew {

namespace {

using PlanePoint = std::array<double, 2>;
using CornerSpan = std::span<const uint32_t>;

/// Returns twice the signed area of a triangle; negative if it runs clockwise.
double area(const PlanePoint& a, const PlanePoint& b, const PlanePoint& c) {
    return a[0] * (b[1] - c[1]) + b[0] * (c[1] - a[1]) + c[0] * (a[1] - b[1]);
}

/// Projects the vertices of a polygon along the axis in which its normal (Newell) is longest, so that they run
/// counter-clockwise.
std::vector<PlanePoint> projected(const std::vector<openvdb::Vec3s>& points, CornerSpan corners) {
    openvdb::Vec3d normal(0);
    for (size_t k = 0; k < corners.size(); ++k) {
        const openvdb::Vec3d here(points[corners[k]]), next(points[corners[(k + 1) % corners.size()]]);
        normal += here.cross(next);
    }
    const double x = std::abs(normal[0]), y = std::abs(normal[1]), z = std::abs(normal[2]);
    const int axis = x > y && x > z ? 0 : y > z ? 1 : 2;
    int first = (axis + 1) % 3, second = (axis + 2) % 3;
    if (normal[axis] < 0) std::swap(first, second);
    std::vector<PlanePoint> result;
    result.reserve(corners.size());
    for (const uint32_t c : corners)
        result.push_back({static_cast<double>(points[c][first]), static_cast<double>(points[c][second])});
    return result;
}

/// Triangulates a polygon by ear clipping.
class EarClipper {
  public:
    explicit EarClipper(std::vector<PlanePoint> points) : mPoints(std::move(points)), mRing(mPoints.size()) {
        const size_t size = mPoints.size();
        for (size_t k = 0; k < size; ++k) mRing[k] = {(k + size - 1) % size, (k + 1) % size};
    }

    /// Calls emit(a, b, c) with the vertex indices of each triangle.
    template <class Emit>
    void cut(const Emit& emit) {
        size_t ear = 0, left = mPoints.size(), tries = 0;
        while (left > 3) {
            const auto [previous, next] = mRing[ear];
            // A vertex on the diagonal would make the rest fold, unless there is no other ear.
            if (tries < 2 * left && !isEar(previous, ear, next, tries < left)) {
                ++tries;
            } else {
                emit(previous, ear, next);
                mRing[previous].next = next;
                mRing[next].previous = previous;
                --left, tries = 0;
            }
            ear = next;
        }
        std::array<size_t, 3> last{ear, mRing[ear].next, mRing[ear].previous};
        std::rotate(last.begin(), std::min_element(last.begin(), last.end()), last.end());
        emit(last[0], last[1], last[2]);
    }

  private:
    struct Neighbours {
        size_t previous, next;
    };

    /// Returns whether the corner is convex, and no other corner lies in its triangle with its neighbours, nor on the
    /// sides of that if `clear`.
    bool isEar(size_t previous, size_t corner, size_t next, bool clear) const {
        const PlanePoint &a = mPoints[previous], &b = mPoints[corner], &c = mPoints[next];
        if (area(a, b, c) < 0) return false;
        for (size_t k = mRing[next].next; k != previous; k = mRing[k].next) {
            const PlanePoint& p = mPoints[k]; // corners may share a position
            if (p == a || p == b || p == c) continue;
            const double least = std::min({area(a, b, p), area(b, c, p), area(c, a, p)});
            if (clear ? least >= 0 : least > 0) return false;
        }
        return true;
    }

    std::vector<PlanePoint> mPoints;
    std::vector<Neighbours> mRing;
};

/// Appends the triangles of a polygon. No triangle begins with the same vertex as the one before it.
void appendTriangles(const std::vector<openvdb::Vec3s>& points, CornerSpan corners,
                     std::vector<openvdb::Vec3I>& triangles) {
    size_t before = corners.size();
    EarClipper(projected(points, corners)).cut([&](size_t a, size_t b, size_t c) {
        if (a == before) std::tie(a, b, c) = std::tuple(c, a, b);
        before = a;
        triangles.emplace_back(corners[a], corners[b], corners[c]);
    });
}

/// Calls use(corner) for every vertex index of every face.
template <class Use>
void forEachCorner(Mesh& mesh, const Use& use) {
    for (auto& face : mesh.triangles)
        for (int k = 0; k < 3; ++k) use(face[k]);
    for (auto& face : mesh.quads)
        for (int k = 0; k < 4; ++k) use(face[k]);
}

/// Joins points with the same position and group into the first of them, and drops unused ones. Returns the previous
/// index of each remaining point.
std::vector<uint32_t> joinPoints(Mesh& mesh, const std::vector<uint32_t>& groups) {
    constexpr uint32_t kNone = ~uint32_t(0);
    std::vector<openvdb::Vec3s> points = std::move(mesh.points);
    for (auto& p : points) p += openvdb::Vec3s(0.0f); // -0 becomes 0
    const auto groupOf = [&](uint32_t point) { return groups.empty() ? 0 : groups[point]; };
    std::vector<uint32_t> joined(points.size(), kNone), used;
    forEachCorner(mesh, [&](uint32_t corner) {
        if (joined[corner] != kNone) return;
        joined[corner] = corner;
        used.push_back(corner);
    });
    tbb::parallel_sort(used, [&](uint32_t i, uint32_t j) {
        const openvdb::Vec3s &a = points[i], &b = points[j];
        return std::tuple(a.x(), a.y(), a.z(), groupOf(i), i) < std::tuple(b.x(), b.y(), b.z(), groupOf(j), j);
    });
    for (size_t n = 1; n < used.size(); ++n)
        if (points[used[n]] == points[used[n - 1]] && groupOf(used[n]) == groupOf(used[n - 1]))
            joined[used[n]] = joined[used[n - 1]];
    mesh.points.clear();
    std::vector<uint32_t> sources;
    for (uint32_t n = 0; n < joined.size(); ++n) {
        if (joined[n] == kNone) continue;
        if (joined[n] == n) {
            joined[n] = static_cast<uint32_t>(mesh.points.size());
            mesh.points.push_back(points[n]);
            sources.push_back(n);
        } else {
            joined[n] = joined[joined[n]];
        }
    }
    forEachCorner(mesh, [&](uint32_t& corner) { corner = joined[corner]; });
    return sources;
}

} // namespace

Mesh meshOf(const Polygons& polygons) { return joinedMeshOf(polygons, {}).mesh; }

JoinedMesh joinedMeshOf(const Polygons& polygons, const std::vector<uint32_t>& groups) {
    Mesh mesh;
    mesh.points = polygons.points;
    const uint32_t* face = polygons.corners.data();
    for (const uint32_t size : polygons.sizes) {
        if (size == 3)
            mesh.triangles.emplace_back(face[0], face[1], face[2]);
        else if (size == 4)
            mesh.quads.emplace_back(face[0], face[1], face[2], face[3]);
        else
            appendTriangles(polygons.points, {face, size}, mesh.triangles);
        face += size;
    }
    std::vector<uint32_t> sources = joinPoints(mesh, groups);
    return {std::move(mesh), std::move(sources)};
}

} // namespace curlew
