// SPDX-License-Identifier: Apache-2.0
#include "curlew/app/language/Frames.h"
#include "curlew/vdb/Openvdb.h"
#include "curlew/vdb/VdbFile.h"
#include "support/Catch.h"
#include "support/Command.h"
#include "support/SessionCommand.h"

#include <set>

using namespace curlew;
using namespace curlew::app;
using Catch::Matchers::ContainsSubstring;
using test::bytesOf;
using test::Folder;
using test::Scenes;

namespace {

FramePlan planOf(const std::string& words) {
    const Graph graph = graphOfScene("frames " + words + "\nnoise", "plan", {.registry = registry()});
    return framePlanOf(*graph.frameRange);
}

} // namespace

TEST_CASE("FramePlan: reads a range of frames", "[app]") {
    CHECK(planOf("1-4").frames() == std::vector<int>{1, 2, 3, 4});
    CHECK(planOf("7").frames() == std::vector<int>{7});
    CHECK(planOf("0-0").frames() == std::vector<int>{0});
    CHECK(planOf("1-8x3").frames() == std::vector<int>{1, 4, 7});
    CHECK(planOf("10-20 by=5").frames() == std::vector<int>{10, 15, 20});
    CHECK(planOf("1-4").fps == 24);
    CHECK(planOf("1-4").substeps == 1);
    for (const char* words : {"4-1", "-1-4", "a-b", "1-", "-4", "1-2-3", "1-4x", "1-4x0", "1.5-2", "1-99999999999", ""})
        CHECK_THROWS_AS(planOf(words), ValueError);
    CHECK_THROWS_WITH(planOf("4-1"), ContainsSubstring("'4-1'") && ContainsSubstring("backward"));
    CHECK_THROWS_WITH(planOf("1-4x2 by=2"), ContainsSubstring("twice"));
    CHECK_THROWS_WITH(planOf("1-4 fps=0"), ContainsSubstring("fps=0"));
}

TEST_CASE("FramePlan: parts contain every frame once in equal shares", "[app]") {
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
        CHECK_THROWS_WITH(planOf(std::string("1-9 part=") + part), ContainsSubstring("3/8"));
}

TEST_CASE("FramePlan: the clock has zero duration in the first frame and one step in each later frame", "[app]") {
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
    // Times between frames have fractional frame numbers.
    CHECK(fourth.moment().frame == 107);
    CHECK(fourth.moment(fourth.begin).frame == Approx(105));
    CHECK(fourth.moment(0.22).frame == Approx(106.5));
    CHECK(fourth.moment(0.22).time == 0.22);
    CHECK(fourth.moment(0.22).fps == 25);
    // If the starting frame is given, a chunk has the clock of the whole sequence.
    const FrameClock chunk = planOf("107-140x2 fps=25 substeps=3 start=101").firstClock();
    CHECK(chunk.frame == 107);
    CHECK(chunk.time == fourth.time);
    CHECK(chunk.begin == fourth.begin);
    CHECK(chunk.duration == fourth.duration);
    CHECK(planOf("107-140x2 start=101").startClock().duration == 0);
    CHECK(planOf("107-140x2 start=101 fps=25").clockAt(2 / 25.0).frame == 103);
    // A part has the clock of the whole sequence.
    CHECK(planOf("101-140x2 fps=25 part=2/3").clock(107).time == fourth.time);
}

TEST_CASE("FramePlan: a time belongs to the frame that ends at or after it", "[app]") {
    const FramePlan plan = planOf("101-105x2 fps=10");
    CHECK(plan.firstClock().frame == 101);
    CHECK(plan.clockAt(0).frame == 101);
    CHECK(plan.clockAt(0.01).frame == 103);
    CHECK(plan.clockAt(0.2).frame == 103);
    CHECK(plan.clockAt(0.2 + 1e-12).frame == 103); // rounding is tolerated
    CHECK(plan.clockAt(0.21).frame == 105);
    CHECK(plan.clockAt(-1).frame == 101);
    CHECK(plan.clockAt(9).frame == 107);
}

