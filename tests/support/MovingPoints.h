// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/field/NoiseField.h"
#include "curlew/flow/Flow.h"
#include "curlew/track/Points.h"

#include <vector>

namespace curlew::test {

inline Vec3d position(const Points& p, size_t k) { return {{p.x[k], p.y[k], p.z[k]}}; }

inline Points particlesAt(const std::vector<Vec3d>& points, int64_t firstId = 0) {
    Points particles;
    for (const Vec3d& p : points) {
        particles.id.push_back(firstId + static_cast<int64_t>(particles.size()));
        particles.x.push_back(p[0]);
        particles.y.push_back(p[1]);
        particles.z.push_back(p[2]);
    }
    return particles;
}

inline size_t countOutside(const Domain& domain, const Points& particles) {
    size_t outside = 0;
    for (size_t k = 0; k < particles.size(); ++k)
        outside += !(beyondWall(domain.wall->side, domain.wall->sdf.distance.at<0>(position(particles, k)).value) < 0);
    return outside;
}

/// A bounded flow of speed 1.
inline Flow boundFlow(const Sdf& sdf, Side side, double width = 0.2) {
    const Wall wall{.sdf = sdf, .side = side, .width = width};
    return withSpeed(Flow(noiseField<Psrd3>({.seed = 1}, {.frequency = 1.5}),
                          bounded(noiseField<Psrd3>({.seed = 2}, {.frequency = 1.5}), wall), Domain::of(wall)),
                     1);
}

} // namespace curlew::test
