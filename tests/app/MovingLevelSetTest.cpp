// SPDX-License-Identifier: Apache-2.0
// Walls from level sets that -move moves from frame to frame, or that are made in steps of several frames.
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
std::vector<openvdb::Vec3SGrid::ConstPtr> velocities(const std::string& solid, const std::string& frames = "1-3") {
    Scenes scenes;
    std::vector<openvdb::Vec3SGrid::ConstPtr> grids;
    scenes.session.onFrame = [&](int) { grids.push_back(velocityOf(scenes)); };
    scenes.session.provide("brick", brick(), DigestBuilder().add(1).digest());
    scenes.session.provide("grid", GridValue{meshToLevelSet(brick(), {.voxel = 0.04}).grid},
                           DigestBuilder().add(2).digest());
    scenes.run("frames " + frames + " fps=24\n" + solid + kFlow + "velocity voxel=0.08");
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
    // A brick that turns and grows, so fast that its distances between frames are not one parabola. Frame 1 + by k has
    // the mesh k.
    const auto firstOf = [](int by) {
        Scenes scenes;
        openvdb::Vec3SGrid::ConstPtr first;
        scenes.session.onFrame = [&](int frame) {
            if (frame == 1) first = velocityOf(scenes);
        };
        for (int k = 0; k < 4; ++k) {
            auto mesh = std::make_shared<Mesh>(*brick());
            const float c = std::cos(0.5f * static_cast<float>(k)), d = std::sin(0.5f * static_cast<float>(k));
            for (auto& p : mesh->points)
                p = openvdb::Vec3s(c * p[0] - d * p[1], d * p[0] + c * p[1], p[2]) *
                    (1 + 0.05f * static_cast<float>(k));
            scenes.session.provide("mesh" + std::to_string(1 + by * k), std::shared_ptr<const Mesh>(mesh),
                                   DigestBuilder().add(k).digest());
        }
        scenes.run("frames 1-" + std::to_string(1 + 2 * by) + "x" + std::to_string(by) + " fps=" +
                   std::to_string(24 * by) + "\nread mesh$F\nmesh2ls voxel=0.04\n" + kFlow + "velocity voxel=0.08");
        return first;
    };
    CHECK(difference(*firstOf(1), *firstOf(2)) < 1e-6); // times differ by rounding
}

TEST_CASE("moving level set: keeps points out while it turns", "[app]") {
    Scenes scenes;
    scenes.session.provide("brick", brick(), DigestBuilder().add(1).digest());
    scenes.run("frames 1-4 fps=24\nread brick\nmesh2ls voxel=0.04\nmove rotate=0,0,{360*T}\n" + kFlow +
               "emit rate=20000\nadvect\ncheck samples=100");
    CHECK(scenes.session.report["check"]["outside"] == 0);
    CHECK(scenes.session.report["check"]["points"] > 1000);
}
