// SPDX-License-Identifier: Apache-2.0
// Longer than 400 lines: the command as users run it, with one fixture for all.
#include "curlew/app/Version.h"
#include "curlew/app/actions/Actions.h"
#include "curlew/picture/ImageFile.h"
#include "curlew/vdb/Openvdb.h"
#include "curlew/vdb/PointFile.h"
#include "curlew/vdb/VdbFile.h"
#include "support/Catch.h"
#include "support/Command.h"

#include <fmt/format.h>

using namespace curlew;
using Catch::Matchers::ContainsSubstring;
using Catch::Matchers::StartsWith;
using test::Folder;
using test::store;
namespace fs = std::filesystem;

// Tests of the command as users run it: as a process, with files, streams and an exit status.

namespace {

/// A closed unit sphere made of quads: the six faces of a cube, projected onto the sphere.
std::string ball(int n = 16) {
    std::string text;
    for (int face = 0; face < 6; ++face) {
        const int axis = face / 2, sign = face % 2 ? -1 : 1;
        const int u = (axis + (sign > 0 ? 1 : 2)) % 3, v = (axis + (sign > 0 ? 2 : 1)) % 3;
        for (int i = 0; i < n * n; ++i) {
            for (const auto& [x, y] : {std::pair(0, 0), {1, 0}, {1, 1}, {0, 1}}) {
                Vec3d p;
                p[axis] = sign * n;
                p[u] = 2 * (i % n + x) - n;
                p[v] = 2 * (i / n + y) - n;
                p = p * (1 / length(p));
                text += fmt::format("v {:.9g} {:.9g} {:.9g}\n", p[0], p[1], p[2]);
            }
            text += "f -4 -3 -2 -1\n";
        }
    }
    return text;
}

/// Writes a sphere of quads or the cow of the scenes.
void storeMesh(const Folder& folder, const std::string& name) {
    if (name == "ball")
        store(folder / "mesh.obj", ball());
    else
        fs::copy_file(fs::path(test::sourceDir()) / "scenes/spot.obj", folder / "mesh.obj");
}

const std::vector<std::string> kMeshes{"ball", "spot"};

const std::string kFlow =
    "-read mesh.obj -mesh2ls dim=64 -noise type=psrd frequency=3 octaves=2 seed=1 "
    "-noise type=psrd frequency=3 octaves=2 seed=2 -bound layer=0.1 -dfvn speed=1 ";

/// A flow without a wall, which is fast to compute.
const std::string kSmall = "-noise seed=1 -noise seed=2 -dfvn ";

bool installed(const std::string& tool) {
    if (std::system(("command -v " + tool + " >/dev/null 2>&1").c_str()) == 0) return true;
    WARN("skipped: " << tool << " is not installed");
    return false;
}

} // namespace

TEST_CASE("command: the main job gives velocities and points that conform to a mesh", "[app][command]") {
    for (const auto& name : kMeshes) {
        CAPTURE(name);
        const Folder folder;
        storeMesh(folder, name);
        folder.mustRun(kFlow +
                       "-velocity voxel=0.03 name=vel -write vel.vdb -scatter count=5000 seed=7 "
                       "-advect duration=2 steps=20 scheme=rk4 reproject=gauss-newton -write points.vdb points.ply "
                       "-check report=report.json samples=5000");
        const auto report = test::jsonOf(folder / "report.json");
        for (const char* figure :
             {"divergence_analytic", "divergence_grid", "wall_flux", "outside", "penetration_max", "drift_f", "drift_g",
              "not_converged", "points", "voxels", "seconds", "peak_memory_bytes"}) {
            CAPTURE(figure);
            REQUIRE(report.contains(figure));
            REQUIRE(report[figure].is_number());
        }
        CHECK(report["divergence_analytic"] <= 1e-6);
        CHECK(report["divergence_analytic_beyond_wall_layer"] <= 1e-9);
        CHECK(report["wall_flux"] <= 1e-6);
        CHECK(report["wall_samples"] > 100); // enough samples for the flux to be meaningful
        CHECK(report["outside"] == 0);
        CHECK(report["penetration_max"] <= 0);
        CHECK(report["drift_f"] <= 1e-6);
        CHECK(report["drift_g"] <= 1e-6);
        CHECK(report["not_converged"] <= 1e-4 * 5000);
        CHECK(report["points"] == 5000);
        CHECK(report["voxels"] > 10000);
        CHECK(report["seconds"] > 0);
        CHECK(report["peak_memory_bytes"] > 1e6);

        CHECK(folder.names() ==
              std::set<std::string>{"mesh.obj", "vel.vdb", "points.vdb", "points.ply", "report.json"});
        const auto grids = readVdb(folder / "vel.vdb");
        REQUIRE(grids.size() == 1);
        CHECK(grids[0]->activeVoxelCount() == report["voxels"]);
        const auto points =
            openvdb::GridBase::grid<openvdb::points::PointDataGrid>(readVdb(folder / "points.vdb").at(0));
        REQUIRE(points);
        CHECK(pointsOf(*points).size() == 5000);
    }
}

