#include "curlew/app/Frames.h"
#include "curlew/app/Program.h"
#include "curlew/vdb/VdbFile.h"
#include "support/Command.h"
#include "support/Points.h"

#include <catch2/catch.hpp>
#include <openvdb/tools/LevelSetSphere.h>

using namespace curlew;
using namespace curlew::app;
using Catch::Matchers::Contains;
using test::bytesOf;
using test::Folder;

namespace {

FramePlan planOf(const std::string& words) {
    return framePlanOf(parseScene("frames " + words, "plan").actions.front());
}

Console& silent() {
    static Console console(nullptr);
    console.setVerbosity(Verbosity::quiet);
    return console;
}

/// The program of a scene in which the action `here` calls `look`.
struct Spy {
    Action action;
    Program program;

    Spy(const std::string& scene, std::function<void(Session&)> look)
        : action{.name = "here", .group = "points", .run = [look = std::move(look)](Session& s, const Arguments&) {
                     look(s);
                 }} {
        std::string part;
        for (const auto& line : split(scene)) {
            if (line != "here") {
                for (const auto& one : parseScene(line, "scene").actions) program.actions.push_back(one);
                continue;
            }
            program.actions.emplace_back(action);
        }
    }

    static std::vector<std::string> split(const std::string& text) {
        std::vector<std::string> lines;
        std::istringstream in(text);
        for (std::string line; std::getline(in, line);) lines.push_back(line);
        return lines;
    }
};

/// Runs the scene, calling `look` at each line `here`.
void runWith(const std::string& scene, std::function<void(Session&)> look) {
    const Spy spy(scene, std::move(look));
    Session session(silent());
    run(spy.program, session);
}

/// Velocities at some positions.
std::vector<Vec3d> velocitiesOf(const Flow& flow) {
    std::vector<Vec3d> velocities;
    for (uint64_t k = 0; k < 40; ++k) velocities.push_back(flow.at(test::randomPoint(test::cube(0.9), 11, k)).velocity);
    return velocities;
}

} // namespace

TEST_CASE("frames are read from a range", "[app]") {
    CHECK(planOf("1-4").frames() == std::vector<int>{1, 2, 3, 4});
    CHECK(planOf("7").frames() == std::vector<int>{7});
    CHECK(planOf("0-0").frames() == std::vector<int>{0});
    CHECK(planOf("1-8x3").frames() == std::vector<int>{1, 4, 7});
    CHECK(planOf("10-20 by=5").frames() == std::vector<int>{10, 15, 20});
    CHECK(planOf("1-4").fps == 24);
    CHECK(planOf("1-4").substeps == 1);
    for (const char* words : {"4-1", "-1-4", "a-b", "1-", "-4", "1-2-3", "1-4x", "1-4x0", "1.5-2", "1-99999999999", ""})
        CHECK_THROWS_AS(planOf(words), ValueError);
    CHECK_THROWS_WITH(planOf("4-1"), Contains("'4-1'") && Contains("backward"));
    CHECK_THROWS_WITH(planOf("1-4x2 by=2"), Contains("twice"));
    CHECK_THROWS_WITH(planOf("1-4 fps=0"), Contains("fps=0"));
}

TEST_CASE("the parts have every frame once, and about as many each", "[app]") {
    for (const int parts : {1, 2, 3, 8}) {
        std::set<int> seen;
        for (int part = 1; part <= parts; ++part) {
            const auto frames = planOf(fmt::format("5-24x2 part={}/{}", part, parts)).frames();
            CAPTURE(part, parts);
            CHECK(frames.size() >= static_cast<size_t>(10 / parts));
            CHECK(frames.size() <= static_cast<size_t>(10 / parts + 1));
            for (const int frame : frames) CHECK(seen.insert(frame).second);
        }
        CHECK(seen.size() == 10);
    }
    for (const char* part : {"0/3", "4/3", "1", "1/0", "a/b", "1/2/3", "-1/3", ""})
        CHECK_THROWS_WITH(planOf(std::string("1-9 part=") + part), Contains("3/8"));
}

TEST_CASE("the clock of a frame: nothing moves in the first, then a frame's time in each", "[app]") {
    const FramePlan plan = planOf("101-140x2 fps=25 substeps=3");
    const FrameClock first = plan.clock(101), fourth = plan.clock(107);
    CHECK(first.frame == 101);
    CHECK(first.time == 0);
    CHECK(first.begin == 0);
    CHECK(first.duration == 0);
    CHECK(fourth.time == 6 / 25.0);
    CHECK(fourth.begin == 4 / 25.0);
    CHECK(fourth.duration == 2 / 25.0);
    CHECK(fourth.substeps == 3);
    for (const int frame : {103, 105, 107, 139}) CHECK(plan.clock(frame).begin == plan.clock(frame - 2).time);
    // The frame of a time between frames.
    CHECK(fourth.moment().frame == 107);
    CHECK(fourth.moment(fourth.begin).frame == Approx(105));
    CHECK(fourth.moment(0.22).frame == Approx(106.5));
    CHECK(fourth.moment(0.22).time == 0.22);
    CHECK(fourth.moment(0.22).fps == 25);
    // A part has the clock of the whole.
    CHECK(planOf("101-140x2 fps=25 part=2/3").clock(107).time == fourth.time);
}

