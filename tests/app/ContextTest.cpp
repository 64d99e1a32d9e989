// SPDX-License-Identifier: Apache-2.0
#include "curlew/app/run/Context.h"
#include "curlew/vdb/VdbFile.h"
#include "support/Catch.h"
#include "support/Command.h"
#include "support/SessionCommand.h"

#include <openvdb/tools/LevelSetSphere.h>

using namespace curlew;
using namespace curlew::app;
using Catch::Matchers::ContainsSubstring;
using test::Folder;
using test::Scenes;
using test::velocitiesOf;

namespace {

/// Runs a scene and calls `look` at each line `here`.
void runWith(const std::string& scene, std::function<void(Context&)> look) { Scenes(std::move(look)).run(scene); }

openvdb::FloatGrid::Ptr ball(float x = 0, float halfWidth = 3) {
    return openvdb::tools::createLevelSetSphere<openvdb::FloatGrid>(1, openvdb::Vec3f(x, 0, 0), 0.1F, halfWidth);
}

} // namespace

// --- inputs

TEST_CASE("Context: inputs are read by name", "[app]") {
    int looked = 0;
    Scenes scenes([&](Context& c) {
        ++looked;
        CHECK(c.count("what") == 3);
        CHECK(c.has("points"));
        CHECK_FALSE(c.has("flow"));
        CHECK(c.points("points").particles.size() == 7);
        CHECK(c.kind("what") == Kind::shape); // the oldest
        CHECK(c.field("what", 1).program == "-noise seed=2");
        CHECK(c.programOf("what", 1) == "-noise seed=2");
        CHECK_THROWS_WITH(c.flow("flow"), ContainsSubstring("nothing is connected to 'flow'"));
        CHECK_THROWS_WITH(c.grid("what", 1), ContainsSubstring("'what' is not a grid"));
        CHECK_THROWS_AS(c.has("wath"), std::logic_error); // a programming error
    });
    scenes.run("sphere\nnoise seed=2\nscatter count=7\nhere");
    CHECK(looked == 1);
}

TEST_CASE("Context: a field's program includes the programs of its inputs", "[app]") {
    Scenes scenes;
    scenes.run("noise seed=1\nnoise seed=2\nsum\nclip");
    CHECK(std::get<FieldValue>(test::valueOf(scenes.session, Kind::field)).program ==
          "-clip of (-sum of (-noise seed=1) and (-noise seed=2))");
}

TEST_CASE("Context: sdf accepts shapes and level sets", "[app]") {
    const auto distanceAt = [](const std::string& scene, double x) {
        double found = 0;
        Scenes scenes([&](Context& c) { found = c.sdf("what", 0).distance.at<0>({{x, 0, 0}}).value; });
        scenes.session.provide("ball", GridValue{ball(0, 10)}, {});
        scenes.run(scene);
        return found;
    };
    CHECK(distanceAt("sphere radius=3 as=s\nhere what=s", 0) == -3);
    CHECK(std::abs(distanceAt("read ball as=b\nsphere radius=3\nhere what=b", 0.9) + 0.1) < 1e-3);
    Scenes scenes([](Context& c) { c.sdf("what", 0); });
    CHECK_THAT(scenes.complaint("noise\nhere"), ContainsSubstring("-here: 'what' is not a shape or level set"));
    CHECK_THAT(scenes.complaint("noise\nnoise seed=1\ndfvn\nvelocity dim=4 as=v\nhere what=v"),
               ContainsSubstring("'vel'") && ContainsSubstring("vec3s"));
}

TEST_CASE("Context: a narrow band is widened once on demand and the grid is unchanged", "[app]") {
    int looked = 0;
    Scenes scenes([&](Context& c) {
        ++looked;
        const auto narrow = c.grid("what").grid;
        CHECK(c.sdf("what", 0.5).reach >= 0.5 - 1e-6);
        CHECK(c.grid("what").grid == narrow);
        const LevelSet wide = c.levelSet("what", 0.5);
        CHECK(wide.grid != narrow);
        CHECK(c.levelSet("what", 0.5).grid == wide.grid);
        CHECK(wide.halfWidth() > levelSetOf(narrow).halfWidth());
    });
    scenes.session.provide("ball", GridValue{ball()}, {});
    scenes.run("read ball\nhere");
    CHECK(looked == 1);
}

// --- flows in time

TEST_CASE("Context: a flow in time equals the flow of a program with that time written in it", "[app]") {
    const auto scene = [](const std::string& t) {
        return "sphere translate=" + t + ",0,0\nnoise seed=1 alpha={2*pi}\nnoise seed=2 alpha=" + t +
               "\nbound layer=0.3\ndfvn speed=2\n";
    };
    const auto still = [&](double t) {
        std::vector<Vec3d> velocities;
        runWith(scene(fmt::format("{}", t)) + "here", [&](Context& c) { velocities = velocitiesOf(c.flow("flow")); });
        return velocities;
    };
    int seen = 0;
    runWith("noise seed=3\nframes 1-2 fps=8\nslice width=8\n" + scene("{T}") + "here", [&](Context& c) {
        const FlowInTime flow = c.flowInTime("flow");
        CHECK_FALSE(flow.steady());
        CHECK((velocitiesOf(flow.at(c.clock()->time)) == velocitiesOf(c.flow("flow"))));
        // More times than the flow caches; some of them occur twice.
        for (const double t : {0.0, 0.0625, 0.125, 0.3, -0.2, 0.01, 0.02, 0.03, 0.04, 0.05, 0.3, 0.0625}) {
            CAPTURE(t, c.clock()->frame);
            CHECK((velocitiesOf(flow.at(t)) == still(t)));
        }
        CHECK((velocitiesOf(flow.at(c.clock()->time)) == velocitiesOf(c.flow("flow"))));
        ++seen;
    });
    CHECK(seen == 2);
    // Without frames, the time is 0.
    runWith(scene("{T}") + "here", [&](Context& c) {
        const FlowInTime flow = c.flowInTime("flow");
        CHECK((velocitiesOf(flow.at(0)) == velocitiesOf(c.flow("flow"))));
        CHECK((velocitiesOf(flow.at(0.3)) == still(0.3)));
    });
}

