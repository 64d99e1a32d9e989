// SPDX-License-Identifier: Apache-2.0
#include "curlew/field/Algebra.h"
#include "curlew/field/NoiseField.h"
#include "curlew/field/Transforms.h"
#include "curlew/flow/Carried.h"
#include "curlew/flow/Flows.h"
#include "curlew/flow/Reshape.h"
#include "curlew/flow/Wind.h"
#include "support/ProbeCommand.h"

using namespace curlew;
using namespace curlew::test;

namespace {

ScalarField noise(uint64_t seed) { return noiseField<Psrd3>({.seed = seed}); }
ScalarFieldN<2> plane(uint64_t seed) { return noiseField<Psrd2>({.seed = seed}); }

const std::string kTwo = "-noise seed=1 -noise seed=2 ";
const std::string kThree = kTwo + "-noise seed=3 ";
const std::string kThreePlane = "-noise dimensions=2 seed=1 -noise dimensions=2 seed=2 -noise dimensions=2 seed=3 ";

} // namespace

TEST_CASE("flow actions: equal the flows of the C++ library", "[app][command]") {
    const Folder folder;
    requireFlow(folder, kTwo + "-dfvn", Flow(noise(1), noise(2)));
    requireFlow(folder, "-noise dimensions=2 seed=1 -dfvn", FlowN<2>({plane(1)}));
    requireFlow(folder, kTwo + "-noise dimensions=2 seed=3 -product -dfvn",
                Flow(noise(1), noise(2) * projected(plane(3), Matrix<2, 3>{})));
    requireFlow(folder,
                "-noise type=simplex dimensions=4 seed=1 -noise type=simplex dimensions=4 seed=2 -noise type=simplex "
                "dimensions=4 seed=3 -dfvn",
                FlowN<4>({noiseField<SimplexNoise<4>>({.seed = 1}), noiseField<SimplexNoise<4>>({.seed = 2}),
                          noiseField<SimplexNoise<4>>({.seed = 3})}));
    requireFlow(folder, kThree + "-curl", curlFlow(std::array{noise(1), noise(2), noise(3)}));
    requireFlow(folder, kThreePlane + "-curl", curlFlow(std::array{plane(1), plane(2), plane(3)}));
    // One noise three times, as in the tutorial: the second is evaluated at x + 100, the third at y + 100.
    const auto moved = [](const Vec3d& by) { return placed(noise(1), {.offset = -by}); };
    requireFlow(folder, "-noise seed=1 -curl shift=100",
                curlFlow(std::array{noise(1), moved({{100, 0, 0}}), moved({{0, 100, 0}})}));
    requireFlow(folder, "-noise seed=1 -torus -surface", Flow(noise(1), torusSdf(0.7, 0.3).distance));
    requireFlow(folder, "-uniform velocity=1,2,3", uniformFlow({{1, 2, 3}}));
    requireFlow(folder, "-vortex turns=0.5 core=0.2", vortexFlow(0.5, 0.2));
    requireFlow(folder, "-updraft speed=2 halfHeight=0.5", updraftFlow(2, 0.5));
    requireFlow(folder, kTwo + "-dfvn -uniform -superpose", Flow(noise(1), noise(2)) + uniformFlow({{0, 1, 0}}));
    requireFlow(folder, kTwo + "-dfvn uniformSpeed=1 speed=2", Flow(noise(1), noise(2)).normalized(2));
    requireFlow(folder, kTwo + "-dfvn -reshape maxSpeed=3 f=-0.5,0.5 softness=0.3",
                reshaped(Flow(noise(1), noise(2)), {.limit = 3, .f = {-0.5, 0.5}, .softness = 0.3}));
}

