// SPDX-License-Identifier: Apache-2.0
#include "SolidChecks.h"

#include "BandSize.h"
#include "MeshEdges.h"
#include "curlew/vdb/Openvdb.h"

#include <tbb/parallel_sort.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <tuple>

namespace curlew {

namespace {

using openvdb::Index32;

/// Returns for each point the first point with the same position.
std::vector<Index32> firstAlike(const std::vector<openvdb::Vec3s>& points) {
    std::vector<Index32> order(points.size()), first(points.size());
    std::iota(order.begin(), order.end(), 0u);
    const auto key = [&](Index32 n) { return std::tuple(points[n][0], points[n][1], points[n][2]); };
    tbb::parallel_sort(order.begin(), order.end(),
                       [&](Index32 a, Index32 b) { return std::tuple(key(a), a) < std::tuple(key(b), b); });
    for (size_t k = 0; k < order.size(); ++k)
        first[order[k]] = k > 0 && key(order[k]) == key(order[k - 1]) ? first[order[k - 1]] : order[k];
    return first;
}

/// A triangle by its sorted vertices, the parity of the sorting permutation, and its index.
struct FaceCorners {
    std::array<Index32, 3> sorted;
    size_t number;
    bool odd;
};

} // namespace

double thicknessOf(const openvdb::FloatGrid& grid) {
    const auto meta = grid.getMetadata<openvdb::DoubleMetadata>(kThickness);
    return meta ? meta->value() : 0;
}

Mesh inTriangles(const Mesh& mesh) {
    Mesh result{.points = mesh.points, .triangles = mesh.triangles, .quads = {}};
    for (const auto& q : mesh.quads) {
        result.triangles.emplace_back(q[0], q[1], q[2]);
        result.triangles.emplace_back(q[0], q[2], q[3]);
    }
    return result;
}

Mesh distinctTriangles(const Mesh& mesh, size_t& duplicates, std::vector<openvdb::Vec3I>& pairs) {
    Mesh all = inTriangles(mesh);
    const std::vector<Index32> first = firstAlike(all.points);
    std::vector<FaceCorners> keys;
    keys.reserve(all.triangles.size());
    for (size_t n = 0; n < all.triangles.size(); ++n) {
        auto& t = all.triangles[n];
        for (int k = 0; k < 3; ++k) t[k] = first[t[k]];
        if (t[0] == t[1] || t[1] == t[2] || t[2] == t[0]) continue;
        std::array<Index32, 3> c{t[0], t[1], t[2]};
        const bool odd = (c[0] > c[1]) ^ (c[1] > c[2]) ^ (c[0] > c[2]);
        std::sort(c.begin(), c.end());
        keys.push_back({c, n, odd});
    }
    tbb::parallel_sort(keys.begin(), keys.end(), [](const FaceCorners& a, const FaceCorners& b) {
        return std::tie(a.sorted, a.number) < std::tie(b.sorted, b.number);
    });
    // Of triangles with the same vertices, one is kept, in the more frequent direction. If equally many run in either
    // direction, none is kept, unless most of the mesh is like that, or would be open without them; then one is.
    std::vector<size_t> stay, even;
    size_t groups = 0;
    for (size_t k = 0; k < keys.size(); ++groups) {
        size_t end = k;
        int odd = 0;
        for (; end < keys.size() && keys[end].sorted == keys[k].sorted; ++end) odd += keys[end].odd ? 1 : -1;
        size_t chosen = k;
        while (chosen < end && odd != 0 && keys[chosen].odd != (odd > 0)) ++chosen;
        (odd == 0 ? even : stay).push_back(keys[chosen].number);
        k = end;
    }
    const auto only = [&](const std::vector<size_t>& numbers) {
        Mesh some{.points = {}, .triangles = {}, .quads = {}};
        some.triangles.reserve(numbers.size());
        for (const size_t n : numbers) some.triangles.push_back(all.triangles[n]);
        return some;
    };
    std::vector<size_t> both = stay;
    both.insert(both.end(), even.begin(), even.end());
    std::sort(stay.begin(), stay.end());
    std::sort(both.begin(), both.end());
    if (2 * even.size() > groups ||
        (!even.empty() && topologyOf(only(both)).boundaryEdges < topologyOf(only(stay)).boundaryEdges))
        stay = std::move(both);
    else
        pairs = only(even).triangles;
    duplicates = keys.size() - stay.size();
    Mesh result = only(stay);
    result.points = std::move(all.points);
    return result;
}

size_t orient(Mesh& triangles, size_t counted) {
    // Union-find; `against` says whether a triangle runs against the one it points to.
    std::vector<Index32> parent(triangles.triangles.size());
    std::vector<bool> against(parent.size()), oneSided(parent.size());
    std::iota(parent.begin(), parent.end(), Index32(0));
    const auto root = [&](Index32 n) {
        bool reversed = false;
        for (Index32 k = n; parent[k] != k; k = parent[k]) reversed = reversed != against[k];
        Index32 top = n;
        while (parent[top] != top) top = parent[top];
        while (parent[n] != top && n != top) { // shortens the path
            const Index32 next = parent[n];
            const bool step = against[n];
            parent[n] = top;
            against[n] = reversed;
            reversed = reversed != step;
            n = next;
        }
        return top;
    };
    const auto runsAgainst = [&](Index32 n) { return root(n) != n && against[n]; };
    forEachEdge(sidesByEdge(triangles), [&](std::span<const TriangleSide> sides) {
        if (sides.size() != 2) return;
        const bool disagree = sides[0].up == sides[1].up;
        const Index32 p = sides[0].triangle, q = sides[1].triangle, a = root(p), b = root(q);
        const bool turn = disagree != (runsAgainst(p) != runsAgainst(q));
        if (a == b) {
            oneSided[a] = oneSided[a] || turn;
        } else {
            parent[b] = a;
            against[b] = turn;
            oneSided[a] = oneSided[a] || oneSided[b];
        }
    });
    std::vector<size_t> size(parent.size()), reversed(parent.size());
    for (Index32 n = 0; n < parent.size(); ++n) {
        const Index32 part = root(n);
        ++size[part];
        reversed[part] += runsAgainst(n) ? 1 : 0;
    }
    size_t count = 0;
    for (Index32 n = 0; n < parent.size(); ++n) {
        const Index32 part = root(n);
        const bool most = 2 * reversed[part] > size[part];
        if (oneSided[part] || runsAgainst(n) == most) continue;
        std::swap(triangles.triangles[n][1], triangles.triangles[n][2]);
        count += n < counted ? 1 : 0;
    }
    return count;
}

double volumeOf(const Mesh& mesh) {
    const openvdb::Vec3d middle = boxOf(mesh).getCenter();
    const auto part = [&](Index32 a, Index32 b, Index32 c) {
        const openvdb::Vec3d p = openvdb::Vec3d(mesh.points[a]) - middle, q = openvdb::Vec3d(mesh.points[b]) - middle,
                             r = openvdb::Vec3d(mesh.points[c]) - middle;
        return p.dot(q.cross(r)) / 6;
    };
    double volume = 0;
    for (const auto& t : mesh.triangles) volume += part(t[0], t[1], t[2]);
    for (const auto& q : mesh.quads) volume += part(q[0], q[1], q[2]) + part(q[0], q[2], q[3]);
    return volume;
}

} // namespace curlew
