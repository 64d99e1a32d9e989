// SPDX-License-Identifier: Apache-2.0
#include "curlew/base/Error.h"
#include "curlew/vdb/LevelSetMesh.h"
#include "support/Catch.h"

#include <openvdb/tools/LevelSetSphere.h>

#include <array>
#include <limits>
#include <numbers>

using namespace curlew;

namespace {

LevelSet ball(double radius, double voxel) {
    return {openvdb::tools::createLevelSetSphere<openvdb::FloatGrid>(static_cast<float>(radius), {1, 2, 3},
                                                                     static_cast<float>(voxel)),
            nullptr};
}

/// Returns the volume of a closed mesh by the divergence theorem. It is positive if the faces are counter-clockwise as
/// seen from outside.
double volumeOf(const Mesh& mesh) {
    double volume = 0;
    const auto add = [&](openvdb::Index32 a, openvdb::Index32 b, openvdb::Index32 c) {
        const openvdb::Vec3d p(mesh.points[a]), q(mesh.points[b]), r(mesh.points[c]);
        volume += p.dot(q.cross(r)) / 6;
    };
    for (const auto& f : mesh.triangles) add(f[0], f[1], f[2]);
    for (const auto& f : mesh.quads) {
        add(f[0], f[1], f[2]);
        add(f[0], f[2], f[3]);
    }
    return volume;
}

} // namespace

TEST_CASE("levelSetToMesh: gives a closed mesh with outward faces and second-order volume", "[vdb]") {
    const double exact = 4.0 / 3 * std::numbers::pi;
    std::array<double, 2> errors{};
    for (const size_t n : {size_t{0}, size_t{1}}) {
        const Mesh mesh = levelSetToMesh(ball(1, n == 0 ? 0.1 : 0.05));
        CHECK(topologyOf(mesh).closed());
        CHECK(mesh.triangles.empty());
        errors[n] = volumeOf(mesh) / exact - 1;
    }
    // Chords of a sphere lie inside it: the error is of second order.
    CAPTURE(errors);
    CHECK(std::abs(errors[1]) < 0.01);
    CHECK(errors[0] / errors[1] == Approx(4).epsilon(0.15));
}

TEST_CASE("levelSetToMesh: adaptivity reduces the number of faces", "[vdb]") {
    const LevelSet sphere = ball(1, 0.05);
    const Mesh fine = levelSetToMesh(sphere), coarse = levelSetToMesh(sphere, 0.5);
    CHECK(coarse.faces() < fine.faces() / 2);
    CHECK(volumeOf(coarse) == Approx(volumeOf(fine)).epsilon(0.15));
}

TEST_CASE("levelSetToMesh: a grid without a surface or an invalid adaptivity is an error", "[vdb]") {
    auto grid = openvdb::FloatGrid::create(1);
    grid->setGridClass(openvdb::GRID_LEVEL_SET);
    CHECK_THROWS_WITH(levelSetToMesh({grid, nullptr}), Catch::ContainsSubstring("surface"));
    for (const double adaptivity : {-0.1, 1.1, std::numeric_limits<double>::quiet_NaN()})
        CHECK_THROWS_WITH(levelSetToMesh(ball(1, 0.2), adaptivity), Catch::ContainsSubstring("adaptivity"));
}

TEST_CASE("levelSetToMesh: faces point outwards in a mirrored grid too", "[vdb]") {
    const LevelSet sphere = ball(1, 0.1);
    const auto mirrored = sphere.grid->deepCopy();
    mirrored->transform().preScale(openvdb::Vec3d(-1, 1, 1));
    const Mesh mesh = levelSetToMesh({mirrored, nullptr});
    CHECK(topologyOf(mesh).closed());
    CHECK(volumeOf(mesh) == Approx(volumeOf(levelSetToMesh(sphere))).epsilon(1e-4));
}
