// SPDX-License-Identifier: Apache-2.0
#include "HoleSurface.h"

#include "SolidWinding.h"
#include "curlew/base/Parallel.h"
#include "curlew/vdb/Openvdb.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>

namespace curlew {

namespace {

using openvdb::Coord;
using Known = openvdb::tree::ValueAccessor<const openvdb::FloatTree>;

constexpr double kJump = 0.7;

/// An edge from a voxel along an axis, crossed by the surface.
struct Edge {
    Coord voxel;
    int axis;
    double w0, w1; ///< w at its ends.
};

Coord along(Coord voxel, int axis, int by) {
    voxel[axis] += by;
    return voxel;
}

bool crossed(double w0, double w1) {
    return SolidWinding::isInside(w0) != SolidWinding::isInside(w1) && std::abs(w0 - w1) < kJump;
}

/// Returns the minimum corners of the four cells around an edge.
std::array<Coord, 4> cellsAround(const Edge& edge) {
    const int u = (edge.axis + 1) % 3, v = (edge.axis + 2) % 3;
    const Coord low = along(edge.voxel, u, -1);
    return {along(low, v, -1), along(edge.voxel, v, -1), edge.voxel, low};
}

/// Appends the crossed edges that begin at these voxels, or that end there and begin at a voxel that is not fresh.
void findEdges(const openvdb::FloatTree& tree, const std::vector<Coord>& voxels, const openvdb::MaskTree& fresh,
               std::vector<Edge>& edges) {
    const Known known(tree);
    const openvdb::tree::ValueAccessor<const openvdb::MaskTree> isFresh(fresh);
    for (const Coord& voxel : voxels) {
        const auto w = static_cast<double>(known.getValue(voxel));
        for (int axis = 0; axis < 3; ++axis) {
            float other = 0;
            const Coord next = along(voxel, axis, 1), before = along(voxel, axis, -1);
            if (known.probeValue(next, other) && crossed(w, static_cast<double>(other)))
                edges.push_back({voxel, axis, w, static_cast<double>(other)});
            if (!isFresh.isValueOn(before) && known.probeValue(before, other) && crossed(static_cast<double>(other), w))
                edges.push_back({before, axis, static_cast<double>(other), w});
        }
    }
}

/// Returns the voxels of the cells around edges where w is not known.
openvdb::MaskTree::Ptr missingAround(const openvdb::FloatTree& tree, const std::vector<Edge>& edges, size_t first) {
    auto missing = std::make_shared<openvdb::MaskTree>();
    const Known known(tree);
    openvdb::tree::ValueAccessor<openvdb::MaskTree> mask(*missing);
    for (size_t n = first; n < edges.size(); ++n)
        for (const Coord& cell : cellsAround(edges[n]))
            for (int corner = 0; corner < 8; ++corner) {
                const Coord voxel = cell.offsetBy(corner & 1, corner >> 1 & 1, corner >> 2);
                if (!known.isValueOn(voxel)) mask.setValueOn(voxel);
            }
    return missing;
}

std::vector<Coord> voxelsOf(const openvdb::MaskTree& mask) {
    std::vector<Coord> voxels;
    for (auto value = mask.cbeginValueOn(); value; ++value) voxels.push_back(value.getCoord());
    return voxels;
}

/// Finds where |w| is 1/2 on an edge by the method of false position (Illinois), in voxels.
openvdb::Vec3d crossingOf(const Edge& edge, const std::function<double(const openvdb::Vec3d&)>& at) {
    const auto off = [](double w) { return std::abs(w) - 0.5; };
    double s = 0, t = 1, f = off(edge.w0), g = off(edge.w1), middle = 0.5;
    openvdb::Vec3d place = edge.voxel.asVec3d();
    for (int k = 0; k < 4; ++k) {
        middle = f == g ? 0.5 * (s + t) : std::clamp(s + (t - s) * f / (f - g), s, t);
        place[edge.axis] = edge.voxel[edge.axis] + middle;
        const double h = off(at(place));
        if (std::abs(h) < 1e-3) break;
        if ((h > 0) == (f > 0)) {
            s = middle, f = h, g *= 0.5;
        } else {
            t = middle, g = h, f *= 0.5;
        }
    }
    return place;
}

} // namespace

void appendHoleSurface(openvdb::FloatTree& known, const std::function<void(const std::vector<Coord>&)>& extend,
                       const std::function<double(const openvdb::Vec3d&)>& at,
                       const openvdb::math::Transform& transform, Mesh& mesh, const Monitor& monitor) {
    auto fresh = std::make_shared<openvdb::MaskTree>();
    fresh->topologyUnion(known);
    std::vector<Coord> voxels = voxelsOf(*fresh);
    std::vector<Edge> edges;
    while (!voxels.empty()) {
        const size_t first = edges.size();
        findEdges(known, voxels, *fresh, edges);
        monitor.check();
        fresh = missingAround(known, edges, first);
        voxels = voxelsOf(*fresh);
        extend(voxels);
    }

    std::vector<openvdb::Vec3d> crossings(edges.size());
    parallelFor(
        edges.size(), 256,
        [&](size_t begin, size_t end) {
            for (size_t n = begin; n < end; ++n) crossings[n] = crossingOf(edges[n], at);
        },
        monitor);

    // One vertex per cell that has a crossing.
    openvdb::Int32Tree vertexOf(-1);
    openvdb::tree::ValueAccessor<openvdb::Int32Tree> vertices(vertexOf);
    std::vector<openvdb::Vec3d> sums;
    std::vector<int> counts;
    for (size_t n = 0; n < edges.size(); ++n)
        for (const Coord& cell : cellsAround(edges[n])) {
            int32_t vertex = vertices.getValue(cell);
            if (vertex < 0) {
                vertex = static_cast<int32_t>(sums.size());
                vertices.setValueOn(cell, vertex);
                sums.emplace_back(0.0);
                counts.push_back(0);
            }
            sums[static_cast<size_t>(vertex)] += crossings[n];
            ++counts[static_cast<size_t>(vertex)];
        }
    const auto firstVertex = static_cast<openvdb::Index32>(mesh.points.size());
    for (size_t n = 0; n < sums.size(); ++n)
        mesh.points.emplace_back(transform.indexToWorld(sums[n] / static_cast<double>(counts[n])));
    for (const Edge& edge : edges) {
        openvdb::Vec4I quad;
        int k = 0;
        for (const Coord& cell : cellsAround(edge))
            quad[k++] = firstVertex + static_cast<openvdb::Index32>(vertices.getValue(cell));
        mesh.quads.push_back(quad);
    }
}

} // namespace curlew
