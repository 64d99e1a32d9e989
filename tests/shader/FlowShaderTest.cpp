// SPDX-License-Identifier: Apache-2.0
#include "curlew/base/Error.h"
#include "curlew/field/Algebra.h"
#include "curlew/field/NoiseField.h"
#include "curlew/field/Shapes.h"
#include "curlew/field/Transforms.h"
#include "curlew/flow/Carried.h"
#include "curlew/flow/Flows.h"
#include "curlew/shader/FlowShader.h"
#include "support/Flows.h"
#include "support/Points.h"
#include "support/VulkanRunner.h"

#include <fmt/format.h>

using namespace curlew;
using namespace curlew::test;

namespace {

constexpr size_t kCount = 5000;

/// Divergence-free noise around or in a sphere.
Flow inSphere(Side side, double frequency = 1.5) {
    const WallN<3> wall{.sdf = sphereSdf(1), .side = side, .width = 0.3};
    const auto potential = [&](uint64_t seed) {
        return bounded(noiseField<Psrd3>({.seed = seed}, {.frequency = frequency, .octaves = 2}), wall);
    };
    return withSpeed(Flow(potential(1), potential(2), Domain::of(wall, 0.5)), 1);
}

/// Random positions in the domain, relative to the origin of the shader: the centre of the box.
template <int N>
std::vector<float> positionsIn(const FlowN<N>& flow, size_t count) {
    std::vector<float> positions;
    for (size_t k = 0; positions.size() < count * N; ++k) {
        const Vec<double, N> p = randomPoint(flow.domain().box, 5, k);
        if (const auto& wall = flow.domain().wall;
            wall && beyondWall(wall->side, wall->sdf.distance.template at<0>(p).value) > -0.01)
            continue;
        for (int i = 0; i < N; ++i) {
            const auto origin = static_cast<double>(static_cast<float>(flow.domain().box.center()[i]));
            positions.push_back(static_cast<float>(p[i] - origin));
        }
    }
    return positions;
}

template <int N>
Vec<double, N> placeOf(const FlowN<N>& flow, const std::vector<float>& positions, size_t k) {
    Vec<double, N> p;
    for (size_t i = 0; i < size_t{N}; ++i)
        p.c[i] = static_cast<double>(positions[k * N + i]) +
                 static_cast<double>(static_cast<float>(flow.domain().box.center().c[i]));
    return p;
}

template <int N>
std::string vectorAt(const std::string& array) {
    std::string text = fmt::format("vec{}(", N);
    for (int i = 0; i < N; ++i) text += fmt::format("{}{}[i * {}u + {}u]", i ? ", " : "", array, N, i);
    return text + ")";
}

/// Checks potentials and velocities at random positions against those in double.
template <int N>
void checkFlow(const std::string& name, const FlowN<N>& flow, double ofValue = 2e-6, double ofVelocity = 5e-5,
               Dialect dialect = Dialect::glsl) {
    CAPTURE(name);
    const ShaderText shader = flowShader(flow, {.dialect = dialect, .tables = ShaderTables::data});
    const size_t outputs = flow.hasTracks() ? 2 * N - 1 : N;
    ShaderRun run{shader.text,
                  fmt::format("    vec{} p = {};\n", N, vectorAt<N>("inputs")),
                  shader.buffers,
                  positionsIn(flow, kCount),
                  kCount,
                  outputs,
                  dialect == Dialect::hlsl};
    run.body += fmt::format("    vec{} v = flowVelocity(p);\n", N);
    for (int i = 0; i < N; ++i) run.body += fmt::format("    outputs[i * {}u + {}u] = v[{}];\n", outputs, i, i);
    if (flow.hasTracks()) {
        run.body += fmt::format("    {} f = flowPotentials(p);\n", N == 2 ? "float" : "vec2");
        for (int k = 0; k < N - 1; ++k)
            run.body += fmt::format("    outputs[i * {}u + {}u] = f{};\n", outputs, N + k,
                                    N == 2 ? "" : fmt::format("[{}]", k));
    }
    const std::vector<float> found = runShader(run);
    double velocity = 0, velocity2 = 0;
    std::array<double, size_t{N - 1}> value{}, value2{};
    for (size_t k = 0; k < kCount; ++k) {
        const auto expected = flow.at(placeOf(flow, run.inputs, k));
        for (size_t i = 0; i < size_t{N}; ++i) {
            velocity =
                std::max(velocity, std::abs(static_cast<double>(found[k * outputs + i]) - expected.velocity.c[i]));
            velocity2 += expected.velocity.c[i] * expected.velocity.c[i];
        }
        for (size_t q = 0; q < value.size() && flow.hasTracks(); ++q) {
            const double f = expected.potentials[q];
            value[q] = std::max(value[q], std::abs(static_cast<double>(found[k * outputs + N + q]) - f));
            value2[q] += f * f;
        }
    }
    CHECK(velocity / std::sqrt(velocity2 / kCount) < ofVelocity);
    for (size_t q = 0; q < value.size() && flow.hasTracks(); ++q)
        CHECK(value[q] / std::sqrt(value2[q] / kCount) < ofValue);
}

} // namespace

