// SPDX-License-Identifier: Apache-2.0
#include "curlew/vdb/MeshFile.h"
#include "curlew/vdb/Openvdb.h"
#include "curlew/vdb/VdbFile.h"
#include "support/Command.h"

#include <openvdb/io/File.h>

using namespace curlew;
using namespace curlew::test;
using Catch::Matchers::ContainsSubstring;

namespace {

const std::string kFlow = "-noise -noise seed=1 -dfvn speed=1 box=0,0,0,1,0.5,0.25 ";
const std::string kSmoke = kFlow + "-velocity dim=8 density=1 ";

/// The metadata of a .vdb file.
openvdb::MetaMap::Ptr metadataOf(const fs::path& path) {
    openvdb::initialize();
    openvdb::io::File file(path.string());
    file.open();
    return file.getMetadata();
}

} // namespace

TEST_CASE("write: every format that hosts take is written and described", "[app][command]") {
    const Folder folder;
    const auto outcome = folder.mustRun(kSmoke +
                                        "-write a.npz a.npy a.fga a.vf a.nvdb grid=0 -write grid=0,1 b.vdb b.usda "
                                        "-scatter count=20 -advect duration=0.1 -write p.npz p.npy p.bgeo p.usda "
                                        "-scatter count=3 -trace maxLength=0.3 -write c.npz c.npy c.bgeo c.usda");
    for (const char* name : {"a.npz", "a.npy", "a.fga", "a.vf", "a.nvdb", "b.usda", "p.npz", "p.npy", "p.bgeo",
                             "p.usda", "c.npz", "c.npy", "c.bgeo", "c.usda"}) {
        CAPTURE(name);
        CHECK(fs::file_size(folder / name) > 0);
        CHECK_THAT(outcome.err, ContainsSubstring(std::string("wrote ") + name));
    }
    CHECK_THAT(outcome.err, ContainsSubstring("a.vf: ") && ContainsSubstring("vectors; centre "));
    CHECK_THAT(bytesOf(folder / "b.usda"), ContainsSubstring("asset filePath = @./b.vdb@") &&
                                               ContainsSubstring("def OpenVDBAsset \"density\"") &&
                                               ContainsSubstring("def OpenVDBAsset \"vel\""));
}

TEST_CASE("read: nvdb and bgeo come back as they were written", "[app][command]") {
    const Folder folder;
    folder.mustRun(kSmoke +
                   "-write grid=0,1 a.nvdb -write grid=0,1 a.vdb -scatter count=20 -advect duration=0.1 -write p.bgeo "
                   "-scatter count=3 -trace maxLength=0.3 -write c.bgeo");
    folder.mustRun("-read a.nvdb -write grid=1,0 b.nvdb");
    CHECK((bytesOf(folder / "a.nvdb") == bytesOf(folder / "b.nvdb")));
    folder.mustRun("-read p.bgeo -write q.bgeo -read c.bgeo -write d.bgeo");
    CHECK((bytesOf(folder / "c.bgeo") == bytesOf(folder / "d.bgeo")));
    CHECK(fs::exists(folder / "q.bgeo"));
    CHECK_THAT(folder.mustRun("-read a.nvdb grids=density -print").out, ContainsSubstring("density"));
    folder.mustFail("-read a.nvdb grids=heat", {"no grid of that name", "density"});
    store(folder / "bad.nvdb", bytesOf(folder / "a.nvdb").substr(0, 900));
    folder.mustFail("-read bad.nvdb", {"bad.nvdb", "cut short"});
    store(folder / "bad.bgeo", bytesOf(folder / "c.bgeo").substr(0, 200));
    folder.mustFail("-read bad.bgeo", {"bad.bgeo", "cut short"});
}

