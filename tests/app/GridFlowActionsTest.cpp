// SPDX-License-Identifier: Apache-2.0
#include "curlew/vdb/Openvdb.h"
#include "curlew/vdb/VdbFile.h"
#include "support/ProbeCommand.h"

#include <openvdb/io/File.h>

using namespace curlew;
using namespace curlew::test;

namespace {

/// A staggered velocity grid of a noise around a ball, in vel.vdb, and the ball as a level set in ball.vdb.
void writeVelocity(const Folder& folder) {
    folder.mustRun(
        "-sphere radius=0.5 -noise frequency=1.5 -noise frequency=1.5 seed=1 -bound side=outside -dfvn speed=1 "
        "box=-1,-1,-1,1,1,1 -velocity dim=40 staggered=1 -write vel.vdb");
}

} // namespace

TEST_CASE("flow action: a velocity grid as it is, and with potentials", "[app][command]") {
    const Folder folder;
    writeVelocity(folder);
    const auto plain = folder.mustRun("-read vel.vdb -flow -check samples=10000 report=plain.json");
    CHECK_THAT(plain.err,
               Catch::Matchers::ContainsSubstring("linear interpolation of the staggered velocity grid 'vel'"));
    const auto sampled = jsonOf(folder / "plain.json");
    CHECK(sampled["divergence_free"] == false);
    CHECK(sampled["divergence_by_differences"].get<double>() > 0.01);
    const auto exact = folder.mustRun("-read vel.vdb -flow exact=1 -check samples=10000 report=exact.json");
    CHECK_THAT(exact.err, Catch::Matchers::ContainsSubstring("potentials of 4"));
    const auto made = jsonOf(folder / "exact.json");
    CHECK(made["divergence_free"] == true);
    CHECK(made["divergence_vanishes"] == true);
    // Particles that follow term by term never enter the ball.
    folder.mustRun(
        "-sphere radius=0.5 -read vel.vdb -flow exact=1 side=outside -scatter count=500 -advect duration=2 steps=10 "
        "splitting=strang -check samples=10000 report=points.json");
    CHECK(jsonOf(folder / "points.json")["outside"] == 0);
    folder.mustRun("-read vel.vdb -flow exact=1 -velocity dim=20 staggered=1 -check samples=10000 report=again.json");
    folder.mustRun("-read vel.vdb -flow interpolation=cubic -slice width=32 -write slice.png");
}

TEST_CASE("flow action: three grids of components are read as one velocity", "[app][command]") {
    const Folder folder;
    folder.mustRun("-noise -noise seed=1 -dfvn box=-1,-1,-1,1,1,1 -velocity dim=16 -write split=1 parts.vdb");
    const auto run = folder.mustRun("-read parts.vdb -flow exact=1 -print");
    CHECK_THAT(run.out, Catch::Matchers::ContainsSubstring("sum of 3"));
    folder.mustFail("-noise -bake box=0,0,0,1,1,1 dim=8 -flow", {"-flow", "grid"});
}

TEST_CASE("flow action: three grids in any order are sorted by the last letters of their names", "[app][command]") {
    const Folder folder;
    folder.mustRun("-noise -noise seed=1 -dfvn box=-1,-1,-1,1,1,1 -velocity dim=16 -write split=1 parts.vdb");
    const auto parts = readVdb(folder / "parts.vdb");
    REQUIRE(parts.size() == 3);
    folder.mustRun("-read parts.vdb -flow -check samples=2000 report=ordered.json");
    folder.mustRun("-read parts.vdb -flow -velocity dim=8 -write ordered.vdb");
    const auto writeAs = [&](const std::array<std::string, 3>& names) {
        openvdb::GridCPtrVec grids;
        for (const size_t k : {2, 0, 1}) {
            const auto grid = parts[k]->deepCopyGrid();
            grid->setName(names[k]);
            grids.push_back(grid);
        }
        openvdb::io::File((folder / "mixed.vdb").string()).write(grids);
    };
    const auto velocityOf = [&](const char* name) {
        return openvdb::gridPtrCast<openvdb::Vec3SGrid>(readVdb(folder / name).at(0))->tree().getValue({1, 2, 3});
    };
    for (const std::array<std::string, 3>& names :
         {std::array<std::string, 3>{"vel.x", "vel.y", "vel.z"}, {"velX", "velY", "velZ"}, {"u", "v", "w"}}) {
        CAPTURE(names[0]);
        writeAs(names);
        const auto run = folder.mustRun("-read mixed.vdb -flow -velocity dim=8 -write mixed_out.vdb");
        CHECK(velocityOf("mixed_out.vdb") == velocityOf("ordered.vdb"));
        CHECK_THAT(run.err, Catch::Matchers::ContainsSubstring("'" + names[0] + "', '" + names[1] + "'"));
    }
    writeAs({"heat", "fuel", "smoke"}); // as in the file, and said so
    const auto run = folder.mustRun("-read mixed.vdb -flow -velocity dim=8 -write mixed_out.vdb");
    CHECK_THAT(run.err, Catch::Matchers::ContainsSubstring("'smoke', 'heat' and 'fuel'"));
    CHECK(velocityOf("mixed_out.vdb") != velocityOf("ordered.vdb"));
}

