// SPDX-License-Identifier: Apache-2.0
#include "support/Catch.h"
#include "support/Command.h"
#include "support/SessionCommand.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

using namespace curlew;
using namespace curlew::app;
using Catch::Matchers::ContainsSubstring;

namespace {

/// Returns the particles at the end of each frame of a scene.
std::vector<Points> framesOf(const std::string& before, const std::string& block) {
    test::Scenes scenes;
    std::vector<Points> frames;
    scenes.session.onFrame = [&](int) { frames.push_back(test::pointsOf(scenes.session)); };
    scenes.run(before + "\n" + block);
    return frames;
}

Points afterwards(const std::string& scene) {
    test::Scenes scenes;
    return test::pointsOf(scenes.run(scene));
}

} // namespace

TEST_CASE("emit: births follow the rate and each has its own time", "[app]") {
    const double rate = GENERATE(1.0, 7.0, 100.0, 999.5);
    const auto frames = framesOf("sphere", fmt::format("frames 1-49 fps=24\nemit rate={}", rate));
    REQUIRE(frames.size() == 49);
    for (size_t frame = 0; frame < frames.size(); ++frame) {
        const Points& p = frames[frame];
        const double time = static_cast<double>(frame) / 24;
        CAPTURE(rate, frame);
        CHECK(std::abs(static_cast<double>(p.size()) - rate * time) < 1 + 1e-9);
        if (frame % 24 == 0) CHECK(static_cast<double>(p.size()) == std::floor(rate * time));
        size_t otherIds = 0;
        double error = 0;
        for (size_t k = 0; k < p.size(); ++k) {
            otherIds += p.id[k] != static_cast<int64_t>(k);
            // Particle k is born at (k + 1) / rate.
            error =
                std::max(error, std::abs(static_cast<double>(p.age[k]) - (time - static_cast<double>(k + 1) / rate)));
        }
        CHECK(otherIds == 0);
        CHECK(error < 1e-5); // ages are sums of up to 48 floats
    }
    CHECK(frames.front().size() == 0);
    CHECK_FALSE(frames.back().hasLife());
}

TEST_CASE("emit: the rate may change and become zero", "[app]") {
    const auto frames = framesOf("sphere", "frames 1-25 fps=24\nemit rate='{F<14 ? 240 : 0}'");
    CHECK(frames[12].size() == 120);
    CHECK(frames[24].size() == 120);
}

TEST_CASE("emit: particles die after their life and the others keep ids and positions", "[app]") {
    const auto frames = framesOf("sphere", "frames 1-30 fps=10\nemit rate=100 life=1 spread=0.5 seed=3");
    std::map<int64_t, std::pair<float, double>> known;
    size_t shortest = 0, longest = 0;
    for (size_t frame = 0; frame < frames.size(); ++frame) {
        const Points& p = frames[frame];
        CAPTURE(frame);
        REQUIRE(std::is_sorted(p.id.begin(), p.id.end()));
        for (size_t k = 0; k < p.size(); ++k) {
            REQUIRE(p.age[k] <= p.life[k]);
            REQUIRE((p.life[k] >= 0.5F && p.life[k] <= 1.5F));
            const auto place = std::pair(p.life[k], p.x[k]);
            REQUIRE(known.try_emplace(p.id[k], place).first->second == place);
        }
        if (frame != 20) continue;
        for (const auto& [id, place] : known) {
            shortest += place.first < 0.75F;
            longest += place.first > 1.25F;
        }
    }
    // Lives are uniform in [0.5, 1.5]: each outer quarter has 50 of 200 particles, within 5 sigma.
    CHECK(std::abs(static_cast<double>(shortest) - 50) < 31);
    CHECK(std::abs(static_cast<double>(longest) - 50) < 31);
    // 100 births per second and a mean life of 1 s give about 100 particles; the lives vary.
    CHECK(frames.back().size() > 85);
    CHECK(frames.back().size() < 115);
    for (const Points& p : frames) // the longest life is 1.5 s
        CHECK(p.size() <= 151);
}