TEST_CASE("write: target sets names, classes, axes and metadata", "[app][command]") {
    const Folder folder;
    const auto outcome =
        folder.mustRun(kFlow +
                       "-frames 3-4 fps=25 -velocity dim=32 staggered=1 density=1 -write grid=0,1 target=renderman "
                       "'r.$F4.vdb' -write grid=0,1 target=blender 'b-$F4.vdb' -write grid=0,1 'plain.$F4.vdb'");
    CHECK_THAT(outcome.err, ContainsSubstring("wrote b-0003.vdb: velocity (vec3s, ") &&
                                ContainsSubstring("wrote plain.0003.vdb: vel (vec3s, staggered, "));
    const auto metadata = metadataOf(folder / "r.0004.vdb");
    CHECK(metadata->metaValue<double>("frame") == 4);
    CHECK(metadata->metaValue<double>("fps") == 25);
    CHECK(metadata->metaValue<int32_t>("frames_per_second") == 25);
    CHECK(metadata->metaValue<std::string>("target") == "renderman");
    CHECK(metadata->metaValue<std::string>("up_axis") == "Y");
    CHECK(metadataOf(folder / "plain.0003.vdb")->metaValue<double>("frame") == 3);
    CHECK(!(*metadataOf(folder / "plain.0003.vdb"))["target"]);
    CHECK(metadataOf(folder / "b-0003.vdb")->metaValue<std::string>("up_axis") == "Z");
    for (const auto& grid : readVdb(folder / "r.0003.vdb")) CHECK(grid->getGridClass() == openvdb::GRID_FOG_VOLUME);

    // The box is 1 long, 0.5 high and 0.25 deep: in Blender, Z is up.
    for (const auto& grid : readVdb(folder / "b-0003.vdb")) {
        CHECK((grid->getName() == "velocity" || grid->getName() == "density"));
        const auto box = grid->evalActiveVoxelBoundingBox();
        const auto size = grid->indexToWorld(box.max()) - grid->indexToWorld(box.min());
        CHECK(std::abs(size[2]) > 0.35);
        CHECK(std::abs(size[1]) < 0.3);
    }
}

TEST_CASE("check: says what a file lacks for a host", "[app][command]") {
    const Folder folder;
    folder.mustRun(kFlow + "-velocity dim=8 staggered=1 -write smoke.vdb -write target=blender good.vdb");
    const auto bad = folder.mustRun("-check target=blender smoke.vdb report=r.json");
    CHECK_THAT(bad.err, ContainsSubstring("warning: 'smoke.vdb': 'vel' is staggered"));
    CHECK(jsonOf(folder / "r.json").at("host_problems") == 1);
    CHECK_THAT(folder.mustRun("-check target=blender good.vdb").err,
               ContainsSubstring("'good.vdb' has what blender looks for"));
    folder.mustFail("-check target=blender smoke.vdb strict=1", {"is staggered"});
    folder.mustFail("-check target=blender", {"belong together"});
    folder.mustFail("-check target=blender none.vdb", {"none.vdb"});
}

TEST_CASE("write: a usda collects the frames of points and refers to those of a volume", "[app][command]") {
    const Folder folder;
    folder.mustRun(kFlow +
                   "-scatter count=5 -frames 1-3 fps=24 -advect -write dust.usda 'each.$F4.usda' -velocity dim=8 "
                   "density=1 -write grid=0,1 'smoke.$F4.vdb' smoke.usda");
    const std::string dust = bytesOf(folder / "dust.usda"), smoke = bytesOf(folder / "smoke.usda");
    for (const char* sample : {"\n        1: [(", "\n        2: [(", "\n        3: [("})
        CHECK_THAT(dust, ContainsSubstring(sample));
    CHECK_THAT(bytesOf(folder / "each.0002.usda"),
               ContainsSubstring("\n        2: [(") && !ContainsSubstring("\n        1: [("));
    for (const char* sample : {"1: @./smoke.0001.vdb@", "3: @./smoke.0003.vdb@", "endTimeCode = 3"})
        CHECK_THAT(smoke, ContainsSubstring(sample));
    folder.mustFail(kFlow + "-velocity dim=8 -write other.usda", {"refers to a .vdb"});
    CHECK_THAT(folder.mustRun(kFlow + "-scatter count=5 -velocity dim=8 -write grid=0 geo=0 both.vdb both.usda").err,
               ContainsSubstring("warning: 'both.usda' has no points"));
    folder.mustFail(kFlow + "-scatter count=3 -frames 1-3 part=1/3 -trace maxLength=0.1 -write other.usda",
                    {"without part="});
}

