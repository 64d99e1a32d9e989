// SPDX-License-Identifier: Apache-2.0
#include "curlew/app/language/Program.h"
#include "support/Command.h"
#include "support/SessionCommand.h"

using namespace curlew;
using namespace curlew::app;
using Catch::Matchers::ContainsSubstring;
using test::bytesOf;
using test::Folder;
using test::jsonOf;
using test::Scenes;

namespace {

/// A flow in a ball and points in it, before the frames.
const std::string kBall =
    "-sphere -noise frequency=1.5 -noise frequency=1.5 seed=1 -bound layer=0.2 -dfvn speed=1 -scatter count=200 "
    "seed=3 ";
const std::string kBallScene =
    "sphere\nnoise frequency=1.5\nnoise frequency=1.5 seed=1\nbound layer=0.2\ndfvn speed=1\nscatter count=50 seed=3 "
    "as=seeds\n";

Points pointsIn(const Scenes& scenes, const std::string& name) {
    return test::pointsOf(scenes.session.result(name).value);
}

} // namespace

TEST_CASE("advect loop: the last frame equals the first and single frames equal the sequence", "[app][command]") {
    const Folder folder;
    const std::string loop = "fps=24 -advect loop=0.5 -write '$F.ply' '$F.csv' '$F.vdb' -report loop.json ";
    folder.mustRun(kBall + "-frames 0-24 " + loop);
    for (const char* ending : {".ply", ".csv"}) {
        for (const int frame : {0, 5, 12})
            CHECK(bytesOf(folder / (std::to_string(frame) + ending)) ==
                  bytesOf(folder / (std::to_string(frame + 12) + ending)));
        CHECK(bytesOf(folder / ("0" + std::string(ending))) != bytesOf(folder / ("5" + std::string(ending))));
    }
    const auto report = jsonOf(folder / "loop.json");
    CHECK(report["loop"]["closed"].get<int>() + report["loop"]["faded"].get<int>() == 200);
    CHECK(report["loop"]["closed"].get<int>() > 10);
    CHECK(report["loop"]["pace_min"].get<double>() >= 2.0 / 3);
    CHECK(report["loop"]["pace_max"].get<double>() <= 4.0 / 3);
    CHECK(report["advect"]["outside"] == 0);
    CHECK(bytesOf(folder / "5.csv").substr(0, 40).find("vx,vy,vz,id,fade") != std::string::npos);
    // The metadata of a .vdb file holds the number of its frame; everything else is the same.
    folder.mustRun("-read 5.vdb -write a.vdb");
    folder.mustRun("-read 17.vdb -write b.vdb");
    CHECK(bytesOf(folder / "a.vdb") == bytesOf(folder / "b.vdb"));
    const std::string whole = bytesOf(folder / "17.ply"), wholeVdb = bytesOf(folder / "17.vdb");
    folder.mustRun(kBall + "-frames 17-17 start=0 " + loop);
    CHECK(bytesOf(folder / "17.ply") == whole);
    CHECK(bytesOf(folder / "17.vdb") == wholeVdb);
    folder.mustRun("-read 17.vdb -write read.ply");
    CHECK_THAT(bytesOf(folder / "read.ply"), ContainsSubstring("property float fade"));
    // One of several parts, as on other machines.
    const std::string ninth = bytesOf(folder / "9.ply");
    folder.mustRun(kBall + "-frames 0-24 part=10/25 " + loop);
    CHECK(bytesOf(folder / "9.ply") == ninth);
}

TEST_CASE("advect loop: positions are a function of any time", "[app][command]") {
    const Folder folder;
    folder.mustRun(kBall + "-frames 0-4 fps=10 -advect loop=0.5 -write '$F.ply'");
    folder.mustRun(kBall + "-advect loop=0.5 duration=0.3 -write 'still.ply'");
    CHECK(bytesOf(folder / "still.ply") == bytesOf(folder / "3.ply"));
    folder.mustRun(kBall + "-advect loop=0.5 -write 'zero.ply'");
    CHECK(bytesOf(folder / "zero.ply") == bytesOf(folder / "0.ply"));
    folder.mustRun(kBall + "-frames 1-2 fps=10 -advect loop=0.5 'duration={0.5-T}' -write 'back.$F.ply'");
    CHECK(bytesOf(folder / "back.2.ply") == bytesOf(folder / "4.ply"));
}

