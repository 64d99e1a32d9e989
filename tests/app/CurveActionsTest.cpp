// SPDX-License-Identifier: Apache-2.0
#include "curlew/vdb/Openvdb.h"
#include "curlew/vdb/PointFile.h"
#include "curlew/vdb/VdbFile.h"
#include "support/ProbeCommand.h"

using namespace curlew;
using namespace curlew::test;
using Catch::Matchers::ContainsSubstring;

namespace {

const std::string kFlow = "-sphere -noise frequency=2 -noise frequency=2 seed=1 -bound -dfvn speed=1 ";

size_t linesThatBegin(const std::string& text, const std::string& with) {
    size_t count = 0;
    std::istringstream lines(text);
    for (std::string line; std::getline(lines, line);) count += line.rfind(with, 0) == 0;
    return count;
}

} // namespace

TEST_CASE("trace action: writes curves to every file format", "[app][command]") {
    const Folder folder;
    const Outcome outcome =
        folder.mustRun(kFlow + "-scatter count=60 -trace maxLength=20 -write a.csv a.obj a.ply a.vdb r.json -print");
    CHECK_THAT(outcome.err, ContainsSubstring("trace: 60 streamlines with") && ContainsSubstring("closed"));
    CHECK_THAT(outcome.out, ContainsSubstring("geometry 0: 60 curves"));
    const auto report = jsonOf(folder / "r.json").at("trace");
    const auto vertices = report.at("vertices").get<size_t>();
    const auto closed = report.at("closed").get<size_t>();
    CHECK(report.at("curves") == 60);
    CHECK(closed > 40);
    CHECK(report.at("ends").at("closed") == closed);
    CHECK(report.at("gap_max").get<double>() < 1e-7);
    CHECK(report.at("drift_f_max").get<double>() <= 1e-8);
    CHECK(report.at("drift_g_max").get<double>() <= 1e-8);
    CHECK(report.at("length_max").get<double>() <= 20 * 1.001);

    const Table table = tableOf(folder / "a.csv");
    CHECK(table.header == "curve,vertex,closed,x,y,z,vx,vy,vz,speed,f,g,length");
    REQUIRE(table.rows.size() == vertices);
    size_t outside = 0, markedClosed = 0;
    for (const auto& row : table.rows) {
        outside += !(std::hypot(row[3], row[4], row[5]) < 1);
        markedClosed += row[1] == 0 && row[2] == 1;
    }
    CHECK(outside == 0);
    CHECK(markedClosed == closed);

    const std::string obj = bytesOf(folder / "a.obj");
    CHECK(linesThatBegin(obj, "v ") == vertices);
    CHECK(linesThatBegin(obj, "l ") == 60);
    CHECK_THAT(bytesOf(folder / "a.ply"), ContainsSubstring(fmt::format("element edge {}\n", vertices - 60 + closed)));
    const auto grid = openvdb::gridPtrCast<openvdb::points::PointDataGrid>(readVdb(folder / "a.vdb").at(0));
    REQUIRE(grid);
    CHECK(grid->getName() == "curves");
    CHECK(pointsOf(*grid).size() == vertices);
}

TEST_CASE("trace action: options take effect", "[app][command]") {
    const Folder folder;
    const std::string seed = "-vortex turns=1 core=0.5 -scatter count=1 box=0.5,0,0,0.6,0.1,0.1 ";
    const auto rows = [&](const std::string& options) {
        folder.mustRun(seed + "-trace " + options + " -write a.csv");
        return tableOf(folder / "a.csv");
    };
    const Table few = rows("step=0.1 maxLength=0.35 turn=90 integrate=both");
    REQUIRE(few.rows.size() == 9);
    CHECK(few.rows.front().back() == Approx(-0.35));
    CHECK(few.rows[4].back() == 0);
    CHECK(few.rows[5].back() == Approx(0.1));
    CHECK(rows("step=0.1 maxLength=0.35 turn=90 integrate=backward").rows.front().back() == Approx(-0.35));
    CHECK(rows("step=0.1 vertices=3 turn=90").rows.size() == 3);
    const Table time = rows("unit=time step=0.01 maxLength=0.05 turn=90");
    CHECK(time.header.substr(time.header.rfind(',')) == ",time");
    CHECK(time.rows.size() == 6);
    CHECK(rows("closure=0 maxLength=9 step=0.1 turn=90").rows.size() == 91); // more than one turn
    CHECK(rows("maxLength=9 step=0.1 turn=90").rows.size() < 60);
    // A smaller angle gives more vertices.
    CHECK(rows("step=0.1 turn=5").rows.size() > rows("step=0.1 turn=90").rows.size());
}

