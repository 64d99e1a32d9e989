// SPDX-License-Identifier: Apache-2.0
#include "curlew/vdb/MeshFile.h"
#include "curlew/vdb/PointFile.h"
#include "support/Command.h"
#include "support/Glb.h"
#include "support/SessionCommand.h"

#include <cmath>
#include <numbers>

using namespace curlew;
using Catch::Matchers::ContainsSubstring;
using test::bytesOf;
using test::Folder;

namespace {

/// Returns the middle of the upper end of bendingBar() when its second bone is rotated by `angle`.
openvdb::Vec3d endOf(double angle) { return {-std::sin(angle), 1 + std::cos(angle), 0}; }

/// Returns the distance from there to the mean of the mesh's last four points.
double offEnd(const Mesh& mesh, double angle) {
    openvdb::Vec3d middle(0.0);
    for (size_t n = mesh.points.size() - 4; n < mesh.points.size(); ++n) middle += openvdb::Vec3d(mesh.points[n]) / 4;
    return (middle - endOf(angle)).length();
}

constexpr double kRight = std::numbers::pi / 2;

/// Points with every attribute that point files can hold.
const std::string kDust =
    "-uniform velocity=1,0,0 -frames 1-3 -emit rate=2000 life=3 -advect -write 'dust.$F.ply' 'dust.$F.csv' ";

} // namespace

TEST_CASE("read action: an animated mesh follows the frames", "[app][command]") {
    const Folder folder;
    test::store(folder / "bend.glb", test::bendingBar().bytes());
    const auto outcome = folder.mustRun("-frames 1-13 fps=12 -read bend.glb -write 'bend.$F.ply'");
    for (const int frame : {1, 4, 13}) {
        CAPTURE(frame);
        const Mesh mesh = readMesh(folder / ("bend." + std::to_string(frame) + ".ply"));
        CHECK(offEnd(mesh, kRight * (frame - 1) / 12) < 1e-5);
    }
    CHECK_THAT(outcome.err,
               ContainsSubstring("metres, Y up; clip 'bend' of 1 s, which holds its last pose; other clips: 'sway'"));
    // Time is relative to the frame in which T is 0, not to the first frame of the run.
    folder.mustRun("-frames 4 start=1 fps=12 -read bend.glb -write 'late.$F.ply'");
    CHECK(bytesOf(folder / "late.4.ply") == bytesOf(folder / "bend.4.ply"));
    folder.mustRun("-read bend.glb time=0.25 -write time.ply");
    CHECK(bytesOf(folder / "time.ply") == bytesOf(folder / "bend.4.ply"));
    folder.mustRun("-read bend.glb clip=1 time=2.25 -write sway.ply");
    CHECK(bytesOf(folder / "sway.ply") == bytesOf(folder / "bend.4.ply"));
    folder.mustRun("-read bend.glb clip=bend time=1.25 end=loop -write loop.ply");
    CHECK(bytesOf(folder / "loop.ply") == bytesOf(folder / "bend.4.ply"));
    folder.mustRun("-read bend.glb clip=none -write none.ply");
    CHECK(bytesOf(folder / "none.ply") == bytesOf(folder / "bend.1.ply"));
    CHECK_THAT(folder.mustRun("-read bend.glb -frames 1-2 -write 'still.$F.ply'").err,
               ContainsSubstring("it does not move"));
    CHECK(bytesOf(folder / "still.2.ply") == bytesOf(folder / "bend.1.ply"));
    folder.mustFail("-read bend.glb clip=run -write x.ply", {"there is no clip 'run'", "0 'bend', 1 'sway'"});
    folder.mustFail("-read none.ply clip=run -write x.ply", {"clip=", ".glb"});
}

TEST_CASE("read action: a static mesh is read once for all frames", "[app]") {
    const test::ScratchFolder folder;
    test::Glb still = test::bendingBar();
    still.root.erase("animations");
    const std::string name = test::store(folder / "still.glb", still.bytes()).string();
    const std::string moves = test::store(folder / "bend.glb", test::bendingBar().bytes()).string();
    const auto made = [&](const std::string& read) {
        std::vector<const Mesh*> meshes;
        test::Scenes scenes(
            [&](app::Context& c) { meshes.push_back(std::get<app::MeshPointer>(c.value("what")).get()); });
        scenes.run("frames 1-3\nread " + read + "\nhere\n");
        return std::set(meshes.begin(), meshes.end()).size();
    };
    CHECK(made(name) == 1);
    CHECK(made(moves + " time=0.5") == 1);
    CHECK(made(moves + " clip=none") == 1);
    CHECK(made(moves) > 1);
}