TEST_CASE("flowShader: a shader computes velocities and potentials", "[shader]") {
    if (skippedWithoutVulkan()) return;
    checkFlow("outside a sphere", inSphere(Side::outside));
    checkFlow("inside a sphere", inSphere(Side::inside));
    const ScalarField noise = noiseField<Psrd3>({.seed = 4}, {.frequency = 1.5});
    // Near stagnation points, where the direction turns quickly, rounding errors turn it as well.
    checkFlow("uniform speed", Flow(noise, noiseField<SimplexNoise<3>>()).normalized(2), 2e-6, 1e-3);
    checkFlow("on level sets", Flow(noise, noiseField<SimplexNoise<3>>()).onLevelSets());
    checkFlow("lifted", Flow(lifted<3>(noiseField<SineNoise<4>>(), {noise}), noise), 6e-6);
    checkFlow("plane", FlowN<2>({noiseField<Psrd2>({}, {.frequency = 2, .octaves = 3})}));
    checkFlow("curl", curlFlow(std::array{noise, noiseField<Psrd3>({.seed = 5}), noiseField<Psrd3>({.seed = 6})}, {}));
    checkFlow("vortex", vortexFlow(1, 0.3, {}));
    checkFlow("updraft", updraftFlow(1, 0.5, {}));
    const Flow carrier(noiseField<SineNoise<3>>({.seed = 1}), noiseField<SineNoise<3>>({.seed = 2}));
    checkFlow("carried", Flow(carried(noise, carrier, {.time = 0.02, .steps = 1}), rampField({{0, 1, 0}})));
    checkFlow("gradient", gradientFlow(noise, Domain{}));
}

TEST_CASE("flowShader: HLSL computes velocities and potentials", "[shader]") {
    if (skippedWithoutVulkan()) return;
    const auto check = [](const std::string& name, const auto& flow) {
        checkFlow(name, flow, 2e-6, 5e-5, Dialect::hlsl);
    };
    check("outside a sphere", inSphere(Side::outside));
    check("plane", FlowN<2>({noiseField<Psrd2>({}, {.frequency = 2, .octaves = 3})}));
    const ScalarField noise = noiseField<Psrd3>({.seed = 4}, {.frequency = 1.5});
    check("curl", curlFlow(std::array{noise, noiseField<Psrd3>({.seed = 5}), noiseField<Psrd3>({.seed = 6})}, {}));
}

