// SPDX-License-Identifier: Apache-2.0
#include "curlew/vdb/MeshFile.h"
#include "curlew/vdb/VdbFile.h"
#include "support/Command.h"

#include <openvdb/tools/LevelSetMeasure.h>
#include <openvdb/tools/LevelSetSphere.h>
#include <openvdb/tools/LevelSetUtil.h>

#include <numbers>

using namespace curlew;
using Catch::Matchers::ContainsSubstring;
using test::Folder;
using test::jsonOf;

namespace {

/// Writes Enright's sphere as a level set and as a fog volume.
void storeSphere(const Folder& folder) {
    const auto sphere =
        openvdb::tools::createLevelSetSphere<openvdb::FloatGrid>(0.15f, {0.35f, 0.35f, 0.35f}, 1.0f / 32);
    sphere->setName("surface");
    const auto fog = sphere->deepCopy();
    openvdb::tools::sdfToFogVolume(*fog);
    fog->setName("density");
    writeVdb(folder / "sphere.vdb", {sphere});
    writeVdb(folder / "fog.vdb", {fog});
}

const std::string kRead = "-read sphere.vdb ";

} // namespace

TEST_CASE("advectLevelSet action: passes Enright's test", "[app][command]") {
    const Folder folder;
    storeSphere(folder);
    folder.mustRun(kRead + "-enright -advectLevelSet duration=3 steps=60 -write end.vdb end.json");
    const auto report = jsonOf(folder / "end.json")["advect_level_set"];
    CHECK(std::abs(report["volume_change"].get<double>()) < 1e-3);
    CHECK(report["stalled"] == 0);
    const auto grids = readVdb(folder / "end.vdb");
    REQUIRE(grids.size() == 1);
    CHECK(grids[0]->getName() == "surface");
    CHECK(grids[0]->getGridClass() == openvdb::GRID_LEVEL_SET);
    // Backward, from a time other than 0.
    folder.mustRun(kRead +
                   "-enright -advectLevelSet duration=0.4 steps=10 -advectLevelSet begin=0.4 duration=-0.4 steps=10 "
                   "-write back.json");
    CHECK(std::abs(jsonOf(folder / "back.json")["advect_level_set"]["volume_change"].get<double>()) < 0.05);
    folder.mustRun(kRead + "-enright -advectLevelSet method=weno5 duration=0.1 -write weno.json");
    CHECK(std::abs(jsonOf(folder / "weno.json")["advect_level_set"]["volume_change"].get<double>()) < 0.05);
}

TEST_CASE("advectLevelSet action: moves a level set along the newest flow and ls2mesh meshes it", "[app][command]") {
    const Folder folder;
    storeSphere(folder);
    folder.mustRun(kRead +
                   "-uniform velocity=1,0,0 -advectLevelSet duration=0.25 steps=1 keep=1 -ls2mesh "
                   "-write moved.ply moved.obj");
    for (const char* name : {"moved.ply", "moved.obj"}) {
        const Mesh mesh = readMesh(folder / name);
        CHECK(topologyOf(mesh).closed());
        for (const auto& p : mesh.points) {
            const double r = (openvdb::Vec3d(p) - openvdb::Vec3d(0.6, 0.35, 0.35)).length();
            if (std::abs(r - 0.15) > 0.1 / 32) FAIL("a point at radius " << r);
        }
    }
    CHECK(test::bytesOf(folder / "moved.ply").starts_with("ply\nformat binary"));
    folder.mustRun(kRead + "-ls2mesh adaptivity=0.5 keep=1 -ls2mesh -write geo=1 adaptive.ply -write geo=0 fine.ply");
    CHECK(readMesh(folder / "adaptive.ply").faces() < readMesh(folder / "fine.ply").faces());
}

