// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/math/Vec.h"

#include <cstddef>
#include <cstdint>
#include <string_view>
#include <vector>

namespace curlew {

/// Why a curve goes no further at one of its ends.
enum class CurveEnd : uint8_t {
    seed,       ///< It begins there, and was not followed in that direction.
    closed,     ///< It came back to its seed.
    limit,      ///< It is as long as was asked for.
    vertices,   ///< It has as many vertices as it may have.
    box,        ///< It leaves the box of the domain; its last vertex lies on a face of it.
    stagnation, ///< The flow (nearly) stands still.
    stuck,      ///< Even the smallest step was not back on the track, or led through a wall.
    outside     ///< The seed is not in the domain: the curve has no vertices.
};
inline constexpr size_t kCurveEnds = 8;
/// As files and reports have them.
inline constexpr std::array<std::string_view, kCurveEnds> kCurveEndNames{"seed", "closed",     "limit", "vertices",
                                                                         "box",  "stagnation", "stuck", "outside"};
constexpr const char* nameOf(CurveEnd end) { return kCurveEndNames[static_cast<size_t>(end)].data(); }

/// What the steps along a curve are equal in.
enum class StepBy { length, time };
inline constexpr std::array<std::string_view, 2> kStepByNames{"length", "time"};

/// Polylines as a structure of arrays. Curve k has the vertices start[k] … start[k + 1] - 1, in the order in which the
/// flow passes them. The closing edge of a closed curve leads from its last vertex to its first; no vertex is there
/// twice.
struct Curves {
    std::vector<double> x, y, z;   ///< Position, world units.
    std::vector<float> vx, vy, vz; ///< Velocity of the flow there, world units per second.
    std::vector<double> f, g;      ///< Potentials of the flow there; empty where it has no tracks.
    std::vector<double> along;     ///< From the seed, where it is 0: world units or seconds; negative upstream.
    StepBy by = StepBy::length;    ///< Which of the two.

    std::vector<size_t> start{0};
    std::vector<int64_t> id;                    ///< Of the seed.
    std::vector<CurveEnd> upstream, downstream; ///< Both are `closed`, or neither is.
    std::vector<double> length; ///< World units, that of the closing edge included; of fourth order in the steps.
    std::vector<double> gap;    ///< How far from its seed a closed curve came back, world units; 0 for open ones.

    size_t size() const { return id.size(); }
    size_t vertices() const { return x.size(); }
    bool hasTrack() const { return !f.empty(); }
    bool closed(size_t curve) const { return downstream[curve] == CurveEnd::closed; }
    Vec3d position(size_t vertex) const { return {{x[vertex], y[vertex], z[vertex]}}; }
    float speed(size_t vertex) const {
        return curlew::length(Vec3f{{vx[vertex], vy[vertex], vz[vertex]}}); // our `length` is an array
    }
    /// How many lines between two vertices there are.
    size_t edges() const {
        size_t count = 0;
        for (size_t k = 0; k < size(); ++k)
            if (const size_t n = start[k + 1] - start[k]; n > 0) count += closed(k) ? n : n - 1;
        return count;
    }

    /// Memory of one vertex, in bytes.
    static constexpr size_t kVertexBytes = 6 * sizeof(double) + 3 * sizeof(float);
};

} // namespace curlew
