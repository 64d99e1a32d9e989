// SPDX-License-Identifier: Apache-2.0
#include "curlew/vdb/MeshFile.h"
#include "support/ProbeCommand.h"

using namespace curlew;
using namespace curlew::test;
using Catch::Matchers::ContainsSubstring;

TEST_CASE("mesh action: an isosurface and a height field", "[app][command]") {
    const Folder folder;
    const auto run = folder.mustRun("-sphere radius=0.5 -mesh voxel=0.05 -write ball.obj");
    CHECK_THAT(run.err, ContainsSubstring("mesh: "));
    const Mesh ball = readMesh(folder / "ball.obj");
    CHECK(topologyOf(ball).closed());
    for (const auto& p : ball.points) CHECK(p.length() == Approx(0.5).epsilon(1e-5));
    CHECK_THAT(bytesOf(folder / "ball.obj"), ContainsSubstring("\nvn "));
    folder.mustRun("-noise dimensions=2 -mesh box=0,0,-1,2,1,1 dim=20 -write terrain.ply");
    CHECK(readMesh(folder / "terrain.ply").quads.size() == 200);
    CHECK_THAT(bytesOf(folder / "terrain.ply"), ContainsSubstring("property float s\n"));
    CHECK_THAT(run.err, !ContainsSubstring("warning"));
    CHECK_THAT(folder.mustRun("-noise -mesh dim=16 -write cut.obj").err,
               ContainsSubstring("the surface is cut off at the sides of the box -1,-1,-1,1,1,1"));
    CHECK_THAT(folder.mustRun("-noise -mesh dim=16 box=0,0,0,1,1,1 -write cut.obj").err, !ContainsSubstring("warning"));
    // Closed, but within a voxel of the box.
    CHECK_THAT(folder.mustRun("-formula 'x^2+y^2+z^2-0.9^2' -mesh dim=10 -write ball.obj").err,
               !ContainsSubstring("warning"));
    // A density is inside where it is above the value. The mesh can be used as one that was read.
    folder.mustRun("-formula '1-x^2-y^2-z^2' -mesh iso=0.75 inside=above dim=40 -mesh2ls -write solid.vdb");
}

TEST_CASE("mesh action: options without effect and unsuitable fields are errors", "[app][command]") {
    const Folder folder;
    folder.mustFail("-noise dimensions=2 -mesh iso=1", {"iso", "3 dimensions"});
    folder.mustFail("-noise type=simplex dimensions=4 -mesh", {"2 or 3 dimensions"});
    folder.mustFail("-sphere -mesh iso=9", {"value 9", "-check"});
    folder.mustFail("-sphere -mesh voxel=0.1 dim=7", {"dim"});
    folder.mustFail("-plane -mesh box=0,0,0,0,1,1", {"box"});
}