TEST_CASE("frames: actions before the frames run once and their results stay in every frame", "[app]") {
    std::vector<int> frames;
    std::vector<double> times, firstPoint;
    std::vector<size_t> fields, points;
    int before = 0;
    Scenes scenes([&](Context& c) {
        if (!c.clock()) {
            ++before;
            return;
        }
        frames.push_back(c.clock()->frame);
        times.push_back(c.clock()->time);
        size_t flows = 0, images = 0, sets = 0, functions = 0;
        for (size_t k = 0; k < c.count("what"); ++k) {
            const Kind kind = kindOf(c.value("what", k));
            flows += kind == Kind::flow, images += kind == Kind::image, sets += kind == Kind::points;
            functions += accepts(Kind::field, kind);
        }
        CHECK(flows == 1); // the flow of the previous frame is gone
        CHECK(images == 1);
        fields.push_back(functions), points.push_back(sets);
        CHECK(c.points("points").particles.size() == 20); // the newest
        for (size_t k = 0; k < c.count("what"); ++k) {
            const auto* carried = std::get_if<PointsPointer>(&c.value("what", k));
            if (carried && (*carried)->particles.size() == 10) firstPoint.push_back((*carried)->particles.x[0]);
        }
    });
    scenes.run(
        "sphere\nnoise seed=1\nscatter count=10 as=dust\nhere\nframes 3-9x3 fps=10\n"
        "noise seed=2\ndfvn\npush points=dust\nscatter count=20\nslice width=8\nhere");
    CHECK(before == 1);
    CHECK(frames == std::vector<int>{3, 6, 9});
    CHECK(times == std::vector<double>{0, 0.3, 0.6});
    CHECK(fields == std::vector<size_t>{1, 1, 1}); // the noise that -dfvn consumes is back in the next frame
    CHECK(points == std::vector<size_t>{2, 2, 2});
    REQUIRE(firstPoint.size() == 3);
    CHECK(firstPoint[1] == firstPoint[0] + 1); // a frame starts with the points of the previous one
    CHECK(firstPoint[2] == firstPoint[1] + 1);
    CHECK(test::countOf(scenes.session, Kind::points) == 1); // the points that the frames have carried remain
    CHECK(test::pointsOf(scenes.session).x[0] == firstPoint[2]);
}

TEST_CASE("frames: meshes and level sets from before the frames are available in every frame", "[app]") {
    const std::string mesh = test::sourceDir() + "/scenes/spot.obj";
    std::vector<openvdb::GridBase::ConstPtr> atFirst;
    Scenes scenes([&](Context& c) {
        CHECK(c.count("what") == 3);
        for (size_t k = 0; k < c.count("what"); ++k)
            if (const auto* grid = std::get_if<GridValue>(&c.value("what", k))) atFirst.push_back(grid->grid);
    });
    scenes.run("read '" + mesh + "'\nread '" + mesh +
               "'\nmesh2ls dim=16 keep=1\nframes 1-3\nhere\nmesh2ls dim=12\nnoise\nnoise seed=1\n"
               "bound layer=1 grid=1\ndfvn");
    REQUIRE(atFirst.size() == 3); // the mesh that -mesh2ls consumes is back in the next frame
    CHECK(atFirst[1] == atFirst[0]);
    CHECK(atFirst[2] == atFirst[0]);
}

TEST_CASE("frames: an error names its frame and a second block of frames is refused", "[app]") {
    Scenes scenes;
    CHECK_THAT(scenes.complaint("frames 4-9\nsphere radius={2-T*24}"),
               ContainsSubstring("frame 6: ") && ContainsSubstring("-sphere: radius={2-T*24}, which is 0"));
    CHECK_THAT(scenes.complaint("frames 1-2\nnoise\nframes 1-2\nnoise"), ContainsSubstring("twice"));
    CHECK_THAT(scenes.complaint("noise\nframes 1-2"),
               ContainsSubstring("-frames") && ContainsSubstring("needs actions after it"));
    CHECK_THAT(scenes.complaint("frames 1-2\nnoise\nslice width=4\nwrite missing/too/a.$F.png"),
               ContainsSubstring("missing/too/a.1.png"));
    CHECK_THAT(scenes.complaint("noise\nresume"), ContainsSubstring("-frames"));
    CHECK_THAT(scenes.complaint("resume\nframes 1-2\nnoise"), ContainsSubstring("checkpoint="));
    for (const std::string name : {"-", "/dev/null"})
        CHECK_THAT(scenes.complaint("frames 1-2 checkpoint=" + name + "\nnoise\nslice"),
                   ContainsSubstring("checkpoint=" + name + " must be a file"));
}

TEST_CASE("frames: frames that carry state cannot be split into parts", "[app]") {
    Scenes scenes;
    const auto complaint = [&](const std::string& block) {
        return scenes.complaint("noise\nnoise seed=1\ndfvn\nscatter count=10\nframes 1-4 part=2/2\n" + block);
    };
    for (const char* moves : {"advect steps=1", "emit", "kill box=0,0,0,1,1,1", "wrap box=0,0,0,1,1,1"}) {
        CAPTURE(moves);
        CHECK_THAT(complaint(moves), ContainsSubstring("part=") && ContainsSubstring("from frame to frame"));
    }
    CHECK_THAT(complaint("scatter count=10\nadvect steps=1"), ContainsSubstring("nothing is wrong"));
    CHECK_THAT(complaint("noise"), ContainsSubstring("nothing is wrong"));
    CHECK_THAT(scenes.complaint("frames 1-2 part=3/3\nnoise"), ContainsSubstring("part=3/3"));
}