TEST_CASE("flow action: takes the velocity from among other grids of a file", "[app][command]") {
    const Folder folder;
    folder.mustRun(
        "-noise -noise seed=1 -dfvn box=-1,-1,-1,1,1,1 -velocity dim=16 density=1 -write whole.vdb -write "
        "split=1 parts.vdb");
    const auto density = readVdb(folder / "whole.vdb"), parts = readVdb(folder / "parts.vdb");
    const auto named = [&](const openvdb::GridBase::Ptr& grid, const char* name) {
        auto copy = grid->deepCopyGrid();
        copy->setName(name);
        return copy;
    };
    const auto velocityOf = [&](const openvdb::GridCPtrVec& grids, const std::string& before = "") {
        openvdb::io::File((folder / "mixed.vdb").string()).write(grids);
        folder.mustRun(before + "-read mixed.vdb -flow -velocity dim=8 -write out.vdb");
        return openvdb::gridPtrCast<openvdb::Vec3SGrid>(readVdb(folder / "out.vdb").at(0))->tree().getValue({1, 2, 3});
    };
    const auto smoke = [&](const char* name) { return named(parts[1], name); };
    const auto whole = [&] {
        for (const auto& grid : density)
            if (grid->isType<openvdb::Vec3SGrid>()) return grid;
        throw std::logic_error("no vectors");
    }();
    const openvdb::Vec3s expected = velocityOf({named(whole, "vel")});
    REQUIRE(expected.length() > 0);
    CHECK(velocityOf({smoke("density"), named(whole, "vel"), smoke("temperature"), smoke("fuel")}) == expected);
    CHECK(velocityOf({smoke("density"), named(parts[0], "vel.x"), named(parts[1], "vel.y"), named(parts[2], "vel.z"),
                      smoke("heat")}) == expected);
    CHECK(velocityOf({named(whole, "vel")}, "-read parts.vdb ") == expected); // the newest velocity
}

TEST_CASE("flow action: uniform velocities have potentials in grids of any size", "[app][command]") {
    const Folder folder;
    for (const int dim : {30, 32, 38, 48}) {
        CAPTURE(dim);
        folder.mustRun(fmt::format("-uniform velocity=0,1,0 -velocity dim={} staggered=1 -write uniform.vdb", dim));
        folder.mustRun("-read uniform.vdb -flow exact=1 -check samples=2000 report=check.json");
        CHECK(jsonOf(folder / "check.json")["rms_speed"].get<double>() == Approx(1).epsilon(1e-5));
    }
}

TEST_CASE("flow action: a grid of doubles is a velocity, too", "[app][command]") {
    const Folder folder;
    writeVelocity(folder);
    const auto floats = openvdb::GridBase::grid<openvdb::Vec3SGrid>(readVdb(folder / "vel.vdb").front());
    REQUIRE(floats);
    const auto doubles = openvdb::Vec3DGrid::create(openvdb::Vec3d(0));
    doubles->insertMeta(*floats);
    doubles->setTransform(floats->transform().copy());
    for (auto value = floats->cbeginValueOn(); value; ++value)
        doubles->tree().setValueOn(value.getCoord(), openvdb::Vec3d(*value));
    openvdb::io::File((folder / "double.vdb").string()).write(openvdb::GridCPtrVec{doubles});
    for (const char* options : {"", " exact=1"}) {
        folder.mustRun(fmt::format("-read vel.vdb -flow{} -check samples=2000 report=a.json", options));
        folder.mustRun(fmt::format("-read double.vdb -flow{} -check samples=2000 report=b.json", options));
        for (const char* figure : {"rms_speed", "divergence_analytic", "divergence_by_differences"})
            CHECK(jsonOf(folder / "a.json")[figure] == jsonOf(folder / "b.json")[figure]);
    }
    folder.mustRun("-read double.vdb -spectrum -check samples=10000 -write a.fga");
    folder.mustRun("-read vel.vdb -write b.fga");
    CHECK(bytesOf(folder / "a.fga") == bytesOf(folder / "b.fga"));
}