TEST_CASE("Context: between frames F is the frame that contains the time and FF is fractional", "[app]") {
    const auto scene = [](const std::string& f, const std::string& ff) {
        return "noise seed=" + f + "\nnoise seed=3 alpha=" + ff + "\ndfvn\nhere";
    };
    const auto still = [&](const std::string& f, const std::string& ff) {
        std::vector<Vec3d> velocities;
        runWith(scene(f, ff), [&](Context& c) { velocities = velocitiesOf(c.flow("flow")); });
        return velocities;
    };
    runWith("frames 5-6 fps=10\n" + scene("{F}", "{FF}"), [&](Context& c) {
        if (c.clock()->frame == 5) return;
        const FlowInTime flow = c.flowInTime("flow");
        CHECK((velocitiesOf(flow.at(c.clock()->begin)) == still("5", "5")));
        CHECK((velocitiesOf(flow.at(0.05)) == still("6", "5.5")));
        CHECK((velocitiesOf(flow.at(c.clock()->time)) == still("6", "6")));
    });
}

TEST_CASE("Context: a flow without time dependence is steady", "[app]") {
    const auto steady = [](const std::string& scene) {
        bool found = true;
        runWith(scene + "\nhere", [&](Context& c) { found = c.flowInTime("flow").steady(); });
        return found;
    };
    CHECK(steady("noise\nnoise seed=1\ndfvn"));
    CHECK(steady("frames 1-2\nnoise alpha={2*pi}\nnoise seed=1\ndfvn"));
    CHECK(steady("noise alpha={T}\nnoise seed=1\ndfvn\nframes 1-2\nnoise seed=3")); // made once, before the frames
    CHECK(
        steady("frames 1-2\nnoise\nnoise seed=1\ndfvn\nscatter seed={F} count=10")); // points are not part of the flow
    CHECK_FALSE(steady("frames 1-2\nnoise alpha={F/24}\nnoise seed=1\ndfvn"));
    CHECK_FALSE(steady("noise alpha={T}\nnoise seed=1\ndfvn"));
    CHECK_FALSE(steady("enright")); // for any options
    CHECK_THROWS_WITH(steady("noise alpha={T}"), ContainsSubstring("-here") && ContainsSubstring("'flow'"));
}

TEST_CASE("Context: a flow left by an earlier program is steady", "[app]") {
    Scenes scenes([](Context& c) { CHECK(c.flowInTime("flow").steady()); });
    scenes.run("noise alpha={T}\nnoise seed=1\ndfvn");
    scenes.run("here");
}

TEST_CASE("Context: a level set read in each frame moves from the previous frame to the current one", "[app]") {
    const Folder folder;
    for (int frame = 1; frame <= 3; ++frame)
        writeVdb(folder / fmt::format("c.{:04}.vdb", frame), {ball(0.1F * static_cast<float>(frame))});
    const std::string read = "read \"" + (folder / "c.$F4.vdb").string() + "\"\n";
    // The position of the wall on the x axis. |d| is small there, so one Newton step is enough.
    const auto surface = [](const Flow& flow) {
        const auto at = flow.domain().wall->sdf.distance.at<1>({{1.2, 0, 0}});
        return 1.2 - at.value / at.gradient[0];
    };
    const std::string block = read + "noise\nnoise seed=1\nbound layer=0.2\ndfvn\nslice width=8\nhere";
    int seen = 0;
    std::vector<Vec3d> second;
    runWith("frames 1-3 fps=10\n" + block, [&](Context& c) {
        const int frame = c.clock()->frame;
        const FlowInTime flow = c.flowInTime("flow");
        REQUIRE_FALSE(flow.steady());
        ++seen;
        if (frame == 1) return;
        for (const double part : {0.0, 0.25, 0.5, 1.0}) {
            CAPTURE(frame, part);
            // The margin is a hundredth of a voxel, for the sampling of the sphere. The mean of two level sets adds far
            // less.
            CHECK(surface(flow.at(c.clock()->begin + part * c.clock()->duration)) ==
                  Approx(1 + 0.1 * (frame - 1 + part)).margin(1e-3));
        }
        CHECK((velocitiesOf(flow.at(c.clock()->time)) == velocitiesOf(c.flow("flow"))));
        if (frame == 2) second = velocitiesOf(flow.at(0.03));
    });
    CHECK(seen == 3);
    // A part that has not run the first frame reads that frame's file.
    runWith("frames 1-2 fps=10 part=2/2\n" + block,
            [&](Context& c) { CHECK((velocitiesOf(c.flowInTime("flow").at(0.03)) == second)); });
}

TEST_CASE("Context: the flow at the beginning of a frame is that at the end of the previous one", "[app]") {
    // The flow at the time of the previous frame equals the flow that this frame had, including its walls.
    std::vector<std::vector<Vec3d>> newest, earlier;
    runWith("frames 1-4 fps=10\nsphere translate={T},0,0\nnoise alpha={T}\nnoise seed=1\nbound layer=0.3\ndfvn\nhere",
            [&](Context& c) {
                newest.push_back(velocitiesOf(c.flow("flow")));
                earlier.push_back(velocitiesOf(c.flowInTime("flow").at(c.clock()->begin)));
            });
    REQUIRE(newest.size() == 4);
    for (size_t k = 1; k < 4; ++k) CHECK((earlier[k] == newest[k - 1]));
}