TEST_CASE("flow actions: sums become grids and move points without a wall", "[app][command]") {
    const Folder folder;
    const std::string curl = kThree + "-curl speed=1 ";
    folder.mustRun(curl + "-velocity dim=16 staggered=1 -write curl.vdb -check report=curl.json samples=1000 strict=1");
    CHECK(jsonOf(folder / "curl.json")["divergence_grid"].get<double>() < 1e-6);
    CHECK(jsonOf(folder / "curl.json")["divergence_free"] == true);
    const std::string advect = "-scatter count=100 -advect duration=0.1 steps=5 ";
    const Outcome whole = folder.mustRun(curl + advect + "-write whole.csv whole.json");
    CHECK_THAT(whole.err, Catch::ContainsSubstring("integrated as a whole"));
    CHECK(jsonOf(folder / "whole.json")["advect"]["splitting"] == "none");
    CHECK(jsonOf(folder / "whole.json")["advect"]["terms"] == 3);
    // If reprojection is requested, the flow is split into its terms.
    const Outcome split = folder.mustRun(curl + advect + "reproject=newton -write split.csv split.json");
    CHECK_THAT(split.err, Catch::ContainsSubstring("by splitting (strang)"));
    CHECK(jsonOf(folder / "split.json")["advect"]["splitting"] == "strang");
    CHECK(jsonOf(folder / "split.json")["advect"]["label_drift"].get<double>() <= 1.001e-8);
    CHECK(bytesOf(folder / "whole.csv") != bytesOf(folder / "split.csv"));
    folder.mustRun(curl + advect + "reproject=none -write plain.csv");
    CHECK(bytesOf(folder / "whole.csv") == bytesOf(folder / "plain.csv"));
    folder.mustFail(kThree + "-curl uniformSpeed=1 -scatter count=9 -advect splitting=strang",
                    {"-advect", "normalised"});
    folder.mustFail(curl + "-reshape maxSpeed=1", {"-reshape", "two potentials"});
    folder.mustFail(curl + "-velocity dim=8 potentials=1", {"-velocity", "potentials=1", "tracks"});
    // The potentials of a curl flow do not label tracks, so its slice shows the speed.
    folder.mustRun(curl + "-slice width=16 -write curl.png");
}

TEST_CASE("flow actions: a sum in a wall is followed term by term and terms that cross it are named",
          "[app][command]") {
    const Folder folder;
    const std::string bound = "-sphere " + kTwo + "-bound -dfvn speed=1 ",
                      wind = bound + "-wind side=inside -superpose ",
                      move = "-scatter count=300 -advect duration=2 steps=5 ";
    for (const std::string splitting : {"strang", "yoshida"}) {
        const Outcome tangent =
            folder.mustRun(wind + move + "splitting=" + splitting + " -check samples=10000 -write a.csv a.json");
        CHECK_THAT(tangent.err, !Catch::ContainsSubstring("points stop there") &&
                                    Catch::ContainsSubstring("by splitting (" + splitting));
        const auto report = jsonOf(folder / "a.json");
        CHECK(report["advect"]["outside"] == 0);
        CHECK(report["check"]["outside"] == 0);
        CHECK(report["check"]["wall_flux"].get<double>() < 1e-9);
        CHECK(report["advect"]["terms"] == 2);
        CHECK(report["advect"]["label_drift"].get<double>() <= 1.001e-8);
    }
    // If the sum is followed as a whole, points stay on their side as well.
    const Outcome whole = folder.mustRun(wind + move + "-write c.json");
    CHECK_THAT(whole.err,
               !Catch::ContainsSubstring("points stop there") && Catch::ContainsSubstring("integrated as a whole"));
    CHECK(jsonOf(folder / "c.json")["advect"]["outside"] == 0);

    const Outcome crossing = folder.mustRun(bound + "-uniform -superpose " + move + "-write b.csv b.json");
    CHECK_THAT(crossing.err,
               Catch::ContainsSubstring("the newer flow crosses the wall") && Catch::ContainsSubstring("-bound"));
    CHECK(jsonOf(folder / "b.json")["advect"]["outside"] == 0);
    CHECK(jsonOf(folder / "b.json")["advect"]["not_converged"].get<int>() > 0);
    const Outcome free = folder.mustRun(wind + move + "reproject=none");
    CHECK_THAT(free.err, Catch::ContainsSubstring("may cross the wall"));
    // In a sequence, the warning is printed once.
    const Outcome frames =
        folder.mustRun("-frames 1-3 " + bound + "-uniform -superpose -scatter count=20 -advect -write a.{F}.csv");
    const auto first = frames.err.find("crosses the wall");
    REQUIRE(first != std::string::npos);
    CHECK(frames.err.find("crosses the wall", first + 1) == std::string::npos);
}

