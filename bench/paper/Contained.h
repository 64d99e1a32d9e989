// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/field/NoiseField.h"
#include "curlew/flow/Flow.h"
#include "curlew/track/Advect.h"
#include "curlew/track/Scatter.h"
#include "curlew/vdb/LevelSet.h"
#include "curlew/vdb/MeshFile.h"

#include <algorithm>

namespace curlew::paper {

/// Returns the flow of the main example in docs/guide.md: two psrd noises with two octaves, frequency 3, a layer width
/// of 0.1 and an rms speed of 1.
inline Flow containedFlow(const Sdf& sdf) {
    const Wall wall{.sdf = sdf, .side = Side::inside, .width = 0.1};
    const OctaveOptions octaves{.frequency = 3, .octaves = 2};
    return withSpeed(Flow(noiseField<Psrd3>({.seed = 1}, octaves),
                          bounded(noiseField<Psrd3>({.seed = 2}, octaves), wall), Domain::of(wall)),
                     1);
}

inline Sdf spotSdf() {
    const auto mesh = std::make_shared<const Mesh>(readMesh(CURLEW_SCENES "/spot.obj"));
    return sdfOf(meshToLevelSet(mesh, {.dim = 192, .halfWidth = 16})); // the narrow band must contain the layer
}

/// Distances between corresponding points, world units.
struct Apart {
    double mean = 0, most = 0;
};
inline Apart apart(const Points& a, const Points& b) {
    Apart d;
    for (size_t k = 0; k < a.size(); ++k) {
        const double distance = length(a.position(k) - b.position(k));
        d.mean += distance / static_cast<double>(a.size());
        d.most = std::max(d.most, distance);
    }
    return d;
}

} // namespace curlew::paper