TEST_CASE("command: reprojection prevents crossing the wall even with three Euler steps", "[app][command]") {
    for (const auto& name : kMeshes) {
        CAPTURE(name);
        const Folder folder;
        storeMesh(folder, name);
        const auto outside = [&](const std::string& reproject) {
            folder.mustRun(kFlow + "-scatter count=2000 seed=7 -advect duration=2 steps=3 scheme=euler reproject=" +
                           reproject + " -check report=report.json samples=1000");
            return test::jsonOf(folder / "report.json")["outside"].get<int>();
        };
        CHECK(outside("gauss-newton") == 0);
        CHECK(outside("none") > 100);
    }
}

TEST_CASE("command: a staggered grid is divergence-free to rounding and a collocated one is not", "[app][command]") {
    const Folder folder;
    storeMesh(folder, "ball");
    const auto divergence = [&](const std::string& staggered) {
        folder.mustRun(kFlow + "-velocity voxel=0.04 staggered=" + staggered +
                       " -check report=report.json samples=1000");
        return test::jsonOf(folder / "report.json")["divergence_grid"].get<double>();
    };
    CHECK(divergence("1") <= 1e-6);
    CHECK(divergence("0") > 1e-3);
}

TEST_CASE("command: check strict=1 fails if a guarantee is violated", "[app][command]") {
    const Folder folder;
    const std::string job =
        "-quiet -sphere -noise seed=1 frequency=2 -noise seed=2 frequency=2 -bound -dfvn speed=1 "
        "-scatter count=500 -advect steps=2 scheme=euler reproject=";
    CHECK(folder.run(job + "gauss-newton -check samples=500 strict=1").status == 0);
    const auto outcome = folder.run(job + "none -check samples=500 strict=1");
    CHECK(outcome.status == 1);
    CHECK_THAT(outcome.err, ContainsSubstring("curlew: -check: outside is"));
}

TEST_CASE("check: warns of a grid that is far faster than the flow", "[app][command]") {
    const Folder folder;
    const auto said = [&](const std::string& gridSpeed) {
        return folder
            .mustRun("-noise -noise seed=1 -dfvn speed=" + gridSpeed + " -velocity dim=16 -noise -noise seed=1 " +
                     "-dfvn speed=1 -check samples=500 -expect check/grid_max_speed min=" + gridSpeed)
            .err;
    };
    CHECK_THAT(said("1"), !ContainsSubstring("warning"));
    CHECK_THAT(said("1000"), ContainsSubstring("warning: the fastest voxel of the grid is"));
}

TEST_CASE("command: the same input gives the same bytes for any number of threads", "[app][command]") {
    const Folder folder;
    storeMesh(folder, "ball");
    const std::vector<std::string> names{"vel.vdb",    "half.vdb",  "points.vdb", "points.ply",
                                         "points.csv", "speed.png", "speed.exr"};
    const auto bytes = [&](const std::string& threads) {
        for (const auto& name : names) fs::remove(folder / name);
        folder.mustRun("-quiet -threads " + threads + " -read mesh.obj -mesh2ls dim=32 -noise seed=1 -noise seed=2 " +
                       "-bound layer=0.15 -dfvn speed=1 -velocity voxel=0.06 density=1 -write grid=0,1 vel.vdb " +
                       "-velocity voxel=0.06 staggered=1 half=1 -write half.vdb codec=blosc " +
                       "-scatter count=3000 -advect duration=1 steps=5 -write points.vdb points.ply points.csv " +
                       "-slice width=100 -write speed.png speed.exr");
        std::vector<std::string> all;
        for (const auto& name : names) all.push_back(test::bytesOf(folder / name));
        return all;
    };
    const auto one = bytes("1"), again = bytes("1"), two = bytes("2"), three = bytes("3");
    for (size_t k = 0; k < names.size(); ++k) {
        CAPTURE(names[k]);
        CHECK(one[k].size() > 100);
        // Compare in extra parentheses: Catch would print the strings otherwise.
        CHECK((one[k] == again[k]));
        CHECK((one[k] == two[k]));
        CHECK((one[k] == three[k]));
    }
}

