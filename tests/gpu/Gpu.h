// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/field/Bound.h"
#include "curlew/field/Shapes.h"
#include "curlew/flow/FlowScale.h"
#include "curlew/gpu/Gpu.h"
#include "support/Flows.h"
#include "support/Points.h"

#include <algorithm>

namespace curlew::test {

/// Returns the preferred GPU, usually the software device of Mesa; nothing, with a warning, if there is none.
inline std::shared_ptr<Gpu> gpuOrSkipped() {
    try {
        return Gpu::open(preferredGpu(gpus()));
    } catch (const GpuError& e) {
        WARN("skipped: " << e.what());
        return nullptr;
    }
}

/// A flow of two octaves of noise at an rms speed of 1, on a side of the unit sphere.
inline Flow besideSphere(Side side) {
    const WallN<3> wall{.sdf = sphereSdf(1), .side = side, .width = 0.3};
    const auto potential = [&](uint64_t seed) {
        return bounded(noiseField<Psrd3>({.seed = seed}, {.frequency = 1.5, .octaves = 2}), wall);
    };
    return withSpeed(Flow(potential(1), potential(2), Domain::of(wall, 0.5)), 1);
}

/// Random positions in the domain of a flow.
template <int N>
std::vector<Vec<double, N>> positionsIn(const FlowN<N>& flow, size_t count) {
    std::vector<Vec<double, N>> positions;
    for (size_t k = 0; positions.size() < count; ++k) {
        const Vec<double, N> p = randomPoint(flow.domain().box, 5, k);
        const auto& wall = flow.domain().wall;
        if (wall && beyondWall(wall->side, wall->sdf.distance.template at<0>(p).value) > -1e-4) continue;
        positions.push_back(p);
    }
    return positions;
}

inline double medianOf(std::vector<double> values) {
    REQUIRE(!values.empty());
    std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2), values.end());
    return values[values.size() / 2];
}

} // namespace curlew::test