TEST_CASE("emit: the position of a birth depends on the seed and the id only", "[app]") {
    const auto slow = framesOf("sphere", "frames 1-11 fps=10\nemit rate=50 seed=1").back();
    const auto fast = framesOf("sphere", "frames 1-3 fps=2\nemit rate=100 seed=1").back();
    const auto other = framesOf("sphere", "frames 1-11 fps=10\nemit rate=50 seed=2").back();
    REQUIRE(slow.size() == 50);
    REQUIRE(fast.size() == 100);
    for (size_t k = 0; k < 50; ++k) {
        CHECK((slow.x[k] == fast.x[k] && slow.y[k] == fast.y[k] && slow.z[k] == fast.z[k]));
        CHECK(slow.x[k] != other.x[k]);
        CHECK(std::hypot(slow.x[k], slow.y[k], slow.z[k]) < 1);
    }
}

TEST_CASE("emit: newborn particles join existing points", "[app]") {
    const auto frames = framesOf("noise\nnoise seed=1\ndfvn\nscatter count=20\nadvect duration=0.1 steps=1",
                                 "frames 1-3 fps=10\nemit rate=50\nadvect duration=0.1 steps=2");
    REQUIRE(frames.back().size() == 30);
    const Points& p = frames.back();
    for (size_t k = 0; k < 30; ++k) CHECK(p.id[k] == static_cast<int64_t>(k));
    for (size_t k = 0; k < 20; ++k) CHECK(p.age[k] == Approx(0.2));
    // Newborn particles have their own tracks in the same flow.
    REQUIRE(p.hasTrack());
    const auto first = frames[1];
    REQUIRE(first.size() == 25);
    for (size_t k = 20; k < 25; ++k) {
        CHECK(p.f[k] == first.f[k]);
        CHECK(p.g[k] == first.g[k]);
        CHECK(std::hypot(p.vx[k], p.vy[k], p.vz[k]) > 0);
    }
}

TEST_CASE("emit: two emitters add to the same points and count separately", "[app]") {
    const auto frames = framesOf("",
                                 "frames 1-11 fps=10\nsphere radius=0.1\nemit rate=10\n"
                                 "sphere radius=0.1 translate=5,0,0\nemit rate=30");
    const Points& p = frames.back();
    REQUIRE(p.size() == 40);
    const auto right = static_cast<size_t>(std::count_if(p.x.begin(), p.x.end(), [](double x) { return x > 2; }));
    CHECK(right == 30);
    for (size_t k = 0; k < 40; ++k) CHECK(p.id[k] == static_cast<int64_t>(k));
}

TEST_CASE("emit: a flow that is named for its wall is the domain, too", "[app]") {
    const auto frames = framesOf("sphere radius=0.5\nnoise\nnoise seed=1\nbound side=outside\ndfvn as=air",
                                 "frames 1-3 fps=1\nemit flow=air box=-1,-1,-1,1,1,1 rate=500");
    const Points& p = frames.back();
    REQUIRE(p.size() == 1000);
    for (size_t k = 0; k < p.size(); ++k) CHECK(length(p.position(k)) >= 0.5);
    // Not without a box: the shape is the emitter.
    for (const char* on : {"volume", "surface"}) {
        const auto born = framesOf("sphere radius=0.2 translate=0.7,0,0\nnoise\nnoise seed=1\ndfvn as=air",
                                   std::string("frames 1-2 fps=1\nemit flow=air rate=100 on=") + on)
                              .back();
        REQUIRE(born.size() == 100);
        // Points on a surface may be half of its layer's thickness outside.
        for (size_t k = 0; k < born.size(); ++k) CHECK(length(born.position(k) - Vec3d{{0.7, 0, 0}}) < 0.21);
    }
}

