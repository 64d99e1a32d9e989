// SPDX-License-Identifier: Apache-2.0
#include "curlew/base/Parallel.h"
#include "curlew/flow/Flows.h"
#include "curlew/gpu/GpuAdvect.h"
#include "gpu/Gpu.h"

using namespace curlew;
using namespace curlew::test;

namespace {

std::vector<double> apart(const Points& a, const Points& b) {
    REQUIRE(a.size() == b.size());
    std::vector<double> distances;
    for (size_t k = 0; k < a.size(); ++k) distances.push_back(length(a.position(k) - b.position(k)));
    return distances;
}

} // namespace

TEST_CASE("advectOnGpu: particles end where advect() takes them, on the same tracks", "[gpu]") {
    const auto gpu = gpuOrSkipped();
    if (!gpu) return;
    for (const Side side : {Side::inside, Side::outside})
        for (const int steps : {50, 0}) {
            CAPTURE(static_cast<int>(side), steps);
            const Flow flow = besideSphere(side);
            const AdvectOptions options{.time = 1, .steps = steps};
            Points expected = Points::at(positionsIn(flow, 2000)), found = expected;
            const AdvectResult reference = advect(flow, expected, options);
            const AdvectResult result = advectOnGpu(gpu, flow, found, options);
            CHECK(medianOf(apart(expected, found)) < 2e-5);
            CHECK(found.f == expected.f);
            CHECK(found.g == expected.g);
            CHECK(result.points == 2000);
            CHECK(result.outside == 0);
            CHECK(result.notConverged == 0);
            CHECK(result.residual[0] < 1e-8);
            CHECK(result.residual[1] < 1e-8);
            CHECK(static_cast<double>(result.substeps) ==
                  Catch::Approx(static_cast<double>(reference.substeps)).epsilon(0.02));
            CHECK(result.errorMean == Catch::Approx(reference.errorMean).epsilon(0.1));
            std::vector<double> velocities;
            for (size_t k = 0; k < found.size(); ++k)
                velocities.push_back(static_cast<double>(std::abs(found.vx[k] - expected.vx[k])));
            CHECK(medianOf(velocities) < 1e-4);
        }
}

TEST_CASE("advectOnGpu: keeps tracks, moves the young for their age, and leaves those beyond the wall", "[gpu]") {
    const auto gpu = gpuOrSkipped();
    if (!gpu) return;
    const Flow flow = besideSphere(Side::inside);
    Points expected = Points::at(positionsIn(flow, 500));
    expected.setPosition(0, {{2, 0, 0}}); // outside
    expected.age.assign(500, 10);
    for (size_t k = 1; k < 100; ++k) expected.age[k] = 0.25f;
    Points found = expected;
    AdvectOptions options{.time = 1, .steps = 40, .byAge = true};
    for (int frame = 0; frame < 2; ++frame) { // the tracks are known in the second
        const AdvectResult reference = advect(flow, expected, options), result = advectOnGpu(gpu, flow, found, options);
        CHECK(result.outside == reference.outside);
        CHECK(result.outside == 1);
        CHECK(medianOf(apart(expected, found)) < 5e-6);
        CHECK(found.position(0) == Vec3d{{2, 0, 0}});
        CHECK(found.f == expected.f);
    }
}

TEST_CASE("advectOnGpu: sums and flows without a wall", "[gpu]") {
    const auto gpu = gpuOrSkipped();
    if (!gpu) return;
    const auto noise = [](uint64_t seed) { return noiseField<Psrd3>({.seed = seed}); };
    const Flow sum = withSpeed(curlFlow(std::array{noise(1), noise(2), noise(3)}, Domain{}), 1),
               one = flowOf<Psrd3>({});
    for (const Flow& flow : {sum, one}) {
        Points expected = Points::at(positionsIn(flow, 500)), found = expected;
        const AdvectOptions options{.time = 0.5, .steps = 40};
        advect(flow, expected, options);
        const AdvectResult result = advectOnGpu(gpu, flow, found, options);
        CHECK(medianOf(apart(expected, found)) < 5e-6);
        CHECK(result.notConverged == 0);
        CHECK(found.f.size() == (flow.hasTracks() ? 500u : 0u));
    }
    Points none;
    CHECK(advectOnGpu(gpu, one, none, {.steps = 3}).points == 0);
}

TEST_CASE("advectOnGpu: the same device gives the same bytes", "[gpu]") {
    const auto gpu = gpuOrSkipped();
    if (!gpu) return;
    const Flow flow = besideSphere(Side::outside);
    const Points start = Points::at(positionsIn(flow, 1000));
    Points a = start, b = start;
    advectOnGpu(gpu, flow, a, {.time = 0.5});
    {
        const ThreadLimit limit(1);
        advectOnGpu(gpu, flow, b, {.time = 0.5});
    }
    CHECK(a.x == b.x);
    CHECK(a.vz == b.vz);
}

TEST_CASE("whyNotOnGpu: what only the processor does", "[gpu]") {
    const Flow flow = flowOf<Psrd3>({});
    const Flow sum = flow + flow;
    CHECK(whyNotOnGpu(flow, {}).empty());
    CHECK(whyNotOnGpu(sum, {}).empty());
    CHECK(!whyNotOnGpu(sum, {.splitting = Splitting::strang}).empty());
    CHECK(!whyNotOnGpu(flow, {.reprojection = {.method = Reprojection::newton}}).empty());
    const auto gpu = gpuOrSkipped();
    if (!gpu) return;
    Points points = Points::at({{{0.1, 0.2, 0.3}}});
    CHECK_THROWS_AS(advectOnGpu(gpu, sum, points, {.splitting = Splitting::strang}), ValueError);
    CHECK_THROWS_AS(advectOnGpu(gpu, flow, points, {.steps = -1}), ValueError);
}
