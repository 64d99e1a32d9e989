#include "curlew/field/Algebra.h"
#include "curlew/field/Map.h"
#include "curlew/field/NoiseField.h"
#include "curlew/flow/Flows.h"
#include "curlew/flow/Reshape.h"
#include "support/ProbeCommand.h"

using namespace curlew;
using namespace curlew::test;

namespace {

ScalarField noise(uint64_t seed) { return noiseField<Psrd3>({.seed = seed}); }
ScalarFieldN<2> plane(uint64_t seed) { return noiseField<Psrd2>({.seed = seed}); }

const std::string kTwo = "-noise seed=1 -noise seed=2 ";
const std::string kThree = kTwo + "-noise seed=3 ";
const std::string kThreePlane = "-noise dim=2 seed=1 -noise dim=2 seed=2 -noise dim=2 seed=3 ";

} // namespace

TEST_CASE("flows of the command are the library's", "[app][command]") {
    const Folder folder;
    requireFlow(folder, kTwo + "-dfvn", Flow(noise(1), noise(2)));
    requireFlow(folder, "-noise dim=2 seed=1 -dfvn", FlowN<2>({plane(1)}));
    requireFlow(folder, kTwo + "-noise dim=2 seed=3 -product -dfvn",
                Flow(noise(1), noise(2) * projected(plane(3), Matrix<2, 3>{})));
    requireFlow(
        folder,
        "-noise type=simplex dim=4 seed=1 -noise type=simplex dim=4 seed=2 -noise type=simplex dim=4 seed=3 -dfvn",
        FlowN<4>({noiseField<SimplexNoise<4>>({.seed = 1}), noiseField<SimplexNoise<4>>({.seed = 2}),
                  noiseField<SimplexNoise<4>>({.seed = 3})}));
    requireFlow(folder, kThree + "-curl", curlFlow(std::array{noise(1), noise(2), noise(3)}));
    requireFlow(folder, kThreePlane + "-curl", curlFlow(std::array{plane(1), plane(2), plane(3)}));
    // One noise three times, as the tutorial has it: the second sees x + 100, the third y + 100.
    const auto moved = [](const Vec3d& by) { return placed(noise(1), {.offset = -by}); };
    requireFlow(folder, "-noise seed=1 -curl offset=100",
                curlFlow(std::array{noise(1), moved({{100, 0, 0}}), moved({{0, 100, 0}})}));
    requireFlow(folder, "-noise seed=1 -torus -surface", Flow(noise(1), torusSdf(0.7, 0.3).distance));
    requireFlow(folder, "-uniform velocity=1,2,3", uniformFlow({{1, 2, 3}}));
    requireFlow(folder, "-vortex turns=0.5 core=0.2", vortexFlow(0.5, 0.2));
    requireFlow(folder, "-updraft speed=2 height=0.5", updraftFlow(2, 0.5));
    requireFlow(folder, kTwo + "-dfvn -uniform -superpose", Flow(noise(1), noise(2)) + uniformFlow({{0, 1, 0}}));
    requireFlow(folder, kTwo + "-dfvn normalize=1 speed=2", Flow(noise(1), noise(2)).normalized(2));
    requireFlow(folder, kTwo + "-dfvn -reshape limit=3 f=-0.5,0.5 softness=0.3",
                reshaped(Flow(noise(1), noise(2)), {.limit = 3, .f = {-0.5, 0.5}, .softness = 0.3}));
}

TEST_CASE("flows without tracks become grids and move points, unbound", "[app][command]") {
    const Folder folder;
    const std::string curl = kThree + "-curl speed=1 ";
    folder.mustRun(curl + "-velocity dim=16 staggered=1 -write curl.vdb -check report=curl.json samples=1000 strict=1");
    CHECK(jsonOf(folder / "curl.json")["divergence_grid"].get<double>() < 1e-6);
    CHECK(jsonOf(folder / "curl.json")["divergence_free"] == true);
    const Outcome moved = folder.mustRun(curl + "-scatter count=100 -advect time=0.1 steps=5 -write points.csv");
    CHECK_THAT(moved.err, Catch::Contains("no tracks"));
    folder.mustFail(curl + "-scatter count=100 -advect reproject=newton", {"-advect", "no tracks"});
    folder.mustFail(curl + "-reshape limit=1", {"-reshape", "two potentials"});
    folder.mustFail(curl + "-velocity dim=8 potentials=1", {"-velocity", "potentials=1", "tracks"});
    // Its potentials are no tracks, so a slice of f is nothing that one could see particles follow; its speed is.
    folder.mustRun(curl + "-slice width=16 -write curl.png");
}