TEST_CASE("frames: tracing streamlines does not stop the advection of particles", "[app]") {
    const auto positions = [](const std::string& trace) {
        Scenes scenes;
        std::vector<std::vector<double>> frames;
        scenes.session.onFrame = [&](int) { frames.push_back(test::pointsOf(scenes.session.result("dust").value).x); };
        scenes.run(
            R"({"nodes": [{"name": "f", "action": "noise"}, {"name": "g", "action": "noise", "options": {"seed": 1}},
            {"name": "wind", "action": "dfvn", "inputs": {"f": ["f"], "g": ["g"]}},
            {"name": "seeds", "action": "scatter", "options": {"count": 9}, "inputs": {"domain": ["wind"]}},)" +
            trace +
            R"({"name": "dust", "action": "advect", "inputs": {"flow": ["wind"], "points": ["seeds"]}}],
            "frames": {"words": ["1-3"]}})");
        return frames;
    };
    const auto alone = positions("");
    const auto beside = positions(
        R"({"name": "lines", "action": "trace", "options": {"limit": 0.1}, "when": "frame",
            "inputs": {"flow": ["wind"], "points": ["seeds"]}},)");
    REQUIRE(alone.size() == 3);
    CHECK(alone[0] != alone[1]);
    CHECK(alone[1] != alone[2]);
    CHECK(beside == alone);
    CHECK(positions(R"({"name": "lines", "action": "trace", "options": {"limit": 0.1},
            "inputs": {"flow": ["wind"], "points": ["seeds"]}},)") == alone);
}

TEST_CASE("frames: two nodes that move points each have their own state", "[app]") {
    Scenes scenes;
    scenes.run(
        "sphere\nscatter count=3 as=a\nscatter count=5 as=b\nframes 1-3\npush points=a\npush points=b\npush points=b");
    const auto xOf = [&](size_t age) { return test::pointsOf(scenes.session, age).x[0]; };
    const double moved[2] = {xOf(1), xOf(0)};
    scenes.runAnew("sphere\nscatter count=3\nscatter count=5");
    CHECK(moved[0] == Approx(xOf(1) + 3));
    CHECK(moved[1] == Approx(xOf(0) + 6));
}

TEST_CASE("frames: each frame of a velocity sequence equals a single run at its time", "[app][command]") {
    const Folder folder;
    const auto scene = [](const std::string& t, const std::string& name) {
        return "-noise alpha='" + t + "' -noise seed=1 -dfvn -velocity dim=16 -write '" + name + "'";
    };
    const auto velocityIn = [&](const std::string& file) {
        return openvdb::gridPtrCast<openvdb::Vec3SGrid>(readVdb(folder / file).front());
    };
    const auto outcome = folder.mustRun("-frames 5-9x2 fps=10 " + scene("{2*pi*T}", "v.$F4.vdb"));
    CHECK(folder.names() == std::set<std::string>{"v.0005.vdb", "v.0007.vdb", "v.0009.vdb"});
    CHECK_THAT(outcome.err, ContainsSubstring("frame 5, 1 of 3") && ContainsSubstring("frame 9, 3 of 3"));
    for (int k = 0; k < 3; ++k) {
        const std::string frame = fmt::format("{:04}.vdb", 5 + 2 * k);
        folder.mustRun("-quiet " + scene(fmt::format("{{2*pi*{}/10}}", 2 * k), "one.vdb"));
        const auto one = velocityIn("one.vdb"), sequence = velocityIn("v." + frame); // only this has frame and fps
        REQUIRE(one->activeVoxelCount() == sequence->activeVoxelCount());
        size_t different = 0;
        for (auto value = one->cbeginValueOn(); value; ++value)
            if (sequence->tree().getValue(value.getCoord()) != *value) ++different;
        CHECK(different == 0);
        folder.mustRun(fmt::format("-quiet -frames {0}-{0} start=5 fps=10 ", 5 + 2 * k) +
                       scene("{2*pi*T}", "alone.$F4.vdb"));
        CHECK((bytesOf(folder / ("alone." + frame)) == bytesOf(folder / ("v." + frame))));
    }
    // In two parts.
    for (int part = 1; part <= 2; ++part)
        folder.mustRun(fmt::format("-quiet -frames 5-9x2 fps=10 part={}/2 ", part) + scene("{2*pi*T}", "p.$F4.vdb"));
    for (const char* frame : {"0005", "0007", "0009"})
        CHECK((bytesOf(folder / (std::string("v.") + frame + ".vdb")) ==
               bytesOf(folder / (std::string("p.") + frame + ".vdb"))));
}

TEST_CASE("report: lists each action once with its time over all frames", "[app][command]") {
    const Folder folder;
    folder.mustRun("-noise -frames 1-5 -noise seed={F} -report run.json");
    const auto report = test::jsonOf(folder / "run.json");
    std::vector<std::string> actions;
    for (const auto& one : report["actions"]) actions.push_back(one["action"]);
    CHECK(actions == std::vector<std::string>{"-noise", "-noise seed={F}", "-report run.json"});
    CHECK(report["frames"] == 4); // the report is written before the last frame ends
}