TEST_CASE("scatter and emit: box= restricts the surface of the newest shape, and replaces its volume", "[app]") {
    const std::string where = " box=0,0,0,1,1,1";
    for (const Points& p : {afterwards("sphere\nscatter count=1000 on=surface" + where),
                            framesOf("sphere", "frames 1-2 fps=1\nemit rate=1000 on=surface" + where).back()}) {
        REQUIRE(p.size() == 1000);
        for (size_t k = 0; k < p.size(); ++k) {
            CHECK(length(p.position(k)) == Approx(1).margin(0.01));
            CHECK(std::min({p.x[k], p.y[k], p.z[k]}) >= 0);
        }
    }
    const auto outside = [](const Points& p) {
        size_t count = 0;
        for (size_t k = 0; k < p.size(); ++k) count += length(p.position(k)) > 1;
        return count;
    };
    CHECK(outside(afterwards("sphere\nscatter count=1000" + where)) > 300);
    CHECK(outside(afterwards("sphere as=ball\nscatter count=1000 domain=ball" + where)) == 0);
}

TEST_CASE("emit: emission follows a moving shape", "[app]") {
    const auto frames = framesOf("", "frames 1-4 fps=1\nsphere radius=0.1 translate={10*T},0,0\nemit rate=10");
    const Points& p = frames.back();
    REQUIRE(p.size() == 30);
    // In at most 64 intervals of a frame, in each of which it stays.
    for (size_t k = 0; k < 30; ++k)
        CHECK(std::abs(p.x[k] - 10 * (3 - static_cast<double>(p.age[k]))) < 0.1 + 10.0 / 128 + 1e-6);
}

TEST_CASE("emit: births on a surface are outside it by offset= and leave it at speed=", "[app]") {
    const auto frames = framesOf("sphere radius=0.5", "frames 1-3 fps=10\nemit on=surface rate=5000 offset=0.01");
    REQUIRE(frames.back().size() == 1000);
    for (size_t k = 0; k < frames.back().size(); ++k)
        CHECK(length(frames.back().position(k)) == Approx(0.51).margin(1e-6));
    const auto moving =
        framesOf("sphere radius=0.5", "frames 1-2 fps=10\nemit on=surface rate=5000 offset=0.01 speed=2");
    for (size_t k = 0; k < moving.back().size(); ++k)
        CHECK(length(moving.back().position(k)) ==
              Approx(0.51 + 2 * static_cast<double>(moving.back().age[k])).margin(1e-5));
}

TEST_CASE("emit: invalid options and missing frames are errors", "[app]") {
    CHECK_THROWS_WITH(afterwards("sphere\nemit"), ContainsSubstring("-frames"));
    CHECK_THROWS_WITH(afterwards("frames 1-2\nemit"),
                      ContainsSubstring("scene:2: -emit") && ContainsSubstring("shape"));
    CHECK_THROWS_WITH(afterwards("frames 1-2\nsphere\nemit rate=1e15"), ContainsSubstring("births in one frame"));
    CHECK_THROWS_WITH(afterwards("frames 1-2\nsphere\nemit rate=-1"), ContainsSubstring("rate=-1"));
    CHECK_THROWS_WITH(afterwards("frames 1-2\nsphere\nemit life=0"), ContainsSubstring("life=0"));
}

TEST_CASE("kill: removes points outside or inside a box or a shape", "[app]") {
    const std::string some = "sphere radius=2\nscatter count=3000\n";
    const Points all = afterwards(some);
    const auto radius = [](const Points& p, size_t k) { return std::hypot(p.x[k], p.y[k], p.z[k]); };
    const Points inBox = afterwards(some + "kill box=0,-1,-1,1,1,1");
    const Points offBox = afterwards(some + "kill side=inside box=0,-1,-1,1,1,1");
    const Points inShape = afterwards(some + "sphere radius=1\nkill");
    const Points offShape = afterwards(some + "sphere radius=1\nkill side=inside");
    CHECK(inBox.size() > 100);
    CHECK(inBox.size() + offBox.size() == all.size());
    CHECK(inShape.size() > 100);
    CHECK(inShape.size() + offShape.size() == all.size());
    for (size_t k = 0; k < inBox.size(); ++k)
        REQUIRE((inBox.x[k] >= 0 && inBox.x[k] <= 1 && std::abs(inBox.y[k]) <= 1 && std::abs(inBox.z[k]) <= 1));
    for (size_t k = 0; k < inShape.size(); ++k) REQUIRE(radius(inShape, k) < 1);
    for (size_t k = 0; k < offShape.size(); ++k) REQUIRE(radius(offShape, k) > 1);
    // The remaining points keep their ids.
    for (const Points* part : {&inBox, &offBox, &inShape, &offShape})
        for (size_t k = 0; k < part->size(); ++k) REQUIRE(part->x[k] == all.x[static_cast<size_t>(part->id[k])]);
    CHECK_THROWS_WITH(afterwards("sphere\nkill"), ContainsSubstring("-scatter"));
    CHECK_THROWS_WITH(afterwards("scatter box=0,0,0,1,1,1\nkill"), ContainsSubstring("shape"));
}

