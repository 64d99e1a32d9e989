// SPDX-License-Identifier: Apache-2.0
#include "support/ProbeCommand.h"

using namespace curlew;
using namespace curlew::test;

namespace {

/// A staggered velocity grid of a noise around a ball, in vel.vdb, and the ball as a level set in ball.vdb.
void writeVelocity(const Folder& folder) {
    folder.mustRun(
        "-sphere radius=0.5 -noise frequency=1.5 -noise frequency=1.5 seed=1 -bound side=outside -dfvn speed=1 "
        "box=-1,-1,-1,1,1,1 -velocity dim=40 staggered=1 -write vel.vdb");
}

} // namespace

TEST_CASE("flow action: a velocity grid as it is, and with potentials", "[app][command]") {
    const Folder folder;
    writeVelocity(folder);
    const auto plain = folder.mustRun("-read vel.vdb -flow -check report=plain.json");
    CHECK_THAT(plain.err, Catch::Matchers::ContainsSubstring("linear interpolation of a staggered velocity grid"));
    const auto sampled = jsonOf(folder / "plain.json");
    CHECK(sampled["divergence_free"] == false);
    CHECK(sampled["divergence_by_differences"].get<double>() > 0.01);
    const auto exact = folder.mustRun("-read vel.vdb -flow exact=1 -check report=exact.json");
    CHECK_THAT(exact.err, Catch::Matchers::ContainsSubstring("potentials of 4"));
    const auto made = jsonOf(folder / "exact.json");
    CHECK(made["divergence_free"] == true);
    CHECK(made["divergence_vanishes"] == true);
    // Particles that follow term by term never enter the ball.
    folder.mustRun(
        "-sphere radius=0.5 -read vel.vdb -flow exact=1 side=outside -scatter count=500 -advect duration=2 steps=10 "
        "splitting=strang -check report=points.json");
    CHECK(jsonOf(folder / "points.json")["outside"] == 0);
    folder.mustRun("-read vel.vdb -flow exact=1 -velocity dim=20 staggered=1 -check report=again.json");
    folder.mustRun("-read vel.vdb -flow interpolation=cubic -slice width=32 -write slice.png");
}

TEST_CASE("flow action: components that a host has split are one velocity", "[app][command]") {
    const Folder folder;
    folder.mustRun("-noise -noise seed=1 -dfvn box=-1,-1,-1,1,1,1 -velocity dim=16 -write split=1 parts.vdb");
    const auto run = folder.mustRun("-read parts.vdb -flow exact=1 -print");
    CHECK_THAT(run.out, Catch::Matchers::ContainsSubstring("sum of 3"));
    folder.mustFail("-noise -bake box=0,0,0,1,1,1 dim=8 -flow", {"-flow", "grid"});
}

TEST_CASE("flow action: options without effect and unsuitable inputs are errors", "[app][command]") {
    const Folder folder;
    writeVelocity(folder);
    folder.mustFail("-read vel.vdb -flow exact=1 interpolation=cubic", {"interpolation"});
    folder.mustFail("-sphere -read vel.vdb -flow side=outside", {"exact=1"});
    folder.mustFail("-read vel.vdb -flow -advect splitting=strang", {"points"});
    folder.mustFail("-read vel.vdb -flow -scatter count=10 -advect splitting=strang", {"splitting=none", "exact=1"});
    folder.mustFail("-read vel.vdb -flow -velocity staggered=1 dim=8", {"staggered", "exact=1"});
    folder.mustFail("-read vel.vdb -flow -noise -carry", {"without potentials"});
    folder.mustFail("-sphere radius=3 -read vel.vdb -flow exact=1 side=outside", {"inside out", "side="});
}

TEST_CASE("gradient action: has sources and sinks, and is said not to be divergence-free", "[app][command]") {
    const Folder folder;
    folder.mustRun("-noise dimensions=2 frequency=2 -gradient speed=1 -check report=flat.json");
    CHECK(jsonOf(folder / "flat.json")["rms_speed"].get<double>() == Approx(1).epsilon(1e-6));
    folder.mustRun("-noise frequency=2 -gradient -check report=gradient.json");
    const auto check = jsonOf(folder / "gradient.json");
    CHECK(check["divergence_free"] == false);
    CHECK(check["divergence_by_differences"].get<double>() > 0.1);
    folder.mustFail("-noise type=simplex dimensions=4 -gradient", {"2 or 3 dimensions"});
}
