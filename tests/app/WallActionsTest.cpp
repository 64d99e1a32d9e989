// SPDX-License-Identifier: Apache-2.0
#include "curlew/field/Algebra.h"
#include "curlew/field/NoiseField.h"
#include "curlew/flow/Flows.h"
#include "support/ProbeCommand.h"

using namespace curlew;
using namespace curlew::test;

namespace {

ScalarField noise(uint64_t seed, double frequency = 2) {
    return noiseField<Psrd3>({.seed = seed}, {.frequency = frequency});
}
const std::string kTwo = "-noise frequency=2 seed=1 -noise frequency=2 seed=2 ";

Wall ball(double width, Side side = Side::inside) { return {.sdf = sphereSdf(1), .side = side, .width = width}; }

} // namespace

TEST_CASE("bound action: takes the layer width from the noise and reports it once", "[app][command]") {
    const Folder folder;
    requireField(folder, "-sphere -noise frequency=2 seed=1 -bound", bounded(noise(1), ball(0.15)));
    requireField(folder, "-sphere -noise frequency=2 seed=1 -bound layer=0.2 side=outside separate=1 amplitude=0.1",
                 bounded(noise(1), ball(0.2, Side::outside), {.separate = true, .amplitude = 0.1}));
    requireField(folder, "-sphere -noise frequency=2 seed=1 -bound variation=0.5",
                 bounded(noise(1), ball(0.15), {.variation = 0.5}));
    // The wavelength of a sum is that of its lowest-frequency noise.
    requireField(folder, "-sphere -noise frequency=2 seed=1 -noise frequency=5 -sum -bound",
                 bounded(noise(1) + noise(0, 5), ball(0.15)));
    const Outcome told = folder.mustRun(
        "-sphere -frames 1-3 -noise frequency=2 'alpha={T}' -noise frequency=2 seed=1 "
        "'alpha={T}' -bound -dfvn -slice width=8 -write 'a.$F.png'");
    CHECK_THAT(told.err, Catch::ContainsSubstring("bound: layer width 0.15, 0.3 wavelengths of the noise (0.5)"));
    CHECK(told.err.find("bound: layer") == told.err.rfind("bound: layer"));
    const Outcome measured = folder.mustRun("-sphere -ramp gradient=0,2,0 -bound layer=0.1 -check samples=100");
    CHECK_THAT(measured.err, Catch::ContainsSubstring("measured"));
}

TEST_CASE("bound action: a noise too coarse for its object gets a narrower layer and a warning", "[app][command]") {
    const Folder folder;
    const Outcome small = folder.mustRun("-sphere radius=0.01 -noise -noise seed=1 -bound -dfvn -check samples=500");
    CHECK_THAT(small.err, Catch::ContainsSubstring("warning: the noise's wavelength, 1, is too long for this object") &&
                              Catch::ContainsSubstring("at most 0.0167"));
    const Outcome thin =
        folder.mustRun("-capsule radius=0.1 length=4 " + kTwo + "-bound layer=0.2 -dfvn -check samples=500");
    CHECK_THAT(thin.err,
               Catch::ContainsSubstring("warning: the layer, 0.2 wide, overlaps itself in 100 % of the inside"));
    const Outcome fits = folder.mustRun("-sphere " + kTwo + "-bound -dfvn -check samples=500");
    CHECK_THAT(fits.err, !Catch::ContainsSubstring("warning"));
}

TEST_CASE("bound action: layers much wider than the voxels and the object", "[app][command]") {
    const Folder folder;
    store(folder / "mesh.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n");
    // 240 voxels of distance, and then an object of a thousandth of the noise's wavelength.
    folder.mustRun(
        "-read mesh.obj -mesh2ls dim=100 -noise -noise seed=1 -bound layer=2.4 side=outside -dfvn padding=2.4 "
        "-check samples=300 report=wide.json");
    const auto wide = jsonOf(folder / "wide.json");
    CHECK(wide["wall_flux"].get<double>() < 1e-9);
    CHECK(wide["divergence_by_differences_order"].get<double>() > 1.2);
    CHECK(wide["peak_memory_bytes"].get<double>() < 1e9);
    const Outcome tiny = folder.mustRun(
        "-read mesh.obj -move scale=0.001 -mesh2ls dim=64 -noise -noise seed=1 -bound "
        "side=outside -dfvn -check samples=300");
    CHECK_THAT(tiny.err, Catch::ContainsSubstring("too long for this object"));
}