TEST_CASE("what stands before the frames runs once, and stays as it is in every frame", "[app]") {
    std::vector<int> frames;
    std::vector<double> times;
    std::vector<size_t> fields, points;
    std::vector<double> firstPoint;
    int before = 0;
    runWith(
        "sphere\nnoise seed=1\nscatter count=10\nhere\nframes 3-9x3 fps=10\n"
        "noise seed=2\ndfvn\nscatter count=20\nslice width=8\nhere",
        [&](Session& s) {
            if (!s.clock) {
                ++before;
                return;
            }
            frames.push_back(s.clock->frame);
            times.push_back(s.clock->time);
            fields.push_back(s.fields.size());
            points.push_back(s.geometry.size());
            CHECK(s.flows.size() == 1); // that of the last frame has gone
            CHECK(s.images.size() == 1);
            CHECK(s.particles().size() == 20);
            Particles& carried = s.particles(1);
            REQUIRE(carried.size() == 10);
            carried.x[0] += 1;
            firstPoint.push_back(carried.x[0]);
        });
    CHECK(before == 1);
    CHECK(frames == std::vector<int>{3, 6, 9});
    CHECK(times == std::vector<double>{0, 0.3, 0.6});
    CHECK(fields == std::vector<size_t>{1, 1, 1}); // the noise that -dfvn takes is back for the next frame
    CHECK(points == std::vector<size_t>{2, 2, 2});
    CHECK(firstPoint[1] == firstPoint[0] + 1); // the points are those that the last frame left
    CHECK(firstPoint[2] == firstPoint[1] + 1);
}

TEST_CASE("meshes and level sets from before the frames are there in every frame", "[app]") {
    const Folder folder;
    const std::string mesh = std::string(CURLEW_SOURCE_DIR) + "/scenes/spot.obj";
    std::vector<openvdb::GridBase::ConstPtr> atFirst;
    runWith("read '" + mesh + "'\nread '" + mesh +
                "'\nmesh2ls dim=16 keep=1\nframes 1-3\nhere\nmesh2ls dim=12\nnoise\nnoise seed=1\n"
                "bound width=1 grid=1\ndfvn",
            [&](Session& s) {
                CHECK(s.geometry.size() == 2);
                CHECK(s.grids.size() == 1);
                atFirst.push_back(s.grids.at().grid); // before its band is widened
            });
    REQUIRE(atFirst.size() == 3);
    CHECK(atFirst[1] == atFirst[0]);
    CHECK(atFirst[2] == atFirst[0]);
}

TEST_CASE("an error in a frame names it, and two blocks of frames are one too many", "[app]") {
    Session session(silent());
    CHECK_THROWS_WITH(run(parseScene("frames 4-9\nsphere radius={2-T*24}", "s"), session),
                      Contains("frame 6: -sphere: radius={2-T*24}, which is 0"));
    CHECK_THROWS_WITH(run(parseScene("frames 1-2\nnoise\nframes 1-2\nnoise", "s"), session), Contains("twice"));
    CHECK_THROWS_WITH(run(parseScene("noise\nframes 1-2", "s"), session), Contains("no action follows"));
    CHECK_THROWS_WITH(run(parseScene("frames 1-2\nwrite missing/a.$F.vdb", "s"), session), Contains("missing/a.1.vdb"));
    CHECK_THROWS_WITH(run(parseScene("noise\nresume", "s"), session), Contains("-frames"));
    CHECK_THROWS_WITH(run(parseScene("resume\nframes 1-2\nnoise", "s"), session), Contains("checkpoint="));
}

TEST_CASE("frames that depend on each other are not split", "[app]") {
    Session session(silent());
    const std::string flow = "noise\nnoise seed=1\ndfvn\n";
    const auto run = [&](const std::string& block) {
        app::run(parseScene(flow + "scatter count=10\nframes 1-4 part=2/2\n" + block, "s"), session);
    };
    for (const char* moves : {"advect steps=1", "emit", "kill box=0,0,0,1,1,1", "wrap box=0,0,0,1,1,1"})
        CHECK_THROWS_WITH(run(moves), Contains("part=") && Contains("from frame to frame"));
    CHECK_NOTHROW(run("scatter count=10\nadvect steps=1"));
    CHECK_NOTHROW(run("noise"));
    CHECK_THROWS_WITH(app::run(parseScene("frames 1-2 part=3/3\nnoise", "s"), session), Contains("part=3/3"));
}