TEST_CASE("a normalised flow is measured, and not promised to be divergence-free", "[app][command]") {
    const Folder folder;
    const std::string even = kTwo + "-dfvn normalize=1 speed=1.5 ";
    folder.mustRun(even + "-check report=even.json samples=1000 strict=1");
    const auto report = jsonOf(folder / "even.json");
    CHECK(report["divergence_free"] == false);
    CHECK(report["divergence_analytic"].get<double>() > 1e-3);
    CHECK(report["divergence_by_differences"].get<double>() > 1e-3);
    CHECK(report["rms_speed"].get<double>() == Approx(1.5));
    folder.mustFail(even + "-velocity dim=8 staggered=1", {"-velocity", "normalised", "collocated"});
    folder.mustFail(even + "-uniform -superpose", {"-superpose", "normalised"});
    folder.mustFail(even + "-reshape limit=1", {"-reshape", "normalised"});
    // It keeps its tracks.
    folder.mustRun(even + "-scatter count=200 -advect time=0.2 steps=10 -check report=points.json samples=100");
    CHECK(jsonOf(folder / "points.json")["drift_f"].get<double>() < 1e-6);
    CHECK(jsonOf(folder / "points.json")["not_converged"] == 0);
}

TEST_CASE("flows of every dimension are checked", "[app][command]") {
    const Folder folder;
    const int dimensions = GENERATE(2, 4, 5, 7);
    CAPTURE(dimensions);
    std::string actions;
    for (int k = 1; k < dimensions; ++k) actions += fmt::format("-noise type=simplex dim={} seed={} ", dimensions, k);
    folder.mustRun(actions + "-dfvn speed=1 -check report=a.json samples=500 strict=1 -print");
    const auto report = jsonOf(folder / "a.json");
    CHECK(report["divergence_analytic"].get<double>() < 1e-9);
    // Its own error: (1e-5 of the box)² times third derivatives, and roundings over 1e-5.
    CHECK(report["divergence_by_differences"].get<double>() < 1e-6);
    CHECK(report["rms_speed"].get<double>() == Approx(1));
    if (dimensions > 3) {
        folder.mustFail(actions + "-dfvn -velocity dim=8", {"-velocity", "flow", "dimensions"});
        folder.mustFail(actions + "-dfvn box=-1,-1,-1,1,1,1", {"-dfvn", "box="});
    } else {
        folder.mustRun(actions + "-dfvn -velocity voxel=0.1 -scatter count=50 -advect time=0.1 steps=2 -write a.vdb");
    }
}

TEST_CASE("a flow on a surface keeps its distance from it", "[app][command]") {
    const Folder folder;
    folder.mustRun(
        "-noise seed=1 frequency=3 -torus -surface speed=1 reach=0.1 -scatter count=300 -advect time=1 steps=20 "
        "-check report=a.json samples=500 strict=1");
    const auto report = jsonOf(folder / "a.json");
    CHECK(report["drift_g"].get<double>() < 1e-6); // g is the distance
    CHECK(report["divergence_analytic"].get<double>() < 1e-9);
    folder.mustRun("-sphere -scatter count=10 -write a.csv"); // a shape is still a shape
}

TEST_CASE("flows that cannot be made say why", "[app][command]") {
    const Folder folder;
    folder.mustFail("-noise type=simplex dim=5 -dfvn", {"-dfvn", "n - 1 fields of n dimensions"});
    folder.mustFail("-noise -noise -noise type=simplex dim=4 -dfvn", {"-dfvn", "4 dimensions", "has 3"});
    folder.mustFail("-noise type=simplex dim=4 -noise -dfvn", {"-dfvn", "4 dimensions"});
    folder.mustFail(kTwo + "-curl", {"-curl", "x=", "offset=100"});
    folder.mustFail("-noise dim=2 -noise -noise -curl", {"-curl", "all have 2 or all have 3"});
    folder.mustFail("-noise type=simplex dim=4 -curl offset=1", {"-curl", "3 dimensions"});
    folder.mustFail("-sphere -surface", {"-surface", "a field", "none"});
    folder.mustFail("-noise -surface", {"-surface", "a shape", "none"});
    folder.mustFail(kTwo + "-dfvn -reshape", {"-reshape", "limit="});
    folder.mustFail(kTwo + "-dfvn -reshape f=1,0", {"-reshape", "f=1,0", "empty"});
    folder.mustFail(kTwo + "-dfvn -superpose", {"-superpose", "a flow", "only one"});
    folder.mustFail("-uniform velocity=0", {"-uniform"});
    folder.mustFail("-vortex core=0", {"-vortex", "core=0"});
    folder.mustFail("-updraft height=-1", {"-updraft", "height=-1"});
    folder.mustFail("-sphere -blend", {"-blend", "a field for noise=", "none"});
}

TEST_CASE("DeWolf's product keeps a flow within its wall", "[app][command]") {
    const Folder folder;
    folder.mustRun(
        "-sphere -noise seed=1 frequency=2 -noise seed=2 frequency=2 -blend range=0.3 -dfvn speed=1 "
        "-scatter count=500 -advect time=1 steps=20 -check report=a.json samples=1000 strict=1");
    CHECK(jsonOf(folder / "a.json")["outside"] == 0);
    CHECK(jsonOf(folder / "a.json")["wall_flux"].get<double>() < 1e-9);
}