TEST_CASE("wrap: points re-enter a periodic box on the other side", "[app]") {
    const std::string some = "scatter count=2000 box=-7,-7,-7,9,9,9\n";
    const Points all = afterwards(some), wrapped = afterwards(some + "wrap box=0,-1,2,1.5,1,3");
    const double lower[3] = {0, -1, 2}, upper[3] = {1.5, 1, 3};
    REQUIRE(wrapped.size() == all.size());
    for (size_t k = 0; k < all.size(); ++k) {
        const double from[3] = {all.x[k], all.y[k], all.z[k]}, to[3] = {wrapped.x[k], wrapped.y[k], wrapped.z[k]};
        for (int axis = 0; axis < 3; ++axis) {
            const double period = upper[axis] - lower[axis], periods = (from[axis] - to[axis]) / period;
            CAPTURE(k, axis, from[axis], to[axis]);
            REQUIRE((to[axis] >= lower[axis] && to[axis] < upper[axis]));
            REQUIRE(std::abs(periods - std::round(periods)) < 1e-13 * 16);
        }
        // Points that are already inside the box keep their positions exactly.
        if (from[0] >= 0 && from[0] < 1.5) REQUIRE(to[0] == from[0]);
    }
    // The default is the box of the flow.
    const Points home = afterwards("scatter count=100 box=3,3,3,4,4,4\nnoise\nnoise seed=1\ndfvn\nwrap");
    for (size_t k = 0; k < home.size(); ++k) REQUIRE(std::abs(home.x[k]) <= 1);
    CHECK_THROWS_WITH(afterwards("scatter box=0,0,0,1,1,1\nwrap"),
                      ContainsSubstring("-wrap") && ContainsSubstring("needs a flow"));
}

TEST_CASE("wrap: a periodic flow moves wrapped points as if they were not wrapped", "[app]") {
    const std::string flow = "noise period=2 frequency=1 seed=1\nnoise period=2 frequency=1 seed=2\ndfvn\n";
    const std::string move = "advect duration=0.5 steps=5\n";
    const Points straight = afterwards(flow + "scatter count=200 box=0,0,0,2,2,2\n" + move + move);
    const Points wrapped =
        afterwards(flow + "scatter count=200 box=0,0,0,2,2,2\n" + move + "wrap box=0,0,0,2,2,2\n" + move);
    for (size_t k = 0; k < straight.size(); ++k) {
        const double periods = (straight.x[k] - wrapped.x[k]) / 2;
        CAPTURE(k);
        REQUIRE(std::abs(periods - std::round(periods)) < 1e-6); // the tolerance of the reprojection
        REQUIRE(straight.f[k] == wrapped.f[k]);
    }
}