TEST_CASE("flowShader: particles stay on their tracks and out of the wall", "[shader]") {
    if (skippedWithoutVulkan()) return;
    constexpr size_t kParticles = 2000;
    using Case = std::pair<Side, Dialect>;
    for (const auto& [side, dialect] : {Case{Side::inside, Dialect::glsl},
                                        {Side::outside, Dialect::glsl},
                                        {Side::both, Dialect::glsl},
                                        {Side::outside, Dialect::hlsl}}) {
        CAPTURE(static_cast<int>(side), static_cast<int>(dialect));
        const Flow flow = inSphere(side);
        const ShaderText shader = flowShader(flow, {.dialect = dialect, .tables = ShaderTables::data});
        ShaderRun run{shader.text, "", shader.buffers,          positionsIn(flow, kParticles),
                      kParticles,  3,  dialect == Dialect::hlsl};
        // 100 steps of 0.02 s at an rms speed of 1 in lattice cells of 0.33.
        run.body = "    vec3 p = " + vectorAt<3>("inputs") +
                   ";\n    vec2 track = flowPotentials(p);\n"
                   "    for (int k = 0; k < 100; ++k) p = flowAdvance(p, track, 0.02);\n"
                   "    for (uint a = 0u; a < 3u; ++a) outputs[i * 3u + a] = p[a];\n";
        const std::vector<float> found = runShader(run);
        const auto rms = rmsOf(flow);
        double drift = 0, moved = 0;
        size_t beyond = 0, otherSide = 0;
        for (size_t k = 0; k < kParticles; ++k) {
            const Vec3d from = placeOf(flow, run.inputs, k), to = placeOf(flow, found, k);
            const auto before = flow.at(from), after = flow.at(to);
            for (size_t q = 0; q < 2; ++q)
                drift = std::max(drift, std::abs(after.potentials[q] - before.potentials[q]) / rms.potentials[q]);
            moved += length(to - from) / kParticles;
            const double d0 = flow.domain().wall->sdf.distance.at<0>(from).value;
            const double d1 = flow.domain().wall->sdf.distance.at<0>(to).value;
            beyond += beyondWall(side, d1) >= 0;
            otherSide += (d0 < 0) != (d1 < 0);
        }
        // The tolerance, the rounding of the track and of the position, and the shader's own error.
        CHECK(drift < 4e-6 + 4e-6);
        CHECK(moved > 0.2);
        CHECK(beyond == 0);
        CHECK(otherSide == 0);
    }
}

TEST_CASE("flowShader: flowReproject moves points back onto their tracks", "[shader]") {
    if (skippedWithoutVulkan()) return;
    constexpr size_t kPoints = 10000;
    const Flow flow = inSphere(Side::outside);
    const ShaderText shader = flowShader(flow, {.tables = ShaderTables::data, .corrections = 3});
    ShaderRun run{shader.text, "", shader.buffers, positionsIn(flow, kPoints), kPoints, 2};
    run.body =
        "    vec3 p = " + vectorAt<3>("inputs") +
        ";\n    vec2 track = flowPotentials(p);\n"
        "    vec2 off = abs(flowPotentials(flowReproject(p + vec3(0.003, -0.002, 0.001), track, 0.01)) - track);\n"
        "    outputs[i * 2u] = off.x;\n    outputs[i * 2u + 1u] = off.y;\n";
    const std::vector<float> found = runShader(run);
    const auto rms = rmsOf(flow);
    size_t missed = 0;
    for (size_t k = 0; k < kPoints; ++k)
        missed += static_cast<double>(found[2 * k]) > 4e-6 * rms.potentials[0] ||
                  static_cast<double>(found[2 * k + 1]) > 4e-6 * rms.potentials[1];
    CHECK(missed < kPoints / 100); // near stagnation points, where the tracks are ill-defined
}

TEST_CASE("flowShader: the header says what the functions are", "[shader]") {
    const ShaderText shader = flowShader(inSphere(Side::outside), {.origin = Vec3d{{1, 2, 3}}});
    CHECK(shader.text.find("relative to (1, 2, 3)") != std::string::npos);
    CHECK(shader.buffers.empty());
    for (const char* name : {"flowVelocity(vec3 p)", "flowPotentials(vec3 p)", "flowDistance(vec3 p)",
                             "flowReproject(vec3 p, vec2 track, float limit)", "flowStep(vec3 p, vec2 track, float dt)",
                             "flowAdvance(vec3 p, vec2 track, float dt)"})
        CHECK(shader.text.find(name) != std::string::npos);
    CHECK(shader.text.size() < 60000);
}

