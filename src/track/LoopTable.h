// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "LoopTracer.h"
#include "curlew/track/Loop.h"

namespace curlew {

/// The track of one particle, in a table.
struct LoopPath {
    LoopKind kind = LoopKind::still;
    bool outside = false; ///< It is on the wrong side of the wall.
    CurveEnd end = CurveEnd::outside;
    uint32_t begin = 0, count = 0; ///< Its vertices.
    uint32_t coarse = 0;           ///< Steps beyond the accuracy.
    double rounds = 0, period = 0; ///< Of a closed one; the period in seconds.
    double first = 0, last = 0;    ///< Of a fading one: the times from the seed between which it is seen.
    double gap = 0;                ///< Of a closed one, world units.

    double pace(double duration) const { return kind == LoopKind::closed ? rounds * period / duration : 1; }
};

/// Where a particle is.
struct LoopPlace {
    double time = 0; ///< On its track, seconds from the seed.
    float fade = 1;
};
LoopPlace placeOn(const LoopPath& path, double phase, double duration);

/// The tracks of up to kBatch particles.
struct LoopTable {
    std::vector<LoopPath> paths = {};
    std::vector<LoopVertex> vertices = {};
    TrackBatch track;                    ///< The potentials at the seeds.
    std::array<double, kBatch> distance; ///< Of the seeds from the wall.

    /// The vertex of a path at which an interval begins that holds the time; the last one if none does.
    size_t vertexAt(const LoopPath& path, double time) const;
    /// The quintic Hermite interpolant from a vertex on.
    Vec3d interpolate(size_t vertex, double time) const;
};

/// Finds the tracks of the seeds begin … end - 1.
LoopTable loopTable(const LoopSetup& setup, double duration, const Points& seeds, size_t begin, size_t end,
                    const Monitor& monitor);

} // namespace curlew
