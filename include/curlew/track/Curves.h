// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/math/Vec.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>
#include <vector>

namespace curlew {

/// Why a curve ends.
enum class CurveEnd : uint8_t {
    seed,       ///< The curve starts here and was not followed in this direction.
    closed,     ///< The curve returned to its seed.
    limit,      ///< The curve reached the requested length.
    vertices,   ///< The curve reached the maximum number of vertices.
    box,        ///< The curve leaves the domain's box; its last vertex lies on a face of the box.
    stagnation, ///< The flow is zero or nearly zero.
    stuck,      ///< Even the smallest step did not return to the track, or crossed a wall.
    outside     ///< The seed is not in the domain: the curve has no vertices.
};
inline constexpr size_t kCurveEnds = 8;
/// The names used in files and reports.
inline constexpr std::array<std::string_view, kCurveEnds> kCurveEndNames{"seed", "closed",     "limit", "vertices",
                                                                         "box",  "stagnation", "stuck", "outside"};
constexpr const char* nameOf(CurveEnd end) { return kCurveEndNames[static_cast<size_t>(end)].data(); }

/// The quantity in which the steps along a curve are equal.
enum class StepBy { length, time };
inline constexpr std::array<std::string_view, 2> kStepByNames{"length", "time"};

/// Polylines as a structure of arrays. Curve k has the vertices start[k] … start[k + 1] - 1, in flow order. A closed
/// curve does not repeat its first vertex: its closing edge leads from the last vertex to the first.
struct Curves {
    std::vector<double> x, y, z;   ///< Position, world units.
    std::vector<float> vx, vy, vz; ///< Velocity of the flow there, world units per second.
    std::vector<double> f, g;      ///< Potentials of the flow there; empty if it has no tracks.
    std::vector<double> along;     ///< Distance or time from the seed, world units or seconds; negative upstream.
    StepBy by = StepBy::length;    ///< Whether `along` is distance or time.

    std::vector<size_t> start{0};
    std::vector<int64_t> id;                    ///< Id of the seed.
    std::vector<CurveEnd> upstream, downstream; ///< Either both are `closed` or neither is.
    /// World units, including the closing edge. Fourth order in the step size; that of pathlines is the sum of their
    /// chords, so second order.
    std::vector<double> length;
    std::vector<double> gap; ///< Distance from the seed at which a closed curve returned, world units; 0 for open ones.

    size_t size() const { return id.size(); }
    size_t vertices() const { return x.size(); }
    bool hasTrack() const { return !f.empty(); }
    bool closed(size_t curve) const { return downstream[curve] == CurveEnd::closed; }
    Vec3d position(size_t vertex) const { return {{x[vertex], y[vertex], z[vertex]}}; }
    float speed(size_t vertex) const {
        return curlew::length(Vec3f{{vx[vertex], vy[vertex], vz[vertex]}}); // our `length` is an array
    }
    /// Number of line segments.
    size_t edges() const {
        size_t count = 0;
        for (size_t k = 0; k < size(); ++k)
            if (const size_t n = start[k + 1] - start[k]; n > 0) count += closed(k) ? n : n - 1;
        return count;
    }

    /// Memory per vertex, bytes.
    static constexpr size_t kVertexBytes = 6 * sizeof(double) + 3 * sizeof(float);
};

/// A drawn curve.
struct Polyline {
    std::vector<Vec3d> points = {};
    bool closed = false;
    int64_t id = 0;
};

/// Returns drawn curves, one per polyline, even if that has no points. Their seeds are their first points, velocities
/// are zero.
Curves curvesOf(const std::vector<Polyline>& polylines);

/// The indices of two vertices.
using CurveEdge = std::array<uint32_t, 2>;

/// Joins edges to curves, where exactly two meet at a vertex. A curve with ends begins at the first vertex of an edge
/// if it can, a closed one at that of its first edge. Curves with ends come first. Vertices without edges are left out.
/// The ids count the curves, or are those of their first vertices if `ids` is not empty. Throws ValueError, naming the
/// edge or the vertex, if an edge joins a vertex to itself or to one that does not exist, or if a coordinate is not
/// finite; and if there are ids, but not one per vertex.
Curves curvesOf(const std::vector<Vec3d>& vertices, const std::vector<CurveEdge>& edges,
                const std::vector<int64_t>& ids = {});

} // namespace curlew
