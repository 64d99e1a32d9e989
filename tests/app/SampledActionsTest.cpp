// SPDX-License-Identifier: Apache-2.0
#include "curlew/field/NoiseField.h"
#include "curlew/picture/ImageFile.h"
#include "support/ProbeCommand.h"

using namespace curlew;
using namespace curlew::test;

TEST_CASE("field and bake actions: a baked noise and a picture are fields", "[app][command]") {
    const Folder folder;
    folder.mustRun("-noise -bake box=-1,-1,-1,1,1,1 dim=40 name=tile -write tile.vdb");
    // As exact as its voxels: by differences, the field follows its own derivatives and is near the noise.
    folder.mustRun("-read tile.vdb -field -noise -subtract -check box=-0.6,-0.6,-0.6,0.6,0.6,0.6 report=apart.json");
    const auto check = jsonOf(folder / "apart.json");
    CHECK(check["field_max"].get<double>() < 3e-3);
    CHECK(check["field_min"].get<double>() > -3e-3);
    // A picture is 2D, and a surface for a noise.
    folder.mustRun("-noise dimensions=2 frequency=2 -slice width=64 -write paint.png");
    folder.mustRun("-read paint.png -field channel=R wrap=mirror -noise -lift -slice width=64 -write painted.png");
    CHECK(readPng(folder / "painted.png").width >= 64);
    // A flow of a grid and a noise keeps to its tracks.
    folder.mustRun(
        "-read tile.vdb -field -noise seed=1 -dfvn box=-1,-1,-1,1,1,1 -scatter count=100 -advect duration=1 "
        "-check strict=1");
}

TEST_CASE("field and bake actions: unsuitable inputs are errors that say why", "[app][command]") {
    const Folder folder;
    folder.mustFail("-noise -bake", {"-bake", "box="});
    folder.mustFail("-noise -bake box=0,0,0,1,1,0", {"-bake", "box"});
    folder.mustFail("-field", {"-field", "a grid or an image"});
    folder.mustFail("-noise -noise seed=1 -dfvn box=-1,-1,-1,1,1,1 -velocity dim=8 -field", {"-field", "vec3s"});
    folder.mustFail("-noise -bake box=0,0,0,1,1,1 dim=8 -field wrap=repeat", {"-field", "wrap="});
    folder.mustFail("-noise dimensions=2 -slice width=16 -field channel=depth", {"-field", "depth"});
    folder.mustRun("-sphere -bake dim=16 -write ball.vdb"); // a shape has a box
}
