// SPDX-License-Identifier: Apache-2.0
#include "curlew/field/CallbackField.h"
#include "curlew/flow/Flows.h"
#include "curlew/gpu/GpuFlow.h"
#include "gpu/Gpu.h"

using namespace curlew;
using namespace curlew::test;

namespace {

/// Checks velocities against those of the processor, relative to their root mean square.
template <int N>
void checkVelocities(const std::string& name, const GpuFlowN<N>& onGpu, const FlowN<N>& flow, double tolerance) {
    CAPTURE(name);
    const auto positions = positionsIn(flow, 5000);
    std::vector<Vec<float, N>> found;
    onGpu.velocities(positions, found);
    REQUIRE(found.size() == positions.size());
    double worst = 0, squares = 0;
    for (size_t k = 0; k < positions.size(); ++k) {
        const Vec<double, N> expected = flow.at(positions[k]).velocity;
        for (int axis = 0; axis < N; ++axis)
            worst = std::max(worst, std::abs(static_cast<double>(found[k][axis]) - expected[axis]));
        squares += dot(expected, expected);
    }
    CHECK(worst / std::sqrt(squares / static_cast<double>(positions.size())) < tolerance);
}

/// The largest change of the potentials along the way, relative to their root mean squares.
template <int N>
double driftOf(const FlowN<N>& flow, const std::vector<Vec<double, N>>& from, const std::vector<Vec<double, N>>& to) {
    const auto rms = rmsOf(flow);
    double drift = 0;
    for (size_t k = 0; k < from.size(); ++k)
        for (size_t q = 0; q + 1 < size_t{N}; ++q)
            drift = std::max(drift, std::abs(flow.potentials()[q].template at<0>(to[k]).value -
                                             flow.potentials()[q].template at<0>(from[k]).value) /
                                        rms.potentials[q]);
    return drift;
}

} // namespace

TEST_CASE("GpuFlowN: velocities are those of the processor", "[gpu]") {
    const auto gpu = gpuOrSkipped();
    if (!gpu) return;
    const auto check = [&](const std::string& name, const auto& flow, double tolerance = 5e-5) {
        for (const auto coordinates : {ShaderCoordinates::doubles, ShaderCoordinates::pairs}) {
            CAPTURE(static_cast<int>(coordinates));
            checkVelocities(name, GpuFlowN(gpu, flow, coordinates), flow, tolerance);
        }
    };
    check("inside", besideSphere(Side::inside));
    check("outside", besideSphere(Side::outside));
    check("plane", FlowN<2>({noiseField<Psrd2>({}, {.frequency = 2, .octaves = 3})}));
    const ScalarField noise = noiseField<Psrd3>({.seed = 4}, {.frequency = 1.5});
    check("curl", curlFlow(std::array{noise, noiseField<Psrd3>({.seed = 5}), noiseField<Psrd3>({.seed = 6})}, {}));
    // Near stagnation points, where the direction turns quickly, rounding errors turn it as well.
    check("uniform speed", Flow(noise, noiseField<SimplexNoise<3>>()).normalized(2), 1e-3);
    const Box far{{{1000, 1000, 1000}}, {{1002, 1002, 1002}}};
    check("far from the origin", Flow(noise, noiseField<Psrd3>({.seed = 5})).within({.box = far, .wall = {}}));
}

TEST_CASE("GpuFlowN: a flow that shaders cannot express or floats cannot resolve is an error", "[gpu]") {
    const auto gpu = gpuOrSkipped();
    if (!gpu) return;
    const Flow called(callbackField<3>([](size_t count, const double*, double* values, double* gradients) {
                          std::fill_n(values, count, 0.0);
                          std::fill_n(gradients, 3 * count, 0.0);
                      }),
                      noiseField<Psrd3>());
    CHECK_THROWS_AS(GpuFlowN<3>(gpu, called), ValueError);
    // Float positions have errors of a tenth of a cell.
    const Flow fine = flowOf<Psrd3>({}, {.frequency = 1e6}).within({.box = Box{}.padded(1), .wall = {}});
    CHECK_THROWS_WITH(GpuFlowN<3>(gpu, fine), Catch::ContainsSubstring("float positions do not resolve this flow"));
}

