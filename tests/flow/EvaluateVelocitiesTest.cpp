// SPDX-License-Identifier: Apache-2.0
#include "curlew/flow/Evaluate.h"
#include "support/Catch.h"
#include "support/Flows.h"
#include "support/Points.h"

using namespace curlew;
using namespace curlew::test;

TEST_CASE("evaluateVelocities: agrees with the flow in float and double", "[flow]") {
    const Flow flow(sinesF(), sinesG());
    const auto positions = randomPoints(cube(1), 200, 1);
    std::vector<Vec3d> velocities(positions.size());
    std::vector<Vec3f> rounded(positions.size());
    evaluateVelocities(flow, positions, velocities);
    evaluateVelocities(flow, positions, rounded);
    for (size_t k = 0; k < positions.size(); ++k) {
        PointBatch one;
        one.push(positions[k]);
        VecBatch<double> exact;
        VecBatch<float> single;
        flow.velocity(one, exact);
        flow.velocity(one, single);
        CHECK(velocities[k] == exact[0]);
        CHECK(rounded[k] == single[0]);
    }
    rounded.pop_back();
    CHECK_THROWS_AS(evaluateVelocities(flow, positions, rounded), ValueError);
}