TEST_CASE("command: velocity files follow the conventions of the hosts", "[app][command]") {
    const Folder folder;
    folder.mustRun("-sphere " + kSmall +
                   "-velocity dim=8 name=v density=1 potentials=1 half=1 -write grid=0,1,2,3 all.vdb "
                   "-velocity dim=8 staggered=1 -write mac.vdb -velocity dim=40 -write plain.vdb "
                   "-velocity dim=40 -write half.vdb half=1");
    const auto all = readVdb(folder / "all.vdb");
    std::vector<std::string> names;
    for (const auto& grid : all) {
        names.push_back(grid->getName());
        CAPTURE(grid->getName());
        CHECK(grid->saveFloatAsHalf());
        CHECK(grid->getCreator() == "Curlew"); // Blender would rotate the grid if the creator began with "Houdini"
        CHECK(grid->activeVoxelCount() == all[0]->activeVoxelCount());
    }
    CHECK(names == std::vector<std::string>{"v", "density", "f", "g"});
    CHECK(all[1]->getGridClass() == openvdb::GRID_FOG_VOLUME);
    const auto one = [&](const std::string& file) {
        const auto grids = readVdb(folder / file);
        REQUIRE(grids.size() == 1);
        const auto grid = openvdb::GridBase::grid<openvdb::Vec3SGrid>(grids[0]);
        REQUIRE(grid);
        CHECK(grid->getName() == "vel");
        CHECK(grid->getVectorType() == openvdb::VEC_CONTRAVARIANT_RELATIVE);
        CHECK(grid->background() == openvdb::Vec3s(0));
        CHECK(grid->isInWorldSpace());
        CHECK(grid->getCreator() == "Curlew");
        return grid;
    };
    CHECK(one("mac.vdb")->getGridClass() == openvdb::GRID_STAGGERED);
    CHECK(one("plain.vdb")->getGridClass() ==
          openvdb::GRID_UNKNOWN); // RenderMan and Blender do not support staggered grids
    CHECK_FALSE(one("plain.vdb")->saveFloatAsHalf());
    CHECK(one("half.vdb")->saveFloatAsHalf());
    CHECK(10 * fs::file_size(folder / "half.vdb") < 7 * fs::file_size(folder / "plain.vdb"));
}

TEST_CASE("command: points keep positions and velocities and ids in every file format", "[app][command]") {
    const Folder folder;
    folder.mustRun(kSmall + "-scatter count=300 -advect duration=0.2 steps=2 -write p.vdb p.ply p.csv");
    const auto grid = openvdb::GridBase::grid<openvdb::points::PointDataGrid>(readVdb(folder / "p.vdb").at(0));
    REQUIRE(grid);
    const Points points = pointsOf(*grid);
    REQUIRE(points.size() == 300);
    REQUIRE(points.hasVelocity());
    CHECK_THAT(test::bytesOf(folder / "p.ply"),
               ContainsSubstring("element vertex 300") && ContainsSubstring("property float vx"));
    std::istringstream csv(test::bytesOf(folder / "p.csv"));
    std::string line;
    std::getline(csv, line);
    CHECK(line == "x,y,z,vx,vy,vz,id,f,g");
    for (size_t k = 0; k < points.size(); ++k) {
        std::getline(csv, line);
        double x = 0, vz = 0;
        int id = 0;
        REQUIRE(std::sscanf(line.c_str(), "%lf,%*f,%*f,%*f,%*f,%lf,%d", &x, &vz, &id) == 3);
        CAPTURE(line);
        REQUIRE(id == static_cast<int>(k));
        REQUIRE(points.id[k] == static_cast<int64_t>(k));
        REQUIRE(std::abs(points.x[k] - x) < 1e-6);
        REQUIRE(std::abs(double(points.vz[k]) - vz) < 1e-6);
    }
    // Read the points back.
    const auto outcome = folder.mustRun("-read p.vdb -print -write again.csv");
    CHECK_THAT(outcome.out, ContainsSubstring("300 points, with velocity"));
    CHECK(test::linesIn(test::bytesOf(folder / "again.csv")) == 301);
}