TEST_CASE("advect loop: tracks are found once for all frames", "[app]") {
    std::vector<std::string> said;
    Console console({.info = [&](std::string_view line) { said.emplace_back(line); }});
    Scenes scenes({}, console);
    const auto found = [&] {
        return std::count_if(said.begin(), said.end(),
                             [](const std::string& line) { return line.find("closed tracks") != std::string::npos; });
    };
    scenes.run(kBallScene + "frames 0-5 fps=10\nadvect loop=0.7 as=dust\n");
    CHECK(found() == 1);
    const Points last = pointsIn(scenes, "dust");
    // The next run of the session reuses the tracks, as when a user scrubs in a host.
    scenes.runAnew(kBallScene + "frames 4-5 fps=10 start=0\nadvect loop=0.7 as=dust\n");
    CHECK(found() == 1);
    CHECK(pointsIn(scenes, "dust").x == last.x);
    scenes.runAnew(kBallScene + "frames 0-5 fps=10\nadvect loop=0.8 as=dust\n");
    CHECK(found() == 2);
}

TEST_CASE("advect loop: each frame starts from the seeds and later actions use the result", "[app]") {
    std::vector<double> shown;
    Scenes scenes([&](Context& c) { shown.push_back(c.points("points").particles.x[0]); });
    scenes.run(kBallScene + "frames 0-3 fps=10\nadvect loop=0.3\nhere\n");
    REQUIRE(shown.size() == 4);
    CHECK(shown[3] == shown[0]);
    CHECK(shown[1] != shown[0]);
    CHECK(test::pointsOf(scenes.session).x[0] == shown[3]); // after the run, the points of the last frame remain
    CHECK(test::countOf(scenes.session, Kind::points) == 1);
    // With keep=1 the input points remain unchanged.
    shown.clear();
    scenes.runAnew(kBallScene + "frames 0-2 fps=10\nadvect loop=0.3 keep=1 as=round\npush points=seeds\nhere\n");
    CHECK(pointsIn(scenes, "push").x[0] == Approx(3 + pointsIn(scenes, "seeds").x[0]));
}

TEST_CASE("advect loop: scene and JSON round trips keep the graph", "[app]") {
    const Scenes scenes;
    const Graph graph = scenes.graph(kBallScene + "frames 0-3\nadvect loop=0.3\nhere\n");
    const std::string scene = sceneOf(graph), json = app::jsonOf(graph);
    CHECK_THAT(scene, ContainsSubstring("advect duration={T} loop=0.3"));
    CHECK_THAT(scene, !ContainsSubstring("copy"));
    CHECK(sceneOf(scenes.graph(scene)) == scene);
    CHECK(app::jsonOf(scenes.graph(json)) == json);
}

TEST_CASE("advect loop: a JSON graph loops as a sequence and as stills", "[app]") {
    const auto graph = [](const std::string& more) {
        return R"({"nodes": [{"name": "ball", "action": "sphere"},
            {"name": "f", "action": "noise", "options": {"frequency": 1.5}},
            {"name": "n", "action": "noise", "options": {"frequency": 1.5, "seed": 1}},
            {"name": "g", "action": "bound", "options": {"width": 0.2}, "inputs": {"noise": ["n"], "wall": ["ball"]}},
            {"name": "flow", "action": "dfvn", "options": {"speed": 1}, "inputs": {"f": ["f"], "g": ["g"]}},
            {"name": "seeds", "action": "scatter", "options": {"count": 50}, "inputs": {"domain": ["flow"]}},
            {"name": "dust", "action": "advect", "options": {"loop": 0.5},
             "inputs": {"flow": ["flow"], "points": ["seeds"]}}], "wanted": ["dust"])" +
               more + "}";
    };
    Scenes scenes;
    const auto made = [&](const std::string& more) {
        scenes.runAnew(graph(more));
        return pointsIn(scenes, "dust");
    };
    const Points third = made(R"(, "frames": {"words": ["0-3"], "options": {"fps": 10}})");
    CHECK(made(R"(, "frames": {"words": ["3-3"], "options": {"fps": 10, "start": 0}})").x == third.x);
    CHECK(made(R"(, "moment": {"frame": 3, "time": 0.3, "fps": 10})").x == third.x);
    CHECK(made(R"(, "frames": {"words": ["0-8"], "options": {"fps": 10}})").x == third.x);
    CHECK(made("").x != third.x);
}

