// SPDX-License-Identifier: Apache-2.0
#include "curlew/vdb/LevelSetVolume.h"
#include "support/Catch.h"

#include <openvdb/tools/LevelSetSphere.h>

#include <cmath>
#include <numbers>

using namespace curlew;

namespace {

/// A ball whose centre is not on the lattice.
openvdb::FloatGrid::Ptr ball(double radius, double voxel) {
    return openvdb::tools::createLevelSetSphere<openvdb::FloatGrid>(static_cast<float>(radius), {0.1f, 0.27f, -0.33f},
                                                                    static_cast<float>(voxel));
}

double errorOf(const openvdb::FloatGrid::Ptr& grid, double radius) {
    return volumeOf(LevelSet{grid, nullptr}) / (4 * std::numbers::pi / 3 * std::pow(radius, 3)) - 1;
}

} // namespace

TEST_CASE("volumeOf: is that of a ball, to second order in the voxel size", "[vdb]") {
    for (const double voxel : {0.1, 0.05, 0.025}) {
        CAPTURE(voxel);
        CHECK(errorOf(ball(1, voxel), 1) == Approx(voxel * voxel / 16).epsilon(0.1));
    }
}

TEST_CASE("volumeOf: does not need values that are distances", "[vdb]") {
    const auto grid = ball(1, 0.05);
    for (auto value = grid->beginValueOn(); value; ++value)
        value.setValue(*value * (1.3f + 0.2f * std::sin(5.0f * *value)));
    CHECK(std::abs(errorOf(grid, 1)) < 3e-4);
}

TEST_CASE("volumeOf: counts tiles inside and follows the transform", "[vdb]") {
    const auto grid = ball(2, 0.02); // with tiles of 8³ voxels inside
    const auto turned = openvdb::math::Transform::createLinearTransform(0.04);
    turned->postRotate(0.4, openvdb::math::Z_AXIS);
    turned->postTranslate({3, 1, 2});
    grid->setTransform(turned);
    CHECK(std::abs(errorOf(grid, 4)) < 2e-5);
}