TEST_CASE("flow actions: wind gives the library's wind", "[app][command]") {
    const Folder folder;
    const Sdf sphere = sphereSdf(0.5), box = boxSdf({{0.4, 1, 0.6}}, 0.05);
    const auto wall = [](const Sdf& sdf, double width, Side side = Side::outside) {
        return Wall{.sdf = sdf, .side = side, .width = width};
    };
    requireFlow(folder, "-sphere radius=0.5 -wind", windFlow(wall(sphere, 0.5), {}));
    requireFlow(folder, "-box size=0.4,1,0.6 rounding=0.05 -wind direction=0,0,2 speed=1.5 layer=0.2 across=0,1,0",
                windFlow(wall(box, 0.2), {}, {.direction = {{0, 0, 1}}, .speed = 1.5, .across = Vec3d{{0, 1, 0}}}));
    requireFlow(folder, "-noise seed=1 -sphere radius=0.5 -wind gusts=0.5 side=inside",
                windFlow(wall(sphere, 0.5, Side::inside), noise(1), {.gusts = 0.5}));
    folder.mustFail("-wind", {"-wind", "a shape", "none"});
    folder.mustFail("-plane -wind", {"-wind", "give layer="});
    folder.mustFail("-sphere -wind gusts=0.5", {"-wind", "a field", "none"});
    folder.mustFail("-sphere -wind direction=0,0,0", {"-wind", "direction"});
}

TEST_CASE("flow actions: a normalised flow is measured and not reported as divergence-free", "[app][command]") {
    const Folder folder;
    const std::string even = kTwo + "-dfvn uniformSpeed=1 speed=1.5 ";
    folder.mustRun(even + "-check report=even.json samples=1000 strict=1");
    const auto report = jsonOf(folder / "even.json");
    CHECK(report["divergence_free"] == false);
    CHECK(report["divergence_analytic"].get<double>() > 1e-3);
    CHECK(report["divergence_by_differences"].get<double>() > 1e-3);
    CHECK(report["rms_speed"].get<double>() == Approx(1.5));
    folder.mustFail(even + "-velocity dim=8 staggered=1", {"-velocity", "normalised", "collocated"});
    folder.mustFail(even + "-uniform -superpose", {"-superpose", "normalised"});
    folder.mustFail(even + "-reshape maxSpeed=1", {"-reshape", "normalised"});
    // Normalisation keeps the tracks.
    folder.mustRun(even + "-scatter count=200 -advect duration=0.2 steps=10 -check report=points.json samples=100");
    CHECK(jsonOf(folder / "points.json")["drift_f"].get<double>() < 1e-6);
    CHECK(jsonOf(folder / "points.json")["not_converged"] == 0);
}

TEST_CASE("check: verifies flows of every dimension", "[app][command]") {
    const Folder folder;
    const int dimensions = GENERATE(2, 4, 5, 7);
    CAPTURE(dimensions);
    std::string actions;
    for (int k = 1; k < dimensions; ++k)
        actions += fmt::format("-noise type=simplex dimensions={} seed={} ", dimensions, k);
    folder.mustRun(actions + "-dfvn speed=1 -check report=a.json samples=500 strict=1 -print");
    const auto report = jsonOf(folder / "a.json");
    CHECK(report["divergence_analytic"].get<double>() < 1e-9);
    // The error of the differences decreases with the square of the step: simplex noise of power 4 is C³.
    CHECK(report["divergence_by_differences"].get<double>() < 2e-3);
    CHECK(report["divergence_by_differences_order"].get<double>() == Approx(2).margin(0.3));
    CHECK(report["rms_speed"].get<double>() == Approx(1).epsilon(0.005)); // in 2D from other samples, in space
    if (dimensions > 3) {
        folder.mustFail(actions + "-dfvn -velocity dim=8", {"-velocity", "flow", "dimensions"});
        folder.mustFail(actions + "-dfvn box=-1,-1,-1,1,1,1", {"-dfvn", "box="});
    } else {
        folder.mustRun(actions +
                       "-dfvn -velocity voxel=0.1 -scatter count=50 -advect duration=0.1 steps=2 -write a.vdb");
    }
}

TEST_CASE("surface action: a flow on a surface keeps its distance from it", "[app][command]") {
    const Folder folder;
    folder.mustRun(
        "-noise seed=1 frequency=3 -torus -surface speed=1 extent=0.1 -scatter count=300 -advect duration=1 steps=20 "
        "-check report=a.json samples=500 strict=1");
    const auto report = jsonOf(folder / "a.json");
    CHECK(report["drift_g"].get<double>() < 1e-6); // g is the distance
    CHECK(report["divergence_analytic"].get<double>() < 1e-9);
    folder.mustRun("-sphere -scatter count=10 -write a.csv"); // a shape is still usable as a shape
}