TEST_CASE("a flow in time is, at any time, that of a program with the time written in it", "[app]") {
    const auto scene = [](const std::string& t) {
        return "sphere offset=" + t + ",0,0\nnoise seed=1 alpha={2*pi}\nnoise seed=2 alpha=" + t +
               "\nbound width=0.3\ndfvn speed=2\n";
    };
    const auto still = [&](double t) {
        std::vector<Vec3d> velocities;
        runWith(scene(fmt::format("{}", t)) + "here", [&](Session& s) { velocities = velocitiesOf(s.flow()); });
        return velocities;
    };
    bool seen = false;
    runWith("noise seed=3\nframes 1-2 fps=8\nslice width=8\n" + scene("{T}") + "here", [&](Session& s) {
        const FlowInTime flow = s.flowInTime();
        CHECK_FALSE(flow.steady());
        const size_t fields = s.fields.size(), flows = s.flows.size();
        const uint64_t next = s.nextNow();
        CHECK((velocitiesOf(flow.at(s.clock->time)) == velocitiesOf(s.flow())));
        // More times than are remembered, and some of them twice.
        for (const double t : {0.0, 0.0625, 0.125, 0.3, -0.2, 0.01, 0.02, 0.03, 0.04, 0.05, 0.3, 0.0625}) {
            CAPTURE(t, s.clock->frame);
            CHECK((velocitiesOf(flow.at(t)) == still(t)));
        }
        CHECK(s.fields.size() == fields);
        CHECK(s.flows.size() == flows);
        CHECK(s.nextNow() == next);
        seen = true;
    });
    CHECK(seen);
    // Without frames, time begins at 0.
    runWith(scene("{T}") + "here", [&](Session& s) {
        const FlowInTime flow = s.flowInTime();
        CHECK((velocitiesOf(flow.at(0)) == velocitiesOf(s.flow())));
        CHECK((velocitiesOf(flow.at(0.3)) == still(0.3)));
    });
}

TEST_CASE("between frames F is that of the frame in which the time is, and FF has its fraction", "[app]") {
    const auto scene = [](const std::string& f, const std::string& ff) {
        return "noise seed=" + f + "\nnoise seed=3 alpha=" + ff + "\ndfvn\nhere";
    };
    const auto still = [&](const std::string& f, const std::string& ff) {
        std::vector<Vec3d> velocities;
        runWith(scene(f, ff), [&](Session& s) { velocities = velocitiesOf(s.flow()); });
        return velocities;
    };
    runWith("frames 5-6 fps=10\n" + scene("{F}", "{FF}"), [&](Session& s) {
        if (s.clock->frame == 5) return;
        const FlowInTime flow = s.flowInTime();
        CHECK((velocitiesOf(flow.at(s.clock->begin)) == still("5", "5")));
        CHECK((velocitiesOf(flow.at(0.05)) == still("6", "5.5")));
        CHECK((velocitiesOf(flow.at(s.clock->time)) == still("6", "6")));
    });
}

TEST_CASE("a flow that nothing changes is steady", "[app]") {
    const auto steady = [](const std::string& scene) {
        bool found = true;
        runWith(scene + "\nhere", [&](Session& s) { found = s.flowInTime().steady(); });
        return found;
    };
    CHECK(steady("noise\nnoise seed=1\ndfvn"));
    CHECK(steady("frames 1-2\nnoise alpha={2*pi}\nnoise seed=1\ndfvn"));
    CHECK(steady("noise alpha={T}\nnoise seed=1\ndfvn\nframes 1-2\nnoise seed=3"));    // it has been made once
    CHECK(steady("frames 1-2\nnoise\nnoise seed=1\ndfvn\nscatter seed={F} count=10")); // points are no flow
    CHECK_FALSE(steady("frames 1-2\nnoise alpha={F/24}\nnoise seed=1\ndfvn"));
    CHECK_FALSE(steady("noise alpha={T}\nnoise seed=1\ndfvn"));
    CHECK_THROWS_WITH(steady("noise alpha={T}"), Contains("no flow"));
}