TEST_CASE("flowShader: HLSL and WGSL have types and declarations of their own", "[shader]") {
    const auto text = [](Dialect dialect, ShaderTables tables) {
        return flowShader(inSphere(Side::outside), {.dialect = dialect, .tables = tables}).text;
    };
    const std::string hlsl = text(Dialect::hlsl, ShaderTables::text), wgsl = text(Dialect::wgsl, ShaderTables::text);
    for (const char* part :
         {"float3 flowAdvance(float3 p, float2 track, float dt) {", "for (int k = 0; k < 64 &&", "static const float",
          "uniform uint flowZero;", "float4 next = flowTry(q, track, dt * part);"})
        CHECK_THAT(hlsl, Catch::ContainsSubstring(part));
    for (const char* part : {"fn flowAdvance(p: vec3f, track: vec2f, dt: f32) -> vec3f {",
                             "for (var k: i32 = 0; k < 64 &&", "; k++) {", "const flowTable0 = array<",
                             "var<uniform> flowZero: u32;", "var next: vec4f = flowTry(q, track, dt * part);"})
        CHECK_THAT(wgsl, Catch::ContainsSubstring(part));
    for (const std::string& written : {hlsl, wgsl, text(Dialect::glsl, ShaderTables::text)}) {
        // A table is read in one place, its function.
        const size_t first = written.find("flowTable0[row]");
        CHECK(first != std::string::npos);
        CHECK(written.find("flowTable0[t") == std::string::npos);
        CHECK_THAT(written, Catch::ContainsSubstring("flowTable0At(t"));
    }
    for (const char* word : {" vec3 ", "roundEven", "BitsTo"}) {
        CHECK_THAT(hlsl, !Catch::ContainsSubstring(word));
        CHECK_THAT(wgsl, !Catch::ContainsSubstring(word));
    }
    CHECK_THAT(wgsl, !Catch::ContainsSubstring(" ? "));
    CHECK_THAT(text(Dialect::hlsl, ShaderTables::data),
               Catch::ContainsSubstring("StructuredBuffer<float4> flowData0;"));
    CHECK_THAT(text(Dialect::wgsl, ShaderTables::data),
               Catch::ContainsSubstring("@binding(0) var<storage, read> flowData0: array<vec4f>;") &&
                   Catch::ContainsSubstring("@binding(1) var<uniform> flowZero: u32;"));
}

TEST_CASE("flowShader: the parts of a step are functions of their own", "[shader]") {
    const ShaderText shader = flowShader(inSphere(Side::outside), {.dialect = Dialect::glslEs, .parts = true});
    for (const char* name :
         {"FlowReals11 flowHere(vec3 p)", "vec4 flowWall(vec3 p)", "FlowReals15 flowHereAndWall(vec3 p)",
          "vec3 flowCorrected(vec3 p, vec2 off, vec3 gradient0, vec3 gradient1, float limit)",
          "float flowAccepts(vec3 p, vec3 q, vec2 off, vec4 before, vec3 between, vec4 after)"})
        CHECK(shader.text.find(name) != std::string::npos);
    CHECK(shader.text.find("flowStep") == std::string::npos);
}

TEST_CASE("flowShader: what cannot be written is an error", "[shader]") {
    CHECK_THROWS_WITH(flowShader(flowOf<SineNoise<4>>({})),
                      "a flow with 4 dimensions cannot be written as a shader; use -lift");
    CHECK_THROWS_AS(flowShader(inSphere(Side::inside), {.corrections = 0}), ValueError);
    CHECK_THROWS_AS(flowShader(inSphere(Side::inside), {.tolerance = 0}), ValueError);
}