TEST_CASE("GpuFlowN: points stay on their tracks and on their side of the wall", "[gpu]") {
    const auto gpu = gpuOrSkipped();
    if (!gpu) return;
    for (const Side side : {Side::inside, Side::outside, Side::both})
        for (const bool adaptive : {false, true}) {
            CAPTURE(static_cast<int>(side), adaptive);
            const Flow flow = besideSphere(side);
            GpuPointsN<3> points;
            points.position = positionsIn(flow, 2000);
            const auto start = points.position;
            GpuMoveOptions options{.time = 2, .steps = 100};
            if (adaptive)
                options = {
                    .scheme = Scheme::dormandPrince, .time = 2, .accuracy = 1e-5, .firstStep = 0.05, .rmsSpeed = 1};
            const GpuMoved moved = GpuFlowN<3>(gpu, flow).move(points, options);
            CHECK(moved.stalled == 0);
            CHECK(moved.substeps > 20 * start.size());
            CHECK(driftOf(flow, start, points.position) < 1.5e-5);
            size_t crossed = 0;
            double way = 0;
            for (size_t k = 0; k < start.size(); ++k) {
                const auto& distance = flow.domain().wall->sdf.distance;
                const double before = distance.at<0>(start[k]).value, after = distance.at<0>(points.position[k]).value;
                crossed += (before < 0) != (after < 0);
                way += length(points.position[k] - start[k]) / static_cast<double>(start.size());
            }
            CHECK(crossed == 0);
            CHECK(way > 0.2);
            CHECK(std::count(points.converged.begin(), points.converged.end(), uint8_t{0}) == 0);
            CHECK((medianOf({points.error.begin(), points.error.end()}) > 0) == adaptive);
        }
}

TEST_CASE("GpuFlowN: steps converge at the order of their scheme", "[gpu]") {
    const auto gpu = gpuOrSkipped();
    if (!gpu) return;
    const Flow flow = withSpeed(flowOf<Psrd3>({}), 1);
    const GpuFlowN<3> onGpu(gpu, flow);
    const auto landed = [&](Scheme scheme, int steps) {
        GpuPointsN<3> points;
        points.position = positionsIn(flow, 1000);
        onGpu.move(points, {.scheme = scheme, .time = 0.5, .steps = steps, .corrections = 0, .guarded = false});
        return points.position;
    };
    const auto exact = landed(Scheme::rk4, 200);
    const auto errorOf = [&](Scheme scheme, int steps) {
        const auto found = landed(scheme, steps);
        std::vector<double> errors;
        for (size_t k = 0; k < exact.size(); ++k) errors.push_back(length(found[k] - exact[k]));
        return medianOf(errors);
    };
    CHECK(std::log2(errorOf(Scheme::euler, 20) / errorOf(Scheme::euler, 40)) == Catch::Approx(1).margin(0.2));
    CHECK(std::log2(errorOf(Scheme::midpoint, 8) / errorOf(Scheme::midpoint, 16)) == Catch::Approx(2).margin(0.3));
    CHECK(std::log2(errorOf(Scheme::bogackiShampine, 4) / errorOf(Scheme::bogackiShampine, 8)) > 2.5);
    CHECK(std::log2(errorOf(Scheme::rk4, 3) / errorOf(Scheme::rk4, 6)) > 3.3);
}

