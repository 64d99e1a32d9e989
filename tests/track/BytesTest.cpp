// SPDX-License-Identifier: Apache-2.0
// Bytes that every processor must give, as digests that were computed on x86-64: velocities on a grid, and points.
// Nothing in them calls a trigonometric function, because C libraries round these differently.
#include "curlew/base/Digest.h"
#include "curlew/field/Bound.h"
#include "curlew/field/NoiseField.h"
#include "curlew/field/Shapes.h"
#include "curlew/flow/Evaluate.h"
#include "curlew/noise/PerlinNoise.h"
#include "curlew/noise/SimplexNoise.h"
#include "curlew/track/Advect.h"
#include "curlew/track/Scatter.h"
#include "support/Catch.h"

#include <vector>

using namespace curlew;

namespace {

/// A flow of two noises inside a sphere.
Flow noiseFlow() {
    const Wall wall{sphereSdf(1), Side::inside, 0.2};
    return Flow(bounded(noiseField<PerlinNoise<3>>({.seed = 1}, {.frequency = 2, .octaves = 2}), wall),
                bounded(noiseField<SimplexNoise<3>>({.seed = 2}, {.frequency = 2, .octaves = 2}), wall),
                Domain::of(wall, 0));
}

template <class T>
std::string digestOf(const std::vector<T>& numbers) {
    return DigestBuilder().addBytes(numbers.data(), numbers.size() * sizeof(T)).digest().hex();
}

} // namespace

TEST_CASE("bytes: velocities on a grid are the same on every processor", "[track]") {
    std::vector<Vec3d> positions;
    for (int n = 0; n < 16 * 16 * 16; ++n)
        positions.push_back({{(n % 16 - 7.5) / 8, (n / 16 % 16 - 7.5) / 8, (n / 256 - 7.5) / 8}});
    std::vector<Vec<float, 3>> velocities(positions.size());
    evaluateVelocities(noiseFlow(), positions, velocities);
    CHECK(digestOf(velocities) == "b6a28eabe8e920e3dbd1ffaeec111ec6");
}

TEST_CASE("bytes: advected points are the same on every processor", "[track]") {
    const Flow flow = noiseFlow();
    Points points = scatter(flow.domain(), 500, 3);
    advect(flow, points, {.time = 0.5, .steps = 8});
    CHECK(digestOf(points.x) == "99b0affaeb0ecafb8814c9d785d01ce7");
    CHECK(digestOf(points.y) == "dfb157f054aa911f850db583d3507016");
    CHECK(digestOf(points.z) == "11435f89a0755e9f6b4a4732700df209");
}