TEST_CASE("flow action: the velocity of a sequence of grids changes linearly from frame to frame", "[app][command]") {
    const Folder folder;
    for (const int frame : {1, 2, 3})
        folder.mustRun(fmt::format("-uniform velocity={},0,0 box=-8,-8,-8,8,8,8 -velocity dim=16 -write vel.{}.vdb",
                                   0.25 * frame * frame, frame));
    // In the frames 1 to 3, the speed is 0.25, 1 and 2.25 units per second; a frame takes one.
    for (const std::string options : {"", "interpolation=cubic", "exact=1"}) {
        CAPTURE(options);
        folder.mustRun(
            fmt::format("-scatter count=20 box=-1,-1,-1,1,1,1 seed=3 -write start.csv -frames 1-3 fps=1 "
                        "-read 'vel.$F.vdb' -flow {} -advect steps=4 -write 'moved.$F.csv'",
                        options));
        const Table start = tableOf(folder / "start.csv"), second = tableOf(folder / "moved.2.csv"),
                    third = tableOf(folder / "moved.3.csv");
        REQUIRE(start.rows.size() == 20);
        for (size_t k = 0; k < start.rows.size(); ++k) {
            CHECK(second.rows[k][0] - start.rows[k][0] == Approx(0.625).epsilon(1e-5));
            CHECK(third.rows[k][0] - second.rows[k][0] == Approx(1.625).epsilon(1e-5));
            CHECK(third.rows[k][1] == Approx(start.rows[k][1]).margin(1e-5));
        }
    }
    // Sequences of scalar grids: the flow of a field whose gradient grows.
    for (const int frame : {1, 2})
        folder.mustRun(fmt::format("-formula {}*x -bake box=-9,-9,-9,9,9,9 dim=18 -write ramp.{}.vdb", frame, frame));
    folder.mustRun(
        "-scatter count=5 box=-1,-1,-1,1,1,1 -write start.csv -frames 1-2 fps=1 -read 'ramp.$F.vdb' -field -gradient "
        "-advect steps=4 -write 'moved.$F.csv'");
    const Table start = tableOf(folder / "start.csv"), moved = tableOf(folder / "moved.2.csv");
    for (size_t k = 0; k < start.rows.size(); ++k)
        CHECK(moved.rows[k][0] - start.rows[k][0] == Approx(1.5).epsilon(1e-5));
}

TEST_CASE("flow action: options without effect and unsuitable inputs are errors", "[app][command]") {
    const Folder folder;
    writeVelocity(folder);
    folder.mustFail("-read vel.vdb -flow exact=1 interpolation=cubic", {"interpolation"});
    folder.mustFail("-sphere -read vel.vdb -flow side=outside", {"exact=1"});
    folder.mustFail("-read vel.vdb -flow -advect splitting=strang", {"points"});
    folder.mustFail("-read vel.vdb -flow -scatter count=10 -advect splitting=strang", {"splitting=none", "exact=1"});
    folder.mustFail("-read vel.vdb -flow -velocity staggered=1 dim=8", {"staggered", "exact=1"});
    folder.mustFail("-read vel.vdb -flow -noise -carry", {"without potentials"});
    folder.mustFail("-sphere radius=3 -read vel.vdb -flow exact=1 side=outside", {"inside out", "side="});
}

TEST_CASE("gradient action: has sources and sinks, and check reports a divergence", "[app][command]") {
    const Folder folder;
    folder.mustRun("-noise dimensions=2 frequency=2 -gradient speed=1 -check samples=10000 report=flat.json");
    CHECK(jsonOf(folder / "flat.json")["rms_speed"].get<double>() == Approx(1).epsilon(0.005));
    folder.mustRun("-noise frequency=2 -gradient -check samples=10000 report=gradient.json");
    const auto check = jsonOf(folder / "gradient.json");
    CHECK(check["divergence_free"] == false);
    CHECK(check["divergence_by_differences"].get<double>() > 0.1);
    folder.mustFail("-noise type=simplex dimensions=4 -gradient", {"2 or 3 dimensions"});
}
