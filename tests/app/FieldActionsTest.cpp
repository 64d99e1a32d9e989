// SPDX-License-Identifier: Apache-2.0
#include "curlew/field/Algebra.h"
#include "curlew/field/NoiseField.h"
#include "curlew/field/Shapes.h"
#include "curlew/field/Transforms.h"
#include "curlew/flow/Flow.h"
#include "support/ProbeCommand.h"

using namespace curlew;
using namespace curlew::test;

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