TEST_CASE("check: a kink in a potential violates zero divergence", "[app][command]") {
    const Folder folder;
    const std::string kinked = "-noise seed=1 -noise seed=2 -min smoothing=0 -noise seed=3 -dfvn -check ";
    folder.mustFail(kinked + "strict=1", {"divergence_by_differences", "does not decrease", "kink"});
    CHECK_THAT(folder.mustRun(kinked).err, Catch::ContainsSubstring("min: smoothing=0 leaves a kink"));
    CHECK_THAT(folder.mustRun("-sphere -box -union smoothing=0 -slice width=8 -write edge.png").err,
               Catch::ContainsSubstring("union: smoothing=0 leaves a kink"));
    const std::string rounded = "-noise seed=1 -noise seed=2 -min smoothing=0.2 -noise seed=3 -dfvn -check ";
    CHECK_THAT(folder.mustRun(rounded + "samples=5000 strict=1").err, !Catch::ContainsSubstring("kink"));
}

TEST_CASE("surface action: a flow on a level set fades out within extent= without a jump", "[app][command]") {
    const Folder folder;
    // The narrow band of a voxelised mesh ends a few voxels outside it. Beyond it the spline is no distance.
    const std::string reach = GENERATE("0.02", "0.2");
    CAPTURE(reach);
    folder.mustRun(
        fmt::format("-read {}/scenes/spot.obj -mesh2ls dim=40 -noise frequency=3 -surface speed=1 extent={} "
                    "-check report=a.json samples=20000 strict=1 -scatter count=200 -advect duration=0.2 steps=10",
                    test::sourceDir(), reach));
    const auto report = jsonOf(folder / "a.json");
    CHECK(report["divergence_vanishes"] == true);
    CHECK(report["divergence_by_differences"].get<double>() < 0.01);
    CHECK(report["divergence_by_differences_order"].get<double>() >
          1.2); // the third derivatives of the spline jump at voxel boundaries
}

TEST_CASE("surface action: speed= is the speed on a level set, whatever the extent", "[app][command]") {
    const Folder folder;
    for (const char* extent : {"", "extent=0.3 "}) {
        folder.mustRun(fmt::format(
            "-sphere radius=0.5 -mesh box=-1,-1,-1,1,1,1 -mesh2ls dim=48 as=body -noise frequency=3 -surface speed=2 {}"
            "as=air -scatter on=surface domain=body count=2000 -advect flow=air duration=1e-6 steps=1 -write v.csv",
            extent));
        const Table table = tableOf(folder / "v.csv");
        const auto names = app::split(table.header, ',');
        double squares = 0;
        for (const auto& row : table.rows)
            for (size_t k = 0; k < names.size(); ++k)
                if (names[k] == "vx" || names[k] == "vy" || names[k] == "vz") squares += row[k] * row[k];
        CAPTURE(extent, table.header);
        CHECK(std::sqrt(squares / static_cast<double>(table.rows.size())) == Approx(2).epsilon(0.05));
    }
}

TEST_CASE("carry action: transports a noise along a flow", "[app][command]") {
    const Folder folder;
    const auto large = [](uint64_t seed) { return noiseField<SineNoise<3>>({.seed = seed}); };
    const ScalarField there = carried(noise(3), Flow(large(1), large(2)), {.time = 0.2, .steps = 3});
    requireField(folder,
                 "-noise type=sine seed=1 -noise type=sine seed=2 -dfvn -noise seed=3 -carry duration=0.2 steps=3",
                 there);
    // The flow remains, and with keep=1 also the noise.
    folder.mustRun(
        "-noise dimensions=2 type=sine -dfvn -noise dimensions=2 seed=3 -carry keep=1 -sum -dfvn -check samples=2000 "
        "strict=1");
    folder.mustFail("-noise -noise seed=1 -dfvn -noise dimensions=2 -carry",
                    {"-carry", "3-dimensional flow", "2-dimensional field"});
    folder.mustFail("-noise dimensions=2 -dfvn uniformSpeed=1 -noise dimensions=2 -carry", {"-carry", "normalised"});
    folder.mustFail("-noise -carry", {"-carry", "flow"});
}