TEST_CASE("lengths: a percentage is relative to the object that the action takes", "[app][command]") {
    const Folder folder;
    const double diagonal = 2 * std::sqrt(3.0); // of the sphere's box
    requireField(folder, "-sphere -noise frequency=2 seed=1 -bound layer=5%", bounded(noise(1), ball(0.05 * diagonal)));
    requireField(folder, "-sphere -noise frequency=2 seed=1 -bound layer={10/2}%",
                 bounded(noise(1), ball(0.05 * diagonal)));
    folder.mustRun("-sphere " + kTwo + "-bound layer=4% -dfvn -velocity voxel=2% -check report=grid.json samples=100");
    folder.mustFail("-sphere radius=5%", {"-sphere", "radius=5%", "takes no object", "world units"});
    folder.mustFail("-noise -noise seed=1 -curl shift=5%", {"-curl", "shift=5%", "world units"});
    folder.mustFail("-plane -noise -bound layer=5% -check", {"-bound", "finite size"});
    folder.mustFail("-sphere -noise -bound layer=-5% -check", {"-bound", "layer=-5%", "above 0"});
    folder.mustFail("-sphere -noise -bound layer=5%% -check", {"-bound", "layer=5%%", "5%"});
}

TEST_CASE("bound action: a shape that is the wall is not taken as a potential", "[app][command]") {
    const Folder folder;
    const auto velocityOf = [&](const std::string& actions) {
        return probed<3>(folder, actions + " -dfvn speed=1", randomPoints(cube<3>(0.5), 20, 1));
    };
    const std::string first = "-sphere " + kTwo + "-bound";
    const auto expected = velocityOf(first);
    CHECK(velocityOf(kTwo + "-sphere -bound") == expected);
    CHECK(velocityOf("-noise frequency=2 seed=1 -sphere -noise frequency=2 seed=2 -bound") == expected);
    folder.mustFail(kTwo + "-sphere -bound keep=1 -dfvn", {"the same noise"}); // not f=sphere
    // If nothing else is left, it is taken, in its place: a flow on the offset surfaces of the ball.
    CHECK(velocityOf("-sphere -noise frequency=2 seed=2 -bound") != expected);
    CHECK(velocityOf("-noise seed=9 -sphere radius=2 " + kTwo + "-bound -dfvn") ==
          velocityOf("-noise seed=9 -sphere radius=2"));
    CHECK_THAT(folder.mustRun("-sphere -noise -bound -print").out, Catch::ContainsSubstring("sphere"));
    // A shape that is no wall is a field like others.
    CHECK(velocityOf("-noise seed=3 -sphere -noise frequency=2 seed=2") ==
          velocityOf("-sphere -noise frequency=2 seed=2"));
}

TEST_CASE("bound action: works in 2D", "[app][command]") {
    const Folder folder;
    const WallN<2> disc{.sdf = sphereSdf<2>(1), .width = 0.15};
    const auto flat = noiseField<Psrd2>({.seed = 1}, {.frequency = 2});
    requireField(folder, "-sphere dimensions=2 -noise dimensions=2 frequency=2 seed=1 -bound", bounded(flat, disc));
    requireFlow(folder, "-sphere dimensions=2 -noise dimensions=2 frequency=2 seed=1 -bound -dfvn",
                FlowN<2>({bounded(flat, disc)}));
    requireField(folder, "-box dimensions=2 size=2,1,1 rounding=0.3", boxSdf<2>({{2, 1}}, 0.3).distance);
    requireField(folder, "-plane dimensions=2 normal=1,2,0 distance=0.5", planeSdf<2>({{1, 2}}, 0.5).distance);
    requireField(folder,
                 "-sphere dimensions=2 radius=0.5 translate=0.2,0.3,0 scale=2 -box dimensions=2 size=1 -difference",
                 subtract(placed(sphereSdf<2>(0.5), PlacementN<2>{.offset = {{0.2, 0.3}}, .scale = {{2, 2}}}),
                          boxSdf<2>({{1, 1}}, 0.2), 0.1)
                     .distance);
    folder.mustFail("-sphere dimensions=2 translate=0,0,1 -check", {"-sphere", "translate", "z = 0"});
    // Points and pictures stay within the shape.
    folder.mustRun(
        "-sphere dimensions=2 -noise dimensions=2 frequency=2 -bound variation=0.8 -dfvn speed=1 -scatter count=500 "
        "-advect duration=2 steps=10 -check report=disc.json samples=2000 strict=1 -slice width=32 -write d.png");
    const auto report = jsonOf(folder / "disc.json");
    CHECK(report["outside"] == 0);
    CHECK(report["not_converged"] == 0);
    CHECK(report["wall_flux"].get<double>() < 1e-9);
    CHECK(report["divergence_by_differences"].get<double>() < 1e-4);
}