TEST_CASE("command: OpenVDB tools open the written files", "[app][command]") {
    const Folder folder;
    folder.mustRun("-sphere " + kSmall +
                   "-velocity dim=8 density=1 potentials=1 half=1 -write grid=0,1,2,3 vel.vdb "
                   "-velocity dim=8 staggered=1 name=mac -write mac.vdb "
                   "-scatter count=100 -advect duration=0.1 steps=1 -write points.vdb");
    if (installed("vdb_print")) {
        const auto vel = folder.shell("vdb_print -l vel.vdb"), mac = folder.shell("vdb_print -l mac.vdb"),
                   points = folder.shell("vdb_print -l points.vdb");
        CHECK(vel.status == 0);
        for (const char* name : {"Name: vel", "Name: density", "Name: f", "Name: g", "Tree_vec3s_5_4_3",
                                 "Tree_float_5_4_3", "contravariant relative", "class: fog volume",
                                 "is_saved_as_half_float: true", "creator: Curlew", "Background value: [0, 0, 0]"})
            CHECK_THAT(vel.out, ContainsSubstring(name));
        CHECK_THAT(mac.out, ContainsSubstring("Name: mac") && ContainsSubstring("class: staggered"));
        CHECK(points.status == 0);
        CHECK_THAT(points.out, ContainsSubstring("Tree_ptdataidx32_5_4_3"));
    }
    if (installed("vdb_tool")) {
        const auto vel = folder.shell("vdb_tool -read vel.vdb -print 2>&1"),
                   points = folder.shell("vdb_tool -read points.vdb -print 2>&1");
        CHECK(vel.status == 0);
        for (const char* name : {"\"vel\"", "\"density\"", "\"f\"", "\"g\"", "\"vec3s\"", "\"float\""})
            CHECK_THAT(vel.out, ContainsSubstring(name));
        CHECK(points.status == 0);
        CHECK_THAT(points.out, ContainsSubstring("\"points\""));
    }
    if (installed("/usr/bin/python3") && folder.shell("/usr/bin/python3 -c 'import pyopenvdb'").status == 0) {
        store(folder / "show.py",
              "import sys, pyopenvdb as vdb\n"
              "for file in sys.argv[1:]:\n"
              "    grids, _ = vdb.readAll(file)\n"
              "    for g in grids:\n"
              "        print(g.name, type(g).__name__, g.vectorType if g.valueTypeName == 'vec3s' else '-', "
              "g.gridClass,\n"
              "              g.saveFloatAsHalf, g.background, g.creator, sep='; ')\n");
        const auto shown = folder.shell("/usr/bin/python3 show.py vel.vdb mac.vdb");
        CAPTURE(shown.err);
        CHECK(shown.status == 0);
        for (const char* line :
             {"vel; Vec3SGrid; contravariant relative; unknown; True; (0.0, 0.0, 0.0); Curlew\n",
              "density; FloatGrid; -; fog volume; True; 0.0; Curlew\n", "f; FloatGrid; -; unknown; True; 0.0; Curlew\n",
              "g; FloatGrid; -; unknown; True; 0.0; Curlew\n",
              "mac; Vec3SGrid; contravariant relative; staggered; False; (0.0, 0.0, 0.0); Curlew\n"})
            CHECK_THAT(shown.out, ContainsSubstring(line));
    } else {
        WARN("skipped: pyopenvdb is not installed");
    }
}

TEST_CASE("command: pictures have the requested size and channel", "[app][command]") {
    const Folder folder;
    folder.mustRun(kSmall + "-slice show=vx width=64 -write vx.exr vx.png bare.png legend=0 -print");
    const Image exr = readExr(folder / "vx.exr");
    CHECK(exr.width == 64);
    CHECK(exr.channels == std::vector<std::string>{"vx"});
    const auto head = test::bytesOf(folder / "vx.png").substr(0, 8);
    CHECK(head == "\x89PNG\r\n\x1a\n");
}

