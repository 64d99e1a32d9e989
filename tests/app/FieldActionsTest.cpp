// SPDX-License-Identifier: Apache-2.0
#include "curlew/field/Algebra.h"
#include "curlew/field/NoiseField.h"
#include "curlew/field/Shapes.h"
#include "curlew/field/Transforms.h"
#include "curlew/flow/Flow.h"
#include "support/ProbeCommand.h"

using namespace curlew;
using namespace curlew::test;
using Catch::Matchers::ContainsSubstring;

namespace {

const std::string kTwo = "-noise frequency=1.5 -noise seed=1 ";
const ScalarField kF = noiseField<Psrd3>({}, {.frequency = 1.5}), kG = noiseField<Psrd3>({.seed = 1});

} // namespace

TEST_CASE("field actions: algebra gives the library's fields with the operands in order of age", "[app][command]") {
    const Folder folder;
    requireField(folder, kTwo + "-sum", kF + kG);
    requireField(folder, kTwo + "-subtract", kF - kG);
    requireField(folder, kTwo + "-product", kF * kG);
    requireField(folder, kTwo + "-constant value=3 -sum -quotient", kF / (kG + constantField(3)));
    requireField(folder, kTwo + "-min smoothing=0.3", smoothMin(kF, kG, 0.3));
    requireField(folder, kTwo + "-max smoothing=0", smoothMax(kF, kG, 0));
    requireField(folder, kTwo + "-displace amount=0.05", displaced(kF, kG, 0.05));
    requireField(folder, "-sphere radius=0.5 -clip limit=0.4", clipped(sphereSdf(0.5).distance, 0.4));
    requireField(folder, kTwo + "-sum keep=1 -product", kG * (kF + kG));
    requireField(folder, "-ramp gradient=1,2 -noise dimensions=2 -sum",
                 rampField(Vec<double, 2>{{1, 2}}) + noiseField<Psrd2>());
    requireField(folder, "-ramp gradient=1,2,3,4,5 value=6", rampField(Vec<double, 5>{{1, 2, 3, 4, 5}}, 6));
    requireField(folder, "-constant value=2 dimensions=6", constantField<6>(2));
    // The sum of a field in 2D and one in 3D is in 3D.
    requireField(folder, "-noise dimensions=2 -noise seed=1 -sum", projected(noiseField<Psrd2>(), Matrix<2, 3>{}) + kG);
}

TEST_CASE("field actions: lift and height restrict fields to graphs and make terrains", "[app][command]") {
    const Folder folder;
    const auto plane = noiseField<Psrd2>({}, {.amplitude = 0.4});
    requireField(folder, "-noise dimensions=2 amplitude=0.4 -noise type=simplex -lift",
                 lifted<2>(noiseField<SimplexNoise<3>>(), {plane}));
    requireField(folder, "-noise -noise seed=1 -noise type=simplex dimensions=5 -lift functions=2",
                 lifted<3>(noiseField<SimplexNoise<5>>(), {noiseField<Psrd3>(), kG}));
    requireField(folder, "-noise dimensions=2 amplitude=0.4 -height", heightField<3>(plane));
    requireField(folder, "-noise type=value dimensions=1 -height", heightField<2>(noiseField<ValueNoise<1>>()));
    requireField(
        folder, "-noise dimensions=2 -transform translate=1,2 rotate=0,0,20 scale=2,3",
        placed(noiseField<Psrd2>(), PlacementN<2>{.offset = {{1, 2}}, .rotate = {{0, 0, 20}}, .scale = {{2, 3}}}));
}

TEST_CASE("field actions: union and intersection and difference combine shapes", "[app][command]") {
    const Folder folder;
    const Sdf ball = sphereSdf(0.8), box = boxSdf({{1, 1, 1}}, 0.2);
    const std::string shapes = "-sphere radius=0.8 -box size=1 ";
    requireField(folder, shapes + "-union", unite(ball, box, 0.1).distance);
    requireField(folder, shapes + "-intersection smoothing=0.2", intersect(ball, box, 0.2).distance);
    requireField(folder, shapes + "-difference smoothing=0", subtract(ball, box, 0).distance);
    // The result is a shape, so it can be a wall.
    folder.mustRun(shapes +
                   "-difference -noise seed=1 -noise seed=2 -bound layer=0.05 -dfvn speed=1 -scatter count=300 "
                   "-advect duration=0.3 steps=3 -check strict=1 samples=500");
}