TEST_CASE("a level set that is read in each frame moves from the one before to it", "[app]") {
    const Folder folder;
    for (int frame = 1; frame <= 3; ++frame)
        writeVdb(folder / fmt::format("c.{:04}.vdb", frame),
                 {openvdb::tools::createLevelSetSphere<openvdb::FloatGrid>(
                     1, openvdb::Vec3f(0.1F * static_cast<float>(frame), 0, 0), 0.1F, 3)});
    const std::string read = "read \"" + (folder / "c.$F4.vdb").string() + "\"\n";
    // Where the wall meets the x axis: |d| is small there, so one step of Newton's method is enough.
    const auto surface = [](const Flow& flow) {
        const auto at = flow.domain().wall->sdf.distance.at<1>({{1.2, 0, 0}});
        return 1.2 - at.value / at.gradient[0];
    };
    const std::string block = read + "noise\nnoise seed=1\nbound width=0.2\ndfvn\nslice width=8\nhere";
    int seen = 0;
    std::vector<Vec3d> second;
    runWith("frames 1-3 fps=10\n" + block, [&](Session& s) {
        const int frame = s.clock->frame;
        const FlowInTime flow = s.flowInTime();
        REQUIRE(flow.steady() == (frame == 1));
        ++seen;
        if (frame == 1) return;
        for (const double part : {0.0, 0.25, 0.5, 1.0}) {
            CAPTURE(frame, part);
            // A hundredth of a voxel for the samples of a sphere; the mean of two is off by much less.
            CHECK(surface(flow.at(s.clock->begin + part * s.clock->duration)) ==
                  Approx(1 + 0.1 * (frame - 1 + part)).margin(1e-3));
        }
        CHECK((velocitiesOf(flow.at(s.clock->time)) == velocitiesOf(s.flow())));
        if (frame == 2) second = velocitiesOf(flow.at(0.03));
    });
    CHECK(seen == 3);
    // Whoever has not run the first frame reads its file.
    runWith("frames 1-2 fps=10 part=2/2\n" + block,
            [&](Session& s) { CHECK((velocitiesOf(s.flowInTime().at(0.03)) == second)); });
}

TEST_CASE("what a frame finds at its beginning is that of the last one as it ended", "[app]") {
    // The flow at the time of the frame before is the one that that frame had, walls and all.
    std::vector<std::vector<Vec3d>> newest, earlier;
    runWith("frames 1-4 fps=10\nsphere offset={T},0,0\nnoise alpha={T}\nnoise seed=1\nbound width=0.3\ndfvn\nhere",
            [&](Session& s) {
                newest.push_back(velocitiesOf(s.flow()));
                earlier.push_back(velocitiesOf(s.flowInTime().at(s.clock->begin)));
            });
    REQUIRE(newest.size() == 4);
    for (size_t k = 1; k < 4; ++k) CHECK((earlier[k] == newest[k - 1]));
}

TEST_CASE("a velocity sequence: each frame is that of a program with its time written in it", "[app]") {
    const Folder folder;
    const auto scene = [](const std::string& t, const std::string& name) {
        return "-noise alpha='" + t + "' -noise seed=1 -dfvn -velocity dim=16 -write '" + name + "'";
    };
    const auto outcome = folder.mustRun("-frames 5-9x2 fps=10 " + scene("{2*pi*T}", "v.$F4.vdb"));
    CHECK(folder.names() == std::set<std::string>{"v.0005.vdb", "v.0007.vdb", "v.0009.vdb"});
    CHECK_THAT(outcome.err, Contains("frame 5, 1 of 3") && Contains("frame 9, 3 of 3"));
    for (int k = 0; k < 3; ++k) {
        folder.mustRun("-quiet " + scene(fmt::format("{{2*pi*{}/10}}", 2 * k), "one.vdb"));
        CHECK((bytesOf(folder / "one.vdb") == bytesOf(folder / fmt::format("v.{:04}.vdb", 5 + 2 * k))));
    }
    // In parts.
    for (int part = 1; part <= 2; ++part)
        folder.mustRun(fmt::format("-quiet -frames 5-9x2 fps=10 part={}/2 ", part) + scene("{2*pi*T}", "p.$F4.vdb"));
    for (const char* frame : {"0005", "0007", "0009"})
        CHECK((bytesOf(folder / (std::string("v.") + frame + ".vdb")) ==
               bytesOf(folder / (std::string("p.") + frame + ".vdb"))));
}

TEST_CASE("the report has an action once, with the time of all frames", "[app]") {
    const Folder folder;
    folder.mustRun("-noise -frames 1-5 -noise seed={F} -report run.json");
    const auto report = test::jsonOf(folder / "run.json");
    std::vector<std::string> actions;
    for (const auto& one : report["actions"]) actions.push_back(one["action"]);
    CHECK(actions == std::vector<std::string>{"-noise", "-noise seed={F}", "-report run.json"});
    CHECK(report["frames"] == 4); // the last one is not over when it writes
}
