// SPDX-License-Identifier: Apache-2.0
#include "curlew/field/NoiseField.h"
#include "curlew/picture/ImageFile.h"
#include "curlew/vdb/MeshFile.h"
#include "curlew/vdb/Openvdb.h"
#include "curlew/vdb/PointFile.h"
#include "curlew/vdb/VdbFile.h"
#include "support/ProbeCommand.h"

using namespace curlew;
using namespace curlew::test;

TEST_CASE("field and bake actions: a baked noise and a picture are fields", "[app][command]") {
    const Folder folder;
    folder.mustRun("-noise -bake box=-1,-1,-1,1,1,1 dim=40 name=tile -write tile.vdb");
    // As exact as its voxels: by differences, the field follows its own derivatives and is near the noise.
    folder.mustRun(
        "-read tile.vdb -field -noise -subtract -check samples=10000 box=-0.6,-0.6,-0.6,0.6,0.6,0.6 report=apart.json");
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
        "-check samples=10000 strict=1");
}

TEST_CASE("field and bake actions: unsuitable inputs are errors that say why", "[app][command]") {
    const Folder folder;
    folder.mustFail("-noise -bake", {"-bake", "box="});
    folder.mustFail("-noise -bake box=0,0,0,1,1,0", {"-bake", "box"});
    folder.mustFail("-field", {"-field", "a grid or an image"});
    folder.mustFail("-noise -noise seed=1 -dfvn box=-1,-1,-1,1,1,1 -velocity dim=8 -field",
                    {"-field", "vec3s", "channel="});
    folder.mustFail("-noise -bake box=0,0,0,1,1,1 dim=8 -field wrap=repeat", {"-field", "wrap="});
    folder.mustFail("-noise dimensions=2 -slice width=16 -field channel=depth", {"-field", "depth"});
    folder.mustRun("-sphere -bake dim=16 -write ball.vdb"); // a shape has a box
}

TEST_CASE("field action: meshes, pictures and bakes show the box of the grid by default", "[app][command]") {
    const Folder folder;
    // A ball of radius 0.8 about 3, 3, 3.
    const std::string ball = "-sphere radius=0.8 translate=3,3,3 -bake box=2,2,2,4,4,4 dim=32 name=ball -field ";
    const auto run = folder.mustRun(ball + "-mesh dim=32 -write ball.obj");
    CHECK_THAT(run.err, !Catch::ContainsSubstring("warning"));
    const Mesh mesh = readMesh(folder / "ball.obj");
    CHECK(topologyOf(mesh).closed());
    for (const auto& p : mesh.points) REQUIRE((p - openvdb::Vec3s(3)).length() == Approx(0.8).margin(1e-3));
    // A level set, a density that fills its grid, and one voxel have closed surfaces, too.
    for (const std::string source :
         {"-box size=1,1,1 -mesh dim=24 -mesh2ls dim=32 -field -mesh dim=23 ",
          "-formula 1 -bake box=-0.5,-0.5,-0.5,0.5,0.5,0.5 dim=16 -field -mesh iso=0.5 inside=above dim=32 ",
          "-formula 1 -bake box=0,0,0,0.01,0.01,0.01 voxel=0.1 -field -mesh iso=0.5 inside=above dim=32 "}) {
        CHECK_THAT(folder.mustRun(source + "-write closed.obj").err, !Catch::ContainsSubstring("cut off"));
        CHECK(topologyOf(readMesh(folder / "closed.obj")).closed());
    }
    folder.mustRun(ball + "-transform translate=-3,-3,-3 scale=2 -mesh dim=32 -write moved.obj");
    CHECK(topologyOf(readMesh(folder / "moved.obj")).closed());
    folder.mustRun(ball + "-check report=ball.json");
    CHECK(jsonOf(folder / "ball.json")["field_min"].get<double>() < -0.7);
    folder.mustRun(ball + "-bake dim=32 -write again.vdb");
    CHECK(readVdb(folder / "again.vdb").at(0)->evalActiveVoxelBoundingBox().dim().x() > 30);
    folder.mustRun(ball + "-slice width=32 axis=z -write ball.exr");
    const Image slice = readExr(folder / "ball.exr");
    CHECK(*std::min_element(slice.pixels.begin(), slice.pixels.end()) < -0.7f); // the middle of the ball
}

TEST_CASE("dfvn and curl actions: a flow of a grid has the domain of the grid", "[app][command]") {
    const Folder folder;
    const std::string grid = "-noise frequency=3 -bake box=3,3,3,5,5,5 dim=16 -field ";
    for (const std::string& flow :
         {grid + "-noise seed=1 -dfvn ", "-noise seed=1 " + grid + "-dfvn ", grid + "-curl shift=3 "}) {
        CAPTURE(flow);
        const auto boxOf = [&](const std::string& words) {
            folder.mustRun(words + "-velocity dim=16 -write flow.vdb");
            const auto velocity = readVdb(folder / "flow.vdb").at(0);
            const auto voxels = velocity->evalActiveVoxelBoundingBox();
            return std::pair(velocity->indexToWorld(voxels.min()), velocity->indexToWorld(voxels.max()));
        };
        const auto [lower, upper] = boxOf(flow);
        CHECK((lower - openvdb::Vec3d(3)).length() < 0.25);
        CHECK((upper - openvdb::Vec3d(5)).length() < 0.25);
    }
    // A wall and box= come first.
    folder.mustRun(grid +
                   "-noise seed=1 -sphere radius=0.5 translate=4,4,4 -bound -dfvn -scatter count=50 -write in.ply");
    folder.mustRun(grid + "-noise seed=1 -dfvn box=3,3,3,4,4,4 -scatter count=50 -write part.ply");
    for (const char* name : {"in.ply", "part.ply"}) {
        const Points points = readPoints(folder / name).points;
        REQUIRE(points.size() == 50);
        for (size_t k = 0; k < points.size(); ++k) {
            CAPTURE(name, k);
            if (name == std::string("in.ply"))
                CHECK(length(points.position(k) - Vec3d{{4, 4, 4}}) < 0.5);
            else
                CHECK(Box{{{3, 3, 3}}, {{4, 4, 4}}}.contains(points.position(k)));
        }
    }
}