TEST_CASE("emit: particle files have the attributes that hosts know", "[app][command]") {
    const test::Folder folder;
    folder.mustRun(
        "-quiet -noise -noise seed=1 -dfvn -frames 1-3 -emit rate=480 life=5 -advect duration=0.1 steps=2 "
        "-write 'p.$F4.csv' 'p.$F4.vdb' -write target=blender upAxis=z 'b.$F4.vdb'");
    CHECK_THAT(test::bytesOf(folder / "p.0001.csv"), Catch::StartsWith("x,y,z"));
    CHECK_THAT(test::bytesOf(folder / "p.0003.csv"), Catch::StartsWith("x,y,z,vx,vy,vz,id,age,life,f,g\n"));
    CHECK(test::linesIn(test::bytesOf(folder / "p.0003.csv")) == 41);
    // The particles keep their attributes if they are read again.
    folder.mustRun("-quiet -read p.0003.vdb -write again.csv");
    CHECK_THAT(test::bytesOf(folder / "again.csv"), Catch::StartsWith("x,y,z,vx,vy,vz,id,age,life\n"));
    folder.mustRun("-quiet -read b.0003.vdb -write blender.csv");
    CHECK((test::bytesOf(folder / "blender.csv") == test::bytesOf(folder / "again.csv")));
    CHECK((test::bytesOf(folder / "b.0003.vdb") != test::bytesOf(folder / "p.0003.vdb")));
}

TEST_CASE("emit: points are born where a moving emitter is at the time of their birth", "[app]") {
    // It moves by 5 of its radii per frame, along x.
    const std::string emitter = "frames 1-3 fps=10\nsphere radius=0.1 translate={5*T},0,0\nemit rate=2000 seed=4";
    const Points born = framesOf("", emitter).back();
    size_t count = 0;
    for (size_t k = 0; k < born.size(); ++k) {
        const double birth = 0.2 - static_cast<double>(born.age[k]);
        CHECK(std::abs(born.x[k] - 5 * birth) < 0.1 + 0.25 * 0.35);
        count += born.age[k] > 0.05F ? 1 : 0;
    }
    CHECK(born.size() == 400);
    CHECK(std::abs(static_cast<double>(count) - 300) <= 1); // by rounding
    // A slow one is not evaluated between frames, and so gives the same points as ever.
    const std::string slow = "frames 1-2 fps=10\nsphere radius=0.1 translate={0.1*T},0,0\nemit rate=200 seed=4";
    const Points slowly = framesOf("", slow).back();
    CHECK(slowly.size() == 20);
    for (const double x : slowly.x) CHECK(std::abs(x - 0.01) <= 0.1);
}

TEST_CASE("emit: points born on a moving obstacle lie on it at the end of every frame", "[app]") {
    // The obstacle moves by two thirds of its size or less per frame; the flow hardly moves anything at its wall.
    const std::string rate = GENERATE("12", "25"); // 1/25 is rounded down in float
    const std::string sphere = "sphere radius=0.4 translate={6*T},0,0\n";
    const std::string emitter = GENERATE(as<std::string>(), "", "sphere radius=0.4 translate={6*T},0,0\n");
    const std::string block = "frames 1-4 fps=" + rate + "\n" + sphere +
                              "noise frequency=2\nnoise frequency=2 seed=1\nbound side=outside layer=0.2\n"
                              "dfvn speed=0.001\n" +
                              emitter + "emit on=surface rate=2000 offset=0.001\nadvect";
    CAPTURE(rate, emitter);
    const Points born = framesOf("", block).back();
    CHECK(born.size() > 200);
    const Vec3d centre{{6 * 3 / std::stod(rate), 0, 0}};
    for (size_t k = 0; k < born.size(); ++k) CHECK(length(born.position(k) - centre) == Approx(0.401).margin(1e-3));
}

TEST_CASE("emit: a fast emitter in the layer of a wall at rest, or a slow one, emits at the time of birth", "[app]") {
    // The flow changes with time. -advect does not take births along, because the wall does not move as the emitter
    // does.
    const std::string way = GENERATE("", " translate={0.001*T},0,0");
    const Points born = framesOf("", "frames 1-2 fps=10\nsphere radius=2" + way +
                                         "\nnoise time={T}\nnoise seed=1\nbound layer=1.9\ndfvn speed=0.001\n"
                                         "sphere radius=0.1 translate={5*T-1},1,0\nemit rate=2000 seed=4")
                            .back();
    CAPTURE(way);
    CHECK(born.size() == 200);
    for (size_t k = 0; k < born.size(); ++k)
        CHECK(std::abs(born.x[k] - 5 * (0.1 - static_cast<double>(born.age[k])) + 1) < 0.1 + 0.25 * 0.35);
}
