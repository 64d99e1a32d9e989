// SPDX-License-Identifier: Apache-2.0
// Walls from level sets that -move moves from frame to frame.
#include "curlew/vdb/LevelSet.h"
#include "curlew/vdb/Openvdb.h"
#include "support/Meshes.h"
#include "support/SessionCommand.h"

#include <cmath>
#include <string>
#include <vector>

using namespace curlew;
using namespace curlew::app;
using namespace curlew::test;

namespace {

const std::string kMove = "move translate={3*T},0,0 rotate=0,0,{90*T}\n";
const std::string kFlow =
    "noise frequency=2\nnoise frequency=2 seed=1\nbound side=outside layer=0.2\ndfvn speed=0.2 box=-2,-2,-2,2,2,2\n";

/// A brick whose edges differ.
std::shared_ptr<const Mesh> brick() {
    auto mesh = std::make_shared<Mesh>(ball(3));
    for (auto& p : mesh->points) p *= openvdb::Vec3s(0.8f, 0.5f, 0.3f);
    return mesh;
}

openvdb::Vec3SGrid::ConstPtr velocityOf(Scenes& scenes) {
    return openvdb::gridConstPtrCast<openvdb::Vec3SGrid>(
        std::get<GridValue>(valueOf(scenes.session, Kind::velocity)).grid);
}

/// Returns the rms difference of the second grid from the first, relative to the rms of the first.
double difference(const openvdb::Vec3SGrid& a, const openvdb::Vec3SGrid& b) {
    double squares = 0, all = 0;
    const auto other = b.getConstAccessor();
    for (auto value = a.cbeginValueOn(); value; ++value) {
        squares += static_cast<double>((*value - other.getValue(value.getCoord())).lengthSqr());
        all += static_cast<double>(value->lengthSqr());
    }
    return std::sqrt(squares / all);
}

/// Returns the velocities in each frame.
std::vector<openvdb::Vec3SGrid::ConstPtr> velocities(const std::string& solid, const std::string& frames = "1-3",
                                                     int fps = 24) {
    Scenes scenes;
    std::vector<openvdb::Vec3SGrid::ConstPtr> grids;
    scenes.session.onFrame = [&](int) { grids.push_back(velocityOf(scenes)); };
    scenes.session.provide("brick", brick(), DigestBuilder().add(1).digest());
    scenes.session.provide("grid", GridValue{meshToLevelSet(brick(), {.voxel = 0.04}).grid},
                           DigestBuilder().add(2).digest());
    scenes.run("frames " + frames + " fps=" + std::to_string(fps) + "\n" + solid + kFlow + "velocity voxel=0.08");
    return grids;
}

} // namespace

TEST_CASE("moving level set: has the velocities of the mesh that moves in the same way", "[app]") {
    const auto expected = velocities("read brick\n" + kMove + "mesh2ls voxel=0.04\n");
    const auto ofMesh = velocities("read brick\nmesh2ls voxel=0.04\n" + kMove);
    const auto ofGrid = velocities("read grid\n" + kMove);
    const auto inTwo = velocities("read grid\nmove rotate=0,0,{90*T}\nmove translate={3*T},0,0\n");
    REQUIRE(expected.size() == 3);
    for (size_t frame = 0; frame < 3; ++frame) {
        CAPTURE(frame);
        CHECK(difference(*expected[frame], *ofMesh[frame]) < 1e-3);
        // The box of a turned box is larger, so the air takes slightly other ways around it.
        CHECK(difference(*expected[frame], *ofGrid[frame]) < 0.1);
        CHECK(difference(*expected[frame], *inTwo[frame]) < 0.1);
    }
}

TEST_CASE("moving level set: a frame on its own has the velocities of the whole range", "[app]") {
    const auto all = velocities("read grid\n" + kMove);
    const auto last = velocities("read grid\n" + kMove, "3-3 start=1");
    CHECK(difference(*all[2], *last.back()) == 0);
}

TEST_CASE("moving level set: has the same first velocities if only the numbers of frames differ", "[app]") {
    // One that changes its form, since its union with a ball at rest does.
    const std::string solid = "read brick\nmesh2ls voxel=0.04\n" + kMove + "sphere radius=0.4\nunion\n";
    const auto each = velocities(solid, "1-2"), second = velocities(solid, "1-3x2", 48);
    CHECK(difference(*each[0], *second[0]) == 0);
    CHECK(difference(*each[1], *second[1]) == 0);
}

TEST_CASE("moving level set: keeps points out while it turns", "[app]") {
    Scenes scenes;
    scenes.session.provide("brick", brick(), DigestBuilder().add(1).digest());
    scenes.run("frames 1-4 fps=24\nread brick\nmesh2ls voxel=0.04\nmove rotate=0,0,{360*T}\n" + kFlow +
               "emit rate=20000\nadvect\ncheck samples=100");
    CHECK(scenes.session.report["check"]["outside"] == 0);
    CHECK(scenes.session.report["check"]["points"] > 1000);
}