TEST_CASE("GpuFlowN: equal steps that nothing guards return to their tracks", "[gpu]") {
    const auto gpu = gpuOrSkipped();
    if (!gpu) return;
    const Flow flow = withSpeed(flowOf<Psrd3>({}), 1);
    const GpuFlowN<3> onGpu(gpu, flow);
    constexpr int kSteps = 100; // more than one run makes at first
    const auto moved = [&](int corrections, bool limited, GpuPointsN<3>& points) {
        points.position = positionsIn(flow, 1000);
        return onGpu.move(points, {.time = 2,
                                   .steps = kSteps,
                                   .corrections = corrections,
                                   .enough = 1e-6,
                                   .limited = limited,
                                   .guarded = false});
    };
    const auto start = positionsIn(flow, 1000);
    GpuPointsN<3> free;
    CHECK(moved(0, true, free).corrections == 0);
    CHECK(driftOf(flow, start, free.position) > 1e-4);
    for (const bool limited : {false, true}) {
        CAPTURE(limited);
        GpuPointsN<3> corrected;
        const GpuMoved result = moved(4, limited, corrected);
        CHECK(result.substeps == start.size() * kSteps);
        CHECK(result.corrections > start.size() * kSteps / 10);
        CHECK(result.retries + result.stalled + result.coarse == 0);
        // As much as a step may leave its track by on a GPU: `enough`, and the rounding errors of f and g in float.
        CHECK(driftOf(flow, start, corrected.position) < 1e-5);
    }
}

TEST_CASE("GpuFlowN: points move for their part of the time, backward and not at all", "[gpu]") {
    const auto gpu = gpuOrSkipped();
    if (!gpu) return;
    const Flow flow = besideSphere(Side::inside);
    const GpuFlowN<3> onGpu(gpu, flow);
    for (const int steps : {40, 0}) {
        CAPTURE(steps);
        const auto options = [&](double time) {
            return GpuMoveOptions{.scheme = steps ? Scheme::rk4 : Scheme::dormandPrince,
                                  .time = time,
                                  .steps = steps,
                                  .accuracy = 1e-6,
                                  .firstStep = 0.02};
        };
        const auto start = positionsIn(flow, 300);
        GpuPointsN<3> half{
            .position = start, .track = {}, .pace = std::vector<float>(300, 0.5f), .converged = {}, .error = {}};
        GpuPointsN<3> whole{.position = start, .track = {}, .pace = {}, .converged = {}, .error = {}};
        onGpu.move(half, options(1));
        onGpu.move(whole, options(0.5));
        std::vector<double> apart, back;
        for (size_t k = 0; k < start.size(); ++k) apart.push_back(length(half.position[k] - whole.position[k]));
        CHECK(medianOf(apart) < 2e-6);
        onGpu.move(whole, options(-0.5));
        for (size_t k = 0; k < start.size(); ++k) back.push_back(length(whole.position[k] - start[k]));
        CHECK(medianOf(back) < 5e-6);
        GpuPointsN<3> still{
            .position = start, .track = {}, .pace = std::vector<float>(300, 0), .converged = {}, .error = {}};
        CHECK(onGpu.move(still, options(1)).substeps == 0);
        for (size_t k = 0; k < start.size(); ++k) CHECK(length(still.position[k] - start[k]) < 1e-6);
    }
    GpuPointsN<3> none;
    CHECK(onGpu.move(none, {.steps = 1}).substeps == 0);
    CHECK_THROWS_WITH(onGpu.move(none, {.steps = 0}), "a scheme without an error estimate needs a number of steps");
}

TEST_CASE("GpuFlowN: a monitor cancels", "[gpu]") {
    const auto gpu = gpuOrSkipped();
    if (!gpu) return;
    const Flow flow = besideSphere(Side::inside);
    const GpuFlowN<3> onGpu(gpu, flow);
    GpuPointsN<3> points;
    points.position = positionsIn(flow, 100);
    const Monitor cancelled{.report = {}, .cancelled = [] { return true; }};
    CHECK_THROWS_AS(onGpu.move(points, {.steps = 10}, cancelled), Interrupted);
    std::vector<Vec3f> velocities;
    CHECK_THROWS_AS(onGpu.velocities(points.position, velocities, cancelled), Interrupted);
}