TEST_CASE("command: help lists all actions and describes each", "[app][command]") {
    const Folder folder;
    CHECK(folder.mustRun("-help").out == app::helpOverview(app::registry()));
    CHECK(folder.mustRun("").out ==
          app::helpOverview(app::registry())); // without arguments, the command prints the overview
    CHECK(folder.mustRun("-help format=markdown").out == app::helpTable(app::registry()));
    std::string names, all;
    for (const auto& action : app::registry()) {
        names += " " + action.name;
        all += app::helpFor(action);
    }
    CHECK(folder.mustRun("-help" + names).out == all);
    CHECK(folder.mustRun("-help -noise").out == app::helpFor(app::findAction(app::registry(), "noise")));
    CHECK(folder.mustRun("-h").out == app::helpOverview(app::registry()));
    CHECK(folder.mustRun("-h -sphere dfvn").out == app::helpFor(app::findAction(app::registry(), "sphere")) +
                                                       app::helpFor(app::findAction(app::registry(), "dfvn")));
    const std::string found = folder.mustRun("-help search=Wavelength").out;
    CHECK_THAT(found, ContainsSubstring("-gyroid") && ContainsSubstring("wavelength=") && !ContainsSubstring("-torus"));
    CHECK_THAT(folder.mustRun("-help search=turbulence").out, ContainsSubstring("billow=")); // a former name
    CHECK_THAT(folder.mustRun("-help search=bunny").out,
               Catch::ContainsSubstring("curlew -read bunny.obj")); // an example
    folder.mustFail("-help search=lacunarty", {"no action, option or example mentions 'lacunarty'", "'lacunarity'"});
    folder.mustFail("-help nosie", {"'-nosie'", "'noise'"});
    const auto list = folder.mustRun("-list");
    CHECK(test::linesIn(list.out) == app::registry().size());
    CHECK(list.err.empty());
    const std::string version = folder.mustRun("-version").out;
    CHECK(folder.mustRun("-v").out == version);
    CHECK_THAT(version, StartsWith(app::versionLine()));
    const std::string commit = app::kCommit;
    CHECK((commit == "unknown" || commit.find_first_not_of("0123456789abcdef") >= 10));
    for (const char* library :
         {"OpenVDB ", "NanoVDB ", "oneTBB ", "Assimp ", "Embree ", "libpng ", "KISS FFT", "Boost "})
        CHECK_THAT(version, ContainsSubstring(library));
}

TEST_CASE("command: quiet and verbose control the output", "[app][command]") {
    const Folder folder;
    const auto quiet = folder.mustRun("-quiet " + kSmall + "-velocity dim=8 -write a.vdb -check samples=100");
    CHECK(quiet.err.empty());
    CHECK(quiet.out.empty());
    const auto normal = folder.mustRun(kSmall + "-velocity dim=8 -write a.vdb");
    CHECK_THAT(normal.err, ContainsSubstring("velocity: 729 active voxels") && ContainsSubstring("wrote a.vdb"));
    CHECK(normal.out.empty());
    const auto verbose = folder.mustRun("-verbose " + kSmall + "-velocity dim=8");
    CHECK_THAT(verbose.err, ContainsSubstring("-noise seed=1: ") && ContainsSubstring(" s, peak memory ") &&
                                ContainsSubstring(" %  -velocity\n"));
    const auto print = folder.mustRun("-sphere " + kSmall + "-velocity dim=8 -print");
    CHECK_THAT(print.out, ContainsSubstring("flow 0: ") && ContainsSubstring("grid 0: 'vel' vec3s") &&
                              ContainsSubstring("field 0: -sphere"));
    folder.mustRun("-quiet " + kSmall + "-check samples=100 -report run.json -write too.json");
    const auto report = test::jsonOf(folder / "run.json");
    CHECK(report["actions"][1]["action"] == "-noise seed=1");
    CHECK(report["check"]["divergence_analytic"] <= 1e-9);
    CHECK(fs::exists(folder / "too.json"));
}