TEST_CASE("spectrum action: reports and plots the spectrum of a velocity grid", "[app][command]") {
    const Folder folder;
    // One wave that tiles with the box, with 3 cycles over 2 world units.
    folder.mustRun(
        "-noise type=sine dimensions=2 waves=1 period=1 frequency=1.5 seed=2 -dfvn -velocity "
        "box=-1,-1,-1,0.99,0.99,0.99 voxel=0.0625 -spectrum window=hann plot=a.svg name=waves fit=1,8 "
        "-report a.json");
    const auto report = jsonOf(folder / "a.json")["waves"];
    CHECK(report["energy"].size() == report["wave_numbers"].size());
    CHECK(report["nyquist"].get<double>() == Approx(8));
    CHECK(report["peak"].get<double>() == Approx(1.5));
    double total = 0;
    for (const double e : report["energy"]) total += e * report["shell_width"].get<double>();
    CHECK(total == Approx(report["kinetic_energy"].get<double>()));
    CHECK(std::filesystem::file_size(folder / "a.svg") > 1000);
    const auto said = [&](const std::string& box) {
        return folder.mustRun("-noise -noise seed=1 -dfvn box=" + box + " -velocity dim=24 -spectrum").err;
    };
    const auto saysSmall = Catch::Matchers::ContainsSubstring("warning: the peak is at the lowest wave number");
    CHECK_THAT(said("0,0,0,4,4,4"), !saysSmall);
    CHECK_THAT(said("0,0,0,0.5,0.5,0.5"), saysSmall);
    const auto thin = folder.mustRun(
        "-noise -noise seed=1 -dfvn box=0,0,0,1,1,0.04 -velocity voxel=0.02 -spectrum plot=b.svg -report b.json");
    CHECK_THAT(thin.err, Catch::Matchers::ContainsSubstring("warning: no slope, because fewer than two shells"));
    CHECK(jsonOf(folder / "b.json")["spectrum"]["slope"].is_null());
    CHECK(jsonOf(folder / "b.json")["spectrum"]["kinetic_energy"].get<double>() > 0);
    CHECK(std::filesystem::file_size(folder / "b.svg") > 1000);
    folder.mustFail("-noise -noise seed=1 -dfvn -velocity dim=8 -spectrum fit=100,200", {"-spectrum", "two shells"});
    folder.mustFail("-uniform velocity=0,1,0 -velocity dim=16 box=-1,-1,-1,1,1,1 -spectrum",
                    {"-spectrum", "two shells"});
    folder.mustFail("-sphere -spectrum", {"-spectrum", "velocity"});
}

TEST_CASE("flow actions: unsuitable inputs are errors that say why", "[app][command]") {
    const Folder folder;
    folder.mustFail("-noise type=simplex dimensions=5 -dfvn", {"-dfvn", "n - 1 fields of n dimensions"});
    folder.mustFail("-noise -noise -noise type=simplex dimensions=4 -dfvn", {"-dfvn", "4 dimensions", "has 3"});
    folder.mustFail("-noise type=simplex dimensions=4 -noise -dfvn", {"-dfvn", "4 dimensions"});
    folder.mustFail(kTwo + "-curl", {"-curl", "x=", "shift="});
    folder.mustFail("-noise dimensions=2 -noise -noise -curl", {"-curl", "all have 2 or all have 3"});
    folder.mustFail("-noise type=simplex dimensions=4 -curl shift=1", {"-curl", "3 dimensions"});
    // The same noise twice: the flow would only move in the layer of the wall.
    folder.mustFail("-noise -noise -dfvn", {"-dfvn", "two different fields (seeds)"});
    folder.mustFail("-sphere -noise -noise -bound -dfvn", {"-dfvn", "the same noise", "fields (seeds)"});
    folder.mustFail("-sphere -surface", {"-surface", "a field", "none"});
    folder.mustFail("-noise -surface", {"-surface", "a shape", "none"});
    folder.mustFail(kTwo + "-dfvn -reshape", {"-reshape", "maxSpeed="});
    folder.mustFail(kTwo + "-dfvn -reshape f=1,0", {"-reshape", "f=1,0", "empty"});
    folder.mustFail(kTwo + "-dfvn -superpose", {"-superpose", "a flow", "only one"});
    folder.mustFail("-uniform velocity=0", {"-uniform"});
    folder.mustFail("-vortex core=0", {"-vortex", "core=0"});
    folder.mustFail("-updraft halfHeight=-1", {"-updraft", "halfHeight=-1"});
    folder.mustFail("-sphere -blend", {"-blend", "a field for noise=", "none"});
}

TEST_CASE("blend action: DeWolf's product keeps a flow within its wall", "[app][command]") {
    const Folder folder;
    folder.mustRun(
        "-sphere -noise seed=1 frequency=2 -noise seed=2 frequency=2 -blend layer=0.3 -dfvn speed=1 "
        "-scatter count=500 -advect duration=1 steps=20 -check report=a.json samples=1000 strict=1");
    CHECK(jsonOf(folder / "a.json")["outside"] == 0);
    CHECK(jsonOf(folder / "a.json")["wall_flux"].get<double>() < 1e-9);
}