TEST_CASE("advectGrid action: moves fog along the newest flow", "[app][command]") {
    const Folder folder;
    storeSphere(folder);
    folder.mustRun("-uniform velocity=1,0,0 -read fog.vdb -advectGrid duration=0.25 steps=1 -write moved.vdb");
    const auto before = openvdb::GridBase::grid<openvdb::FloatGrid>(readVdb(folder / "fog.vdb").at(0));
    const auto after = openvdb::GridBase::grid<openvdb::FloatGrid>(readVdb(folder / "moved.vdb").at(0));
    REQUIRE(after);
    for (auto value = before->cbeginValueOn(); value; ++value)
        REQUIRE(after->tree().getValue(value.getCoord().offsetBy(8, 0, 0)) == Approx(*value).margin(1e-5));
}

TEST_CASE("level set actions: unsuitable inputs are errors that say why", "[app][command]") {
    const Folder folder;
    storeSphere(folder);
    folder.mustFail("-uniform -advectLevelSet", {"-advectLevelSet", "a level set", "none"});
    folder.mustFail(kRead + "-advectLevelSet", {"-advectLevelSet", "flow"});
    folder.mustFail("-read fog.vdb -uniform -advectLevelSet grid=0", {"-advectLevelSet", "level set", "is a grid"});
    folder.mustFail(kRead + "-uniform -advectLevelSet method=magic", {"method", "flowmap"});
    folder.mustFail(kRead + "-uniform -advectLevelSet steps=0", {"steps"});
    folder.mustFail(kRead + "-uniform -advectGrid", {"-advectGrid", "-advectLevelSet"});
    folder.mustFail("-uniform -advectGrid", {"-advectGrid", "no grid"});
    folder.mustFail("-ls2mesh", {"-ls2mesh", "a level set", "none"});
    folder.mustFail(kRead + "-ls2mesh adaptivity=2", {"adaptivity"});
    folder.mustFail(kRead + "-write a.obj", {"-write", "a mesh", "-ls2mesh"});
    folder.mustFail(kRead + "-write a.ply", {"-write", "-ls2mesh"});
}

TEST_CASE("advectLevelSet action: follows a flow from frame to frame and resumes exactly", "[app][command]") {
    const Folder folder;
    storeSphere(folder);
    const std::string flow = GENERATE(as<std::string>(), "-uniform velocity=1,0,0 ",
                                      "-noise frequency=2 'alpha={3*T}' -noise frequency=2 seed=1 -dfvn speed=0.5 ");
    CAPTURE(flow);
    const auto scene = [&](int last, const std::string& more) {
        return kRead + "-frames 1-" + std::to_string(last) + " fps=20 substeps=2 checkpoint=state " + flow +
               "-advectLevelSet " + more + " -write 'f.$F.vdb' 'f.$F.json'";
    };
    folder.mustRun(scene(4, ""));
    const std::string whole = test::bytesOf(folder / "f.4.vdb");
    const auto voxels = jsonOf(folder / "f.4.json")["advect_level_set"]["voxels"].get<double>();
    CHECK(std::abs(jsonOf(folder / "f.4.json")["advect_level_set"]["volume_change"].get<double>()) < 0.02);

    // Equal to a single call, except for where the steps of the flow begin.
    folder.mustRun(kRead + flow + "-advectLevelSet duration=0.15 steps=6 -write once.json");
    CHECK(jsonOf(folder / "once.json")["advect_level_set"]["voxels"].get<double>() ==
          Catch::Approx(voxels).epsilon(0.02));

    // A resumed run gives the same bytes.
    std::filesystem::remove(folder / "f.4.vdb");
    std::filesystem::remove(folder / "state");
    folder.mustRun(scene(3, ""));
    folder.mustRun(scene(4, "") + " -resume");
    CHECK(test::bytesOf(folder / "f.4.vdb") == whole);

    // With a restart at intervals.
    folder.mustRun(scene(4, "restart=0.05").replace(0, 0, "-quiet "));
    CHECK(jsonOf(folder / "f.4.json")["advect_level_set"]["voxels"].get<double>() ==
          Catch::Approx(voxels).epsilon(0.05));
    folder.mustFail(scene(2, "restart=0"), {"restart"});
}