TEST_CASE("advect loop: unsuitable flows and options are errors that say why", "[app][command]") {
    const Folder folder;
    const std::string loop = " -advect loop=1 -write '$F.ply'", open = "-noise -noise seed=1 -dfvn speed=1 -scatter ";
    folder.mustFail(open + "-frames 1-2" + loop, {"-advect", "no wall", "bound"});
    folder.mustFail(kBall + "-frames 1-2 -sphere -noise 'alpha={T}' -noise seed=1 -bound -dfvn" + loop,
                    {"-advect", "steady", "changes with time"});
    folder.mustFail(kBall + "-frames 1-2 -sphere radius=0.2 -emit" + loop, {"-advect", "points that stay", "-frames"});
    folder.mustFail(kBall + "-advect loop=1 reproject=none", {"-advect", "reprojection"});
    folder.mustFail(kBall + "-advect loop=0", {"loop=0"});
    for (const char* without : {"steps=3", "dt=0.1", "scheme=rk4", "maxStep=1", "jacobian=3", "pathlines=1"})
        folder.mustFail(kBall + "-advect loop=1 " + without, {"no effect if loop= is given"});
}

TEST_CASE("frames: with start= a chunk has the bytes of the whole sequence", "[app][command]") {
    const Folder folder;
    const std::string flow = "fps=8 -noise 'alpha={2*pi*T}' -noise seed=1 -dfvn speed=1 -slice width=16 ";
    const std::string write = "-write '$F.png' -scatter count=20 -write '$F.csv'";
    folder.mustRun("-frames 1-6 " + flow + write);
    const std::string picture = bytesOf(folder / "4.png"), points = bytesOf(folder / "4.csv");
    CHECK(bytesOf(folder / "1.png") != picture);
    folder.mustRun("-frames 4-5 start=1 " + flow + write);
    CHECK(bytesOf(folder / "4.png") == picture);
    CHECK(bytesOf(folder / "4.csv") == points);
    folder.mustRun("-frames 4-5 " + flow + write); // without start=, T is 0 in the first frame
    CHECK(bytesOf(folder / "4.png") == bytesOf(folder / "1.png"));
}

TEST_CASE("frames: carried points cannot start in the middle without a checkpoint", "[app][command]") {
    const Folder folder;
    const std::string rest = "fps=8 checkpoint=c -advect -write '$F.ply'";
    folder.mustFail(kBall + "-frames 4-6 start=1 " + rest,
                    {"start=1", "-advect carries", "checkpoint", "-resume", "loop="});
    folder.mustRun(kBall + "-frames 1-6 " + rest);
    const std::string fifth = bytesOf(folder / "5.ply"), sixth = bytesOf(folder / "6.ply");
    folder.shell("rm c 5.ply 6.ply");
    folder.mustFail(kBall + "-frames 5-6 start=1 " + rest + " -resume", {"start=1", "checkpoint"});
    folder.mustRun(kBall + "-frames 1-4 " + rest);
    folder.mustFail(kBall + "-frames 6-6 start=1 " + rest + " -resume", {"start=1", "checkpoint"});
    folder.mustRun(kBall + "-frames 5-6 start=1 " + rest + " -resume");
    CHECK(bytesOf(folder / "5.ply") == fifth);
    CHECK(bytesOf(folder / "6.ply") == sixth);
    folder.mustFail(kBall + "-frames 4-6 start=5 " + rest, {"start=5", "first frame"});
    folder.mustFail(kBall + "-frames 4-6x2 start=1 " + rest, {"start=1", "begin with 5"});
}
