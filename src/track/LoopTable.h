// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "LoopTracer.h"
#include "curlew/track/Loop.h"

namespace curlew {

/// The tabulated track of one particle.
struct LoopPath {
    LoopKind kind = LoopKind::still;
    bool outside = false; ///< The particle is on the wrong side of the wall.
    CurveEnd end = CurveEnd::outside;
    uint32_t begin = 0, count = 0; ///< Its range of vertices.
    uint32_t coarse = 0;           ///< Steps that exceed the accuracy.
    double rounds = 0, period = 0; ///< If closed; the period in seconds.
    double first = 0, last = 0;    ///< If fading: the times, relative to the seed, between which it is visible.
    double gap = 0;                ///< If closed, world units.

    double pace(double duration) const { return kind == LoopKind::closed ? rounds * period / duration : 1; }
};

/// The position of a particle on its track.
struct LoopPlace {
    double time = 0; ///< Seconds from the seed.
    float fade = 1;
};
LoopPlace placeOn(const LoopPath& path, double phase, double duration);

/// The tracks of up to kBatch particles.
struct LoopTable {
    std::vector<LoopPath> paths = {};
    std::vector<LoopVertex> vertices = {};
    TrackBatch track;                    ///< Potentials at the seeds.
    std::array<double, kBatch> distance; ///< Distance of the seeds from the wall.

    /// Returns the vertex at which the interval that contains the time begins; the last vertex if no interval does.
    size_t vertexAt(const LoopPath& path, double time) const;
    /// Evaluates the quintic Hermite interpolant of the interval that begins at a vertex.
    Vec3d interpolate(size_t vertex, double time) const;
};

/// Computes the tracks of the seeds begin … end - 1.
LoopTable loopTable(const LoopSetup& setup, double duration, const Points& seeds, size_t begin, size_t end,
                    const Monitor& monitor);

} // namespace curlew