TEST_CASE("write: writes the newest points or curves or the selected ones", "[app][command]") {
    const Folder folder;
    folder.mustRun(kFlow +
                   "-scatter count=5 -trace maxLength=1 -write a.ply -scatter count=7 -write b.ply a.obj -write "
                   "geo=1 c.ply d.vdb -write geo=0 e.vdb");
    CHECK_THAT(bytesOf(folder / "a.ply"), ContainsSubstring("element edge"));
    CHECK_THAT(bytesOf(folder / "b.ply"), ContainsSubstring("element vertex 7\n"));
    CHECK_THAT(bytesOf(folder / "c.ply"), ContainsSubstring("element edge"));
    CHECK(linesThatBegin(bytesOf(folder / "a.obj"), "l ") == 5);
    CHECK(readVdb(folder / "d.vdb").at(0)->getName() == "curves");
    CHECK(readVdb(folder / "e.vdb").at(0)->getName() == "points");
    // If several sets of points exist, the option chooses the seeds.
    folder.mustRun(kFlow + "-scatter count=5 -scatter count=7 -trace maxLength=0.1 geo=1 -write f.obj");
    CHECK(linesThatBegin(bytesOf(folder / "f.obj"), "l ") == 5);
}

TEST_CASE("trace action: flows without tracks and missing inputs", "[app][command]") {
    const Folder folder;
    const Outcome sum = folder.mustRun("-noise -curl shift=10 -scatter count=5 -trace maxLength=1 -write a.csv r.json");
    CHECK_THAT(sum.err, ContainsSubstring("no tracks"));
    CHECK(tableOf(folder / "a.csv").header == "curve,vertex,closed,x,y,z,vx,vy,vz,speed,length");
    CHECK_FALSE(jsonOf(folder / "r.json").at("trace").contains("drift_f_rms"));
    folder.mustFail(kFlow + "-trace", {"-trace", "needs points", "-scatter"});
    folder.mustFail("-scatter box=0,0,0,1,1,1 -trace", {"-trace", "needs a flow", "-dfvn"});
    folder.mustFail(kFlow + "-scatter count=2 -trace closure=0.5", {"-trace", "closure"});
    folder.mustFail(kFlow + "-scatter count=2 -trace step=0", {"-trace", "step"});
    folder.mustFail(kFlow + "-write a.obj", {"-write", "mesh or curves", "-trace"});
    folder.mustFail(kFlow + "-scatter count=2 -trace maxLength=0.1 -scatter count=2 -write geo=1 a.obj",
                    {"-write", "geo=1", "there is 1"});
    folder.mustFail("-noise -curl shift=10 -scatter count=5 -trace reproject=newton", {"-trace", "no tracks"});
}

TEST_CASE("trace action: bytes do not depend on the number of threads", "[app][command]") {
    const Folder folder;
    for (const std::string threads : {"1", "2"})
        folder.mustRun("-threads " + threads + " " + kFlow +
                       "-scatter count=100 -trace integrate=both maxLength=3 -write " + threads + ".csv " + threads +
                       ".vdb");
    CHECK((bytesOf(folder / "1.csv") == bytesOf(folder / "2.csv")));
    CHECK((bytesOf(folder / "1.vdb") == bytesOf(folder / "2.vdb")));
}