TEST_CASE("read action: a bending bar pushes points around it", "[app][command]") {
    const Folder folder;
    test::store(folder / "bend.glb", test::bendingBar().bytes());
    const std::string flow =
        "-noise frequency=2 -noise seed=1 frequency=2 -bound side=outside layer=0.15 -dfvn speed=0.3 "
        "padding=0.5 ";
    folder.mustRun("-read bend.glb clip=none -mesh2ls dim=32 " + flow +
                   "-scatter count=2000 -frames 1-5 fps=12 -read bend.glb -mesh2ls dim=32 " + flow +
                   "-advect -check -report bar.json");
    CHECK(test::jsonOf(folder / "bar.json")["check"]["outside"] == 0);
}

TEST_CASE("read action: points are read back and written with the same bytes", "[app][command]") {
    const Folder folder;
    folder.mustRun(kDust);
    for (const std::string ending : {".ply", ".csv"}) {
        CAPTURE(ending);
        folder.mustRun("-read dust.3" + ending + " -write back" + ending);
        CHECK(bytesOf(folder / ("back" + ending)) == bytesOf(folder / ("dust.3" + ending)));
    }
    CHECK(bytesOf(folder / "dust.3.csv").starts_with("x,y,z,vx,vy,vz,id,age,life"));
    // They can be moved like any other points.
    folder.mustRun("-read dust.3.ply -uniform velocity=0,1,0 -advect duration=1 steps=1 -write on.csv");
    const Points before = readPoints(folder / "dust.3.ply").points, after = readPoints(folder / "on.csv").points;
    REQUIRE(before.size() == after.size());
    for (size_t n = 0; n < before.size(); ++n) {
        CHECK(after.id[n] == before.id[n]);
        CHECK(after.y[n] == Approx(before.y[n] + 1));
        CHECK(after.x[n] == Approx(before.x[n]).margin(1e-6));
    }
}

TEST_CASE("read and write: pipes and gzip work and standard output carries only data", "[app][command]") {
    const Folder folder;
    test::store(folder / "bar.glb", test::bendingBar().bytes());
    folder.mustRun(
        "-read bar.glb -write bar.obj skinned.ply -read bar.obj -write bar.ply"); // the .obj has another order
    folder.mustRun(kDust);
    folder.mustRun("-read bar.obj -mesh2ls dim=24 -write bar.vdb");
    const auto through = [&](const std::string& line) {
        const test::Outcome outcome = folder.shell(line);
        CAPTURE(line, outcome.err);
        CHECK(outcome.status == 0);
        return outcome.out;
    };
    const std::string bar = bytesOf(folder / "bar.ply"), dust = bytesOf(folder / "dust.2.ply");
    CHECK(through("curlew -read bar.obj -print -write - format=ply") == bar);
    CHECK(through("curlew -read - format=obj -write /dev/stdout format=ply <bar.obj") == bar);
    CHECK(through("cat bar.glb | curlew -read /dev/stdin format=glb -write - format=ply") ==
          bytesOf(folder / "skinned.ply"));
    CHECK(through("gzip -c bar.obj | curlew -read - format=obj -write - format=ply") == bar);
    CHECK(through("cat dust.2.csv | curlew -read - format=csv -write - format=csv") == bytesOf(folder / "dust.2.csv"));
    CHECK(through("cat dust.2.ply | curlew -read - format=ply -write - format=ply") == dust);
    CHECK(through("mkfifo pipe.ply; cat dust.2.ply >pipe.ply & curlew -read pipe.ply -write - format=ply") == dust);
    CHECK_THAT(folder.shell("cat bar.vdb | curlew -read - format=vdb -print").out, ContainsSubstring("level set"));
    CHECK_THAT(folder.shell("curlew -read bar.obj -print -write - format=ply >/dev/null").err,
               ContainsSubstring("mesh"));
    for (const std::string name : {"bar.obj", "dust.2.ply", "dust.2.csv", "bar.glb"}) {
        CAPTURE(name);
        const std::string ending = name.substr(name.rfind('.') + 1), plain = ending == "csv" ? "csv" : "ply";
        const std::string read = through("gzip -k " + name + "; curlew -read " + name + ".gz -write - format=" + plain);
        CHECK(read == through("curlew -read " + name + " -write - format=" + plain));
    }
    folder.mustFail("-read - -write x.ply", {"the format of '-' is unknown", "format="});
    folder.mustFail("-read - format=obj -write x.ply", {"'-'", "it is empty"});
    folder.mustFail("-read bar.ply -write -", {"'-'", "format="});
    folder.mustFail("-read bar.ply -write x.ply.gz", {"x.ply.gz", "no known extension"});
    folder.mustFail("-read walk.abc", {"'walk.abc': .abc is not supported", "use .obj, .ply, .glb"});
    folder.mustFail("-sphere -scatter -write dust.ABC", {"'dust.ABC': .abc is not supported", "use .usda, .bgeo"});
    folder.mustFail("-read dust.bgeo.sc", {".bgeo.sc is not supported", "without compression"});
    test::store(folder / "cut.obj.gz", bytesOf(folder / "bar.obj.gz").substr(0, 100));
    folder.mustFail("-read cut.obj.gz -write x.ply", {"cut.obj.gz", "cut short"});
}