TEST_CASE("bound action: a grid that is not marked as a level set is named as the reason", "[app][command]") {
    const Folder folder;
    folder.mustRun("-sphere radius=0.5 -bake dim=32 -write ball.vdb");
    folder.mustFail("-read ball.vdb -noise -bound", {"-bound", "there is none", "-field -mesh -mesh2ls"});
    folder.mustFail("-noise -bound", {"-bound", "there is none"});
    folder.mustRun("-read ball.vdb -field -mesh dim=32 -mesh2ls dim=24 -noise -noise seed=1 -bound -dfvn");
}

TEST_CASE("field action: the range of a density is known, so it can be a divisor", "[app][command]") {
    const Folder folder;
    folder.mustRun("-formula '3+sin(5*x)' -bake box=-1,-1,-1,1,1,1 dim=24 -write density.vdb");
    // Symmetric bounds would contain zero. Coefficients are up to a sixth of the second differences beyond the values.
    folder.mustRun(
        "-read density.vdb -field as=density -formula '1/(1+density)' -check samples=10000 box=-1,-1,-1,1,1,1");
    folder.mustFail("-read density.vdb -field as=density -formula '1/(density-3)'", {"zero"});
}

TEST_CASE("field action: the speed and the components of a velocity grid", "[app][command]") {
    const Folder folder;
    for (const char* staggered : {"0", "1"}) {
        folder.mustRun(fmt::format("-uniform velocity=2,-1,2 -velocity dim=8 staggered={} -write v.vdb", staggered));
        for (const auto& [channel, value] : {std::pair("speed", 3.0), std::pair("x", 2.0), std::pair("y", -1.0)}) {
            folder.mustRun(fmt::format(
                "-read v.vdb -field channel={} -check samples=10000 box=-0.3,-0.3,-0.3,0.3,0.3,0.3 report=r.json",
                channel));
            CHECK(jsonOf(folder / "r.json")["field_max"].get<double>() == Approx(value).epsilon(1e-3));
        }
    }
    folder.mustFail("-read v.vdb -field channel=w", {"channel=speed"});
}

TEST_CASE("velocity action: grids around a shape that turns have the same voxels and no jump", "[app][command]") {
    const Folder folder;
    folder.mustRun(
        "-frames 1-2 fps=24000 -capsule radius=0.5 length=1 'translate={3*T},0,0' 'rotate=0,0,{90*T}' -noise -noise "
        "seed=1 -bound side=outside layer=0.15 -dfvn speed=1e-4 -velocity dim=32 -write 'v.$F.vdb'");
    const auto gridIn = [&](const char* file) {
        return openvdb::gridPtrCast<openvdb::Vec3SGrid>(readVdb(folder / file).front());
    };
    const auto first = gridIn("v.1.vdb"), second = gridIn("v.2.vdb");
    CHECK(first->voxelSize()[0] == Approx(second->voxelSize()[0]).epsilon(1e-6));
    double most = 0, change = 0; // the turn begins at 0, where the bounds of the shape could be tighter
    for (auto v = first->cbeginValueOn(); v; ++v) {
        most = std::max(most, static_cast<double>(v->length()));
        change = std::max(change, static_cast<double>((second->tree().getValue(v.getCoord()) - *v).length()));
    }
    CHECK(change < 0.1 * most);
}

TEST_CASE("velocity action: a tile has each voxel once", "[app][command]") {
    const Folder folder;
    const std::string flow = "-noise frequency=2 period=4 -noise frequency=2 period=4 seed=1 -dfvn ";
    const auto voxelsOf = [&](const std::string& options) {
        folder.mustRun(flow + "-velocity box=0,0,0,2,2,2 " + options + " -write v.vdb");
        return openvdb::GridBase::grid<openvdb::Vec3SGrid>(readVdb(folder / "v.vdb").front());
    };
    const auto tile = voxelsOf("dim=16 tile=1"), whole = voxelsOf("dim=16");
    CHECK(tile->activeVoxelCount() == 16 * 16 * 16);
    CHECK(whole->activeVoxelCount() == 17 * 17 * 17);
    const auto inTile = tile->getConstAccessor(), inWhole = whole->getConstAccessor();
    for (int k = 0; k < 16; ++k) {
        CHECK(inTile.getValue({k, 3, 15}) == inWhole.getValue({k, 3, 15}));
        CHECK((inTile.getValue({0, k, 3}) - inWhole.getValue({16, k, 3})).length() < 1e-5f); // the plane left out
    }
    folder.mustFail(flow + "-velocity box=0,0,0,2,2,1.9 dim=16 tile=1 -write v.vdb", {"tile=1", "along z"});
}