TEST_CASE("command: the demo scene runs from the root of the checkout", "[app][command]") {
    const Folder folder;
    // The scene is parsed and checked but not run, since the input of its first action is missing.
    const auto outcome =
        folder.shell("cd '" + test::sourceDir() + "' && curlew -read missing.obj -config scenes/demo.txt");
    CHECK(outcome.status == 1);
    CHECK_THAT(outcome.err, ContainsSubstring("missing.obj"));
    CHECK(test::linesIn(outcome.err) == 1);
}

TEST_CASE("command: a scene gives the same files as its command line", "[app][command]") {
    const Folder folder;
    store(folder / "a scene.txt", "noise seed=1 # f\nnoise seed=2\ndfvn\nvelocity dim=8\nwrite 'my file.vdb'\n");
    folder.mustRun("-quiet -config 'a scene.txt'");
    folder.mustRun("-quiet " + kSmall + "-velocity dim=8 -write line.vdb");
    CHECK((test::bytesOf(folder / "my file.vdb") == test::bytesOf(folder / "line.vdb")));
}

TEST_CASE("command: expect fails if a figure of the report is out of bounds", "[app][command]") {
    const Folder folder;
    const std::string points = "-set n=50 -sphere -scatter count={2*n} -jitter count={n*2} ";
    folder.mustRun(points + "-expect jitter/points min={n} max={4*n} -report run.json");
    const auto kept = test::jsonOf(folder / "run.json").at("expect").at(0);
    const double found = kept.at("value"), most = kept.at("max");
    CHECK(kept.at("figure") == "jitter/points");
    CHECK(found >= 50);
    CHECK(most == 200);
    folder.mustFail(points + "-expect jitter/points max={n}", {"-expect", "jitter/points is ", "above 50"});
    folder.mustFail(points + "-expect jitter/points min=1e5", {"-expect", "jitter/points is ", "below 100000"});
    folder.mustFail(points + "-expect jitter/point max=1", {"no 'jitter/point'", "did you mean 'points'"});
    folder.mustFail(points + "-expect jitter max=1", {"'jitter' is not a number"});
    folder.mustFail(points + "-expect jitter/points", {"min=, max= or below="});
    const std::string both = "-sphere -scatter count=90 -spacing name=a -scatter count=9000 -spacing name=b ";
    folder.mustRun(both + "-expect b/median below=a/median -report run.json");
    CHECK(test::jsonOf(folder / "run.json").at("expect").at(0).at("below").at("figure") == "a/median");
    folder.mustFail(both + "-expect a/median below=b/median", {"a/median is ", "not below b/median"});
    folder.mustFail(both + "-expect a/median below=a/median", {"not below a/median"});
    folder.mustFail(both + "-expect a/median below=c/median", {"no 'c/median'"});
    folder.mustFail("-set n=1 -set 2=1 -list", {"-set", "2=1"});
    store(folder / "sized.txt", "set scale=2\nnoise frequency={scale}\n");
    folder.mustRun("-quiet -set scale=3 -config sized.txt");
    folder.mustFail("-set scal=3 -config sized.txt", {"nothing uses 'scal'", "'scale'"});
    folder.mustFail("-config sized.txt -set scale=3", {"'scale' is already 2", "before -config"});
}

TEST_CASE("command: file names may contain any characters", "[app][command]") {
    const Folder folder;
    const std::string names = "'a b.csv' ./-dash.csv ./a=b.csv 'ü∂.csv' '#1.csv' \"'q'.csv\" a.b.CSV";
    folder.mustRun("-scatter box=0,0,0,1,1,1 count=10 -write " + names);
    CHECK(folder.names() ==
          std::set<std::string>{"a b.csv", "-dash.csv", "a=b.csv", "ü∂.csv", "#1.csv", "'q'.csv", "a.b.CSV"});
}

TEST_CASE("command: points advected in another flow start a new track", "[app][command]") {
    const Folder folder;
    const std::string ball = "-sphere -noise seed=1 -noise seed=2 -bound -dfvn speed=1 ";
    const std::string go = "-advect duration=0.2 steps=4 ";
    folder.mustRun("-quiet " + ball + "-scatter count=500 " + go + "-noise seed=3 -noise seed=4 -bound -dfvn speed=1 " +
                   go + "-check report=other.json");
    const auto check = test::jsonOf(folder / "other.json");
    CHECK(check["not_converged"] == 0);
    CHECK(check["drift_f"] < 1e-6);
}