TEST_CASE("bound action: a noise that is bounded already gets both walls", "[app][command]") {
    const Folder folder;
    const auto at = [](double x) { return placed(sphereSdf(1), Placement{.offset = {{x, 0, 0}}}); };
    const Sdf left = at(-0.8), right = at(0.8);
    const std::string noises = "-noise frequency=2 seed=1 ";
    const auto series = [&](const std::string& first, const std::string& second) {
        return "-sphere translate=-0.8,0,0 " + noises + "-bound layer=0.15 side=" + first +
               " -sphere translate=0.8,0,0 -bound layer=0.2 side=" + second;
    };
    // The narrower layer counts for both.
    const auto expected = [&](const Sdf& sdf, Side side) {
        const double slope = layerWidth(noise(1), right.bounds).noise.slope;
        return bounded(noise(1), Wall{.sdf = sdf, .side = side, .width = 0.15}, {.slope = slope});
    };
    requireField(folder, series("outside", "outside"), expected(unite(right, left, 0.15), Side::outside));
    requireField(folder, series("inside", "outside"), expected(subtract(left, right, 0.15), Side::inside));
    requireField(folder, series("outside", "inside"), expected(subtract(right, left, 0.15), Side::inside));
    requireField(folder, series("inside", "inside"), expected(intersect(right, left, 0.15), Side::inside));
    folder.mustFail(series("inside", "both") + " -check", {"-bound", "side=both cannot be joined"});

    // Two level sets whose layers overlap.
    store(folder / "mesh.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n");
    const Outcome told = folder.mustRun(
        "-read mesh.obj -mesh2ls dim=48 -noise frequency=2 seed=1 -bound side=outside layer=0.3 "
        "-read mesh.obj -move translate=1.1,0,0 -mesh2ls dim=48 -bound side=outside layer=0.3 "
        "-noise frequency=2 seed=2 -dfvn speed=1 box=-1,-1,-1,3,2,2 "
        "-scatter count=2000 -advect duration=1 -check report=two.json samples=3000");
    CHECK_THAT(told.err, Catch::ContainsSubstring("joined to the wall that bounds the noise already"));
    const auto report = jsonOf(folder / "two.json");
    CHECK(report["outside"] == 0);
    CHECK(report["wall_flux"].get<double>() < 1e-9);
}

TEST_CASE("curl action: conforms to the wall of a bounded noise", "[app][command]") {
    const Folder folder;
    const std::string three = "-noise seed=1 frequency=2 -noise seed=2 frequency=2 -noise seed=3 frequency=2 ";
    const Flow closed = curlFlow(std::array{noise(1), noise(2), noise(3)}, Domain::of(ball(0.15)));
    requireFlow(folder, "-sphere " + three + "-bound -curl", closed);
    // The ramp applies to the noises themselves, however many of them are bounded.
    requireFlow(folder,
                "-sphere -noise seed=1 frequency=2 -bound -noise seed=2 frequency=2 -bound -noise seed=3 frequency=2 "
                "-bound layer=0.1 -curl",
                closed);
    folder.mustRun("-sphere " + three +
                   "-bound -curl speed=1 -velocity dim=24 staggered=1 -check report=a.json "
                   "samples=3000 strict=1");
    const auto report = jsonOf(folder / "a.json");
    CHECK(report["wall_flux"].get<double>() < 1e-12);
    CHECK(report["divergence_by_differences"].get<double>() < 1e-4);
    CHECK(report["divergence_grid"].get<double>() < 1e-6);
    folder.mustFail("-sphere -noise seed=1 -bound -noise seed=2 -bound side=outside -noise seed=3 -curl -check",
                    {"-curl", "different walls"});
    folder.mustFail("-sphere -noise -bound -noise seed=1 -bound -dfvn -check",
                    {"-dfvn", "two of the fields are bounded"});
}
