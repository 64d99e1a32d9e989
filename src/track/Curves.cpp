// SPDX-License-Identifier: Apache-2.0
#include "curlew/track/Curves.h"

#include "curlew/base/Error.h"

#include <fmt/format.h>

#include <cmath>
#include <numeric>

namespace curlew {

namespace {

/// Joins edges to chains of vertices. The first and the last vertex of a closed chain are the same.
class EdgeChains {
  public:
    EdgeChains(const std::vector<CurveEdge>& edges, size_t vertices)
        : mEdges(edges), mStart(vertices + 1), mAt(2 * edges.size()), mUsed(edges.size()) {
        for (const CurveEdge& edge : edges)
            for (const uint32_t v : edge) ++mStart[v + 1];
        std::partial_sum(mStart.begin(), mStart.end(), mStart.begin());
        std::vector<size_t> next(mStart.begin(), mStart.end() - 1);
        for (size_t e = 0; e < edges.size(); ++e)
            for (const uint32_t v : edges[e]) mAt[next[v]++] = e;
    }

    std::vector<std::vector<uint32_t>> chains() {
        // First those with ends, from the first vertex of an edge if possible; then the loops.
        for (const size_t end : {0, 1})
            for (size_t e = 0; e < mEdges.size(); ++e)
                if (!isPassed(mEdges[e][end])) follow(mEdges[e][end], e);
        for (size_t e = 0; e < mEdges.size(); ++e) follow(mEdges[e][0], e);
        return std::move(mChains);
    }

  private:
    /// Returns whether a chain goes on at this vertex.
    bool isPassed(uint32_t v) const { return mStart[v + 1] - mStart[v] == 2; }

    /// Adds the chain that begins with this edge, unless another chain has it.
    void follow(uint32_t first, size_t edge) {
        if (mUsed[edge]) return;
        auto& chain = mChains.emplace_back(1, first);
        for (;;) {
            mUsed[edge] = true;
            const uint32_t v = mEdges[edge][mEdges[edge][0] == chain.back() ? 1 : 0];
            chain.push_back(v);
            if (!isPassed(v) || v == first) return;
            edge = mAt[mStart[v]] == edge ? mAt[mStart[v] + 1] : mAt[mStart[v]];
        }
    }

    const std::vector<CurveEdge>& mEdges;
    std::vector<size_t> mStart, mAt; ///< The edges at vertex v are mAt[mStart[v]] to before mAt[mStart[v + 1]].
    std::vector<char> mUsed;
    std::vector<std::vector<uint32_t>> mChains;
};

void checkEdges(const std::vector<Vec3d>& vertices, const std::vector<CurveEdge>& edges) {
    for (size_t e = 0; e < edges.size(); ++e) {
        if (edges[e][0] == edges[e][1])
            throw ValueError(fmt::format("edge {} joins vertex {} to itself", e, edges[e][0]));
        for (const uint32_t v : edges[e]) {
            if (v >= vertices.size())
                throw ValueError(
                    fmt::format("edge {} has vertex {}, but there are {} vertices", e, v, vertices.size()));
            for (int axis = 0; axis < 3; ++axis)
                if (!std::isfinite(vertices[v][axis]))
                    throw ValueError(fmt::format("vertex {} has a coordinate that is not a finite number", v));
        }
    }
}

} // namespace

Curves curvesOf(const std::vector<Polyline>& polylines) {
    Curves curves;
    for (const Polyline& line : polylines) {
        double along = 0;
        for (size_t k = 0; k < line.points.size(); ++k) {
            const Vec3d& p = line.points[k];
            if (k > 0) along += length(p - line.points[k - 1]);
            curves.x.push_back(p[0]), curves.y.push_back(p[1]), curves.z.push_back(p[2]);
            curves.along.push_back(along);
        }
        curves.start.push_back(curves.x.size());
        curves.id.push_back(line.id);
        curves.upstream.push_back(line.closed ? CurveEnd::closed : CurveEnd::seed);
        curves.downstream.push_back(line.closed ? CurveEnd::closed : CurveEnd::limit);
        const bool closes = line.closed && !line.points.empty();
        curves.length.push_back(along + (closes ? length(line.points.front() - line.points.back()) : 0));
        curves.gap.push_back(0);
    }
    for (auto* velocities : {&curves.vx, &curves.vy, &curves.vz}) velocities->assign(curves.x.size(), 0);
    return curves;
}

Curves curvesOf(const std::vector<Vec3d>& vertices, const std::vector<CurveEdge>& edges,
                const std::vector<int64_t>& ids) {
    checkEdges(vertices, edges);
    if (!ids.empty() && ids.size() != vertices.size())
        throw ValueError(
            fmt::format("{} ids for {} vertices; give one per vertex, or none", ids.size(), vertices.size()));
    std::vector<Polyline> polylines;
    for (auto& chain : EdgeChains(edges, vertices.size()).chains()) {
        const bool loop = chain.front() == chain.back();
        if (loop) chain.pop_back();
        Polyline& line = polylines.emplace_back();
        line.closed = loop && chain.size() > 2;
        line.id = ids.empty() ? static_cast<int64_t>(polylines.size() - 1) : ids[chain.front()];
        for (const uint32_t v : chain) line.points.push_back(vertices[v]);
    }
    return curvesOf(polylines);
}

} // namespace curlew