TEST_CASE("write: velocities per frame and components are options of every host", "[app][command]") {
    const Folder folder;
    folder.mustRun(kFlow + "-frames 1 fps=25 -velocity dim=8 -write a.vdb -write per=frame b.vdb -write split=1 c.vdb");
    const auto a = openvdb::gridPtrCast<openvdb::Vec3SGrid>(readVdb(folder / "a.vdb").front());
    const auto b = openvdb::gridPtrCast<openvdb::Vec3SGrid>(readVdb(folder / "b.vdb").front());
    const openvdb::Coord ijk = a->evalActiveVoxelBoundingBox().min();
    CHECK(b->tree().getValue(ijk)[0] == Approx(a->tree().getValue(ijk)[0] / 25));
    const auto parts = readVdb(folder / "c.vdb");
    REQUIRE(parts.size() == 3);
    CHECK(parts[2]->getName() == "vel.z");
    CHECK(openvdb::gridPtrCast<openvdb::FloatGrid>(parts[2])->tree().getValue(ijk) == a->tree().getValue(ijk)[2]);
    folder.mustFail(kFlow + "-velocity dim=8 -write per=frame x.vdb", {"per=frame needs -frames"});
    folder.mustFail(kFlow + "-velocity dim=8 -write split=1 target=karma x.vdb", {"karma", "leave out split=1"});
    folder.mustFail(kFlow + "-velocity dim=8 -write upAxis=z x.vdb", {"upAxis= needs target="});
    folder.mustFail(kFlow + "-velocity dim=8 -write target=unity x.vdb", {"unity does not read .vdb"});
    folder.mustFail("-noise dim=2 -dfvn -write x.fga", {"x.fga"});
    CHECK_THAT(folder.mustRun("-noise -noise seed=1 -dfvn box=0,0,0,1,0.1,0.1 -velocity dim=200 -write x.fga").err,
               ContainsSubstring("128 x 14 x 14 vectors") && ContainsSubstring("resampled"));
}

TEST_CASE("write: target turns a mesh in a ply, and its faces keep their outer side", "[app][command]") {
    const Folder folder;
    folder.mustRun("-read " + sourceDir() +
                   "/scenes/spot.obj -write a.ply -write z.ply target=blender -write u.ply target=unreal -write a.obj "
                   "target=unreal");
    const auto volume = [](const Mesh& mesh) {
        double sum = 0;
        const auto add = [&](uint32_t a, uint32_t b, uint32_t c) {
            const openvdb::Vec3d p(mesh.points[a]), q(mesh.points[b]), r(mesh.points[c]);
            sum += p.dot(q.cross(r)) / 6;
        };
        for (const auto& t : mesh.triangles) add(t[0], t[1], t[2]);
        for (const auto& q : mesh.quads) add(q[0], q[1], q[2]), add(q[0], q[2], q[3]);
        return sum;
    };
    const Mesh mesh = readMesh(folder / "a.ply"), up = readMesh(folder / "z.ply"), large = readMesh(folder / "u.ply");
    const auto p = mesh.points[7];
    CHECK(up.points[7] == openvdb::Vec3s(p[0], -p[2], p[1]));
    CHECK(volume(mesh) > 0.1);
    CHECK_THAT(volume(up), Catch::Matchers::WithinRel(volume(mesh), 1e-5));
    CHECK_THAT(volume(large), Catch::Matchers::WithinRel(1e6 * volume(mesh), 1e-5));
    CHECK(readMesh(folder / "a.obj").points[7] == p);
}