TEST_CASE("formula: coordinates, fields by name, constants and the time", "[app][command]") {
    const Folder folder;
    const auto noise = noiseField<Psrd3>();
    const std::string actions = "-noise as=swirl -formula ";
    requireField(folder, actions + "'2*swirl + (3*x - y/2 + 1)'", 2.0 * noise + rampField({{3, -0.5, 0}}, 1));
    requireField(folder, "-set k=3 -noise as=swirl -formula 'k*swirl - T'", 3.0 * noise);
    requireField(folder, "-noise -noise seed=1 as=other -formula 'other' fields=noise", noise);
    requireField(folder, "-noise dimensions=2 as=flat -formula 'flat + z'",
                 projected(noiseField<Psrd2>(), Matrix<2, 3>{}) + rampField({{0, 0, 1}}));
    requireField(folder, "-formula '-x + 1'", rampField({{-1, 0, 0}}, 1));
    requireField(folder, "-formula dimensions=2 'x*y'", rampField<2>({{1, 0}}) * rampField<2>({{0, 1}}));
    folder.mustRun("-formula 'x + w' -constant dimensions=4 -sum"); // 4 dimensions
    // The graph, written and read back, makes the same file.
    folder.mustRun(actions + "'swirl * sin(3*z)' -slice width=16 -write a.exr graph.json");
    folder.mustRun("-config graph.json");
    folder.mustRun(actions + "'swirl * sin(3*z)' -print graph=1");
    CHECK_THAT(folder.mustRun("-formula 'abs(x) + y' -slice width=8 -write a.png").err,
               ContainsSubstring("abs(x) may have a kink"));
    // Frames: the field changes with time.
    folder.mustRun("-frames 1-2 -formula 'sin(x + 10*T)' dimensions=2 -slice width=8 -write 's.$F4.exr'");
    CHECK(bytesOf(folder / "s.0001.exr") != bytesOf(folder / "s.0002.exr"));
}

TEST_CASE("formula: errors name the column or the nearest name", "[app][command]") {
    const Folder folder;
    folder.mustFail("-formula 'sni(x)'", {"-formula", "column 1", "'sni'", "did you mean 'sin'"});
    folder.mustFail("-formula 'x + '", {"-formula", "column 5", "missing before the end"});
    folder.mustFail("-noise as=swirl -formula '2*swrl'", {"-formula", "swrl", "swirl"});
    folder.mustFail("-formula 'w + z' dimensions=3", {"-formula", "no coordinate 'w' in 3 dimensions"});
    folder.mustFail("-noise as=a -formula '1/a'", {"-formula", "column 2", "may be zero"});
    folder.mustFail("-noise type=simplex dimensions=4 as=a -noise as=b -formula 'a + b'",
                    {"-formula", "a field of 3 dimensions in a formula of 4"});
    folder.mustFail("-noise as=a -formula 'a' dimensions=2", {"-formula", "a field of 3 dimensions in a formula of 2"});
    folder.mustFail("-noise as=a -formula '1' fields=a", {"-formula", "names 0 fields", "1 are linked"});
    folder.mustFail("-formula", {"-formula", "FORMULA"});
    folder.mustFail("-set unused=1 -formula 'x'", {"unused"});
}

TEST_CASE("field actions: unsuitable fields are refused", "[app][command]") {
    const Folder folder;
    folder.mustFail("-noise type=simplex dimensions=4 -noise -sum", {"-sum", "4 and 3 dimensions"});
    folder.mustFail("-noise -quotient", {"-quotient", "a field", "only one"});
    folder.mustFail(kTwo + "-quotient", {"-quotient", "may be zero", "constant"});
    folder.mustFail(kTwo + "-min smoothing=-1", {"-min", "smoothing=-1"});
    folder.mustFail(kTwo + "-displace keep=1 -displace", {"-displace", "third derivatives"});
    folder.mustFail("-noise -lift", {"-lift", "graph=", "only one"});
    folder.mustFail("-noise -noise -lift", {"-lift", "function of the graph needs 2", "has 3"});
    folder.mustFail("-noise -noise type=simplex dimensions=4 -lift functions=2", {"-lift", "graph=", "2 objects"});
    folder.mustFail("-noise type=value dimensions=1 -noise type=value dimensions=1 -lift", {"-lift"});
    folder.mustFail("-noise type=simplex dimensions=7 -height", {"-height", "at most 6 dimensions"});
    folder.mustFail("-clip", {"-clip", "a field", "none"});
    folder.mustFail("-sphere -noise -union", {"-union", "a shape", "only one"});
    folder.mustFail("-sphere -transform scale=0", {"-transform", "zero"});
    folder.mustFail("-noise type=simplex dimensions=4 -slice width=8", {"-slice", "4 dimensions", "-lift"});
    folder.mustFail("-noise type=simplex dimensions=4 -sphere -bound field=1", {"-bound", "4 dimensions"});
}

TEST_CASE("check: reports the range of a field in any dimension", "[app][command]") {
    const Folder folder;
    folder.mustRun("-ramp gradient=1,2 -check report=a.json samples=5000");
    const auto ramp = jsonOf(folder / "a.json");
    // Over the square [-1, 1]²: values between -3 and 3, a mean square of (1 + 4) / 3, a gradient of √5.
    CHECK(ramp["field_min"].get<double>() == Approx(-3).margin(0.1));
    CHECK(ramp["field_max"].get<double>() == Approx(3).margin(0.1));
    CHECK(ramp["field_rms"].get<double>() == Approx(std::sqrt(5.0 / 3)).epsilon(0.03));
    CHECK(ramp["field_rms_gradient"].get<double>() == Approx(std::sqrt(5.0)));
    folder.mustRun("-constant dimensions=6 value=2 -check report=b.json samples=100");
    CHECK(jsonOf(folder / "b.json")["field_rms"] == 2);
}
