// SPDX-License-Identifier: Apache-2.0
#include "curlew/base/Error.h"
#include "curlew/base/Parallel.h"
#include "curlew/flow/Flows.h"
#include "curlew/vdb/GridAdvection.h"
#include "support/Catch.h"

#include <openvdb/tools/LevelSetSphere.h>
#include <openvdb/tools/LevelSetUtil.h>

#include <array>
#include <limits>

using namespace curlew;

namespace {

/// A ball of fog whose density decreases towards its surface.
openvdb::FloatGrid::Ptr fog(double voxel) {
    auto grid = openvdb::tools::createLevelSetSphere<openvdb::FloatGrid>(0.15f, {0.35f, 0.35f, 0.35f},
                                                                         static_cast<float>(voxel), 5.0f);
    openvdb::tools::sdfToFogVolume(*grid);
    grid->setName("density");
    return grid;
}

double massOf(const openvdb::FloatGrid& grid) {
    double sum = 0;
    for (auto value = grid.cbeginValueOn(); value; ++value)
        sum += static_cast<double>(*value) * static_cast<double>(value.getVoxelCount());
    return sum;
}

const openvdb::FloatGrid& floats(const AdvectedGrid& moved) {
    return dynamic_cast<const openvdb::FloatGrid&>(*moved.grid);
}

} // namespace

TEST_CASE("advectGrid: moving fog by whole voxels changes no value", "[vdb]") {
    const auto start = fog(1.0 / 64);
    const auto moved = advectGrid(*start, uniformFlow({{0.25, -0.5, 0}}), 0, 0.5, {.map = {.step = 1}});
    const auto& grid = floats(moved);
    CHECK(grid.getName() == "density");
    CHECK(grid.getGridClass() == openvdb::GRID_FOG_VOLUME);
    CHECK(grid.activeVoxelCount() <= start->activeVoxelCount()); // active zeros of the original become background
    CHECK(massOf(grid) == Approx(massOf(*start)).epsilon(1e-6));
    for (auto value = start->cbeginValueOn(); value; ++value) {
        const float there = grid.tree().getValue(value.getCoord().offsetBy(8, -16, 0));
        if (std::abs(there - *value) > 1e-5f) FAIL("a voxel has changed from " << *value << " to " << there);
    }
}

TEST_CASE("advectGrid: a divergence-free flow conserves mass to second order", "[vdb]") {
    const auto interpolation = GENERATE(Interpolation::linear, Interpolation::quadratic);
    std::array<double, 2> changes{};
    for (const size_t n : {size_t{0}, size_t{1}}) {
        const auto start = fog(n == 0 ? 1.0 / 32 : 1.0 / 64);
        const auto moved =
            advectGrid(*start, enrightFlowInTime(3), 0, 0.7, {.map = {.step = 0.05}, .interpolation = interpolation});
        changes[n] = std::abs(massOf(floats(moved)) / massOf(*start) - 1);
        CHECK(moved.stalled == 0);
    }
    CAPTURE(changes, static_cast<int>(interpolation));
    CHECK(changes[0] < 0.1); // the fog is a sheet two voxels thick at that time
    CHECK(changes[1] < changes[0] / 3);
}

TEST_CASE("advectGrid: vector values are transported without rotation", "[vdb]") {
    auto start = openvdb::Vec3SGrid::create(openvdb::Vec3s(0));
    start->setTransform(openvdb::math::Transform::createLinearTransform(0.1));
    start->fill({{0, 0, 0}, {7, 7, 7}}, {1, -2, 3}); // a tile
    const auto moved = advectGrid(*start, vortexFlow(0.5, 1e4), 0, 1, {.map = {.step = 0.02}});
    const auto& grid = dynamic_cast<const openvdb::Vec3SGrid&>(*moved.grid);
    size_t count = 0;
    for (auto value = grid.cbeginValueOn(); value; ++value)
        count += value->length() > 2; // rounding adds thin slivers at the border
    CHECK(count == 512);
    CHECK((grid.tree().getValue({-4, 4, -4}) - openvdb::Vec3s(1, -2, 3)).length() < 1e-5f);
}

TEST_CASE("advectGrid: a non-zero background is preserved", "[vdb]") {
    auto start = openvdb::FloatGrid::create(5);
    start->fill({{0, 0, 0}, {5, 5, 5}}, 0);
    const auto moved = advectGrid(*start, uniformFlow({{1, 0, 0}}), 0, 3, {.map = {.step = 1}});
    CHECK(floats(moved).background() == 5);
    CHECK(floats(moved).activeVoxelCount() == 216);
    CHECK(floats(moved).tree().getValue({8, 0, 0}) == 0);
    CHECK(floats(moved).tree().getValue({2, 0, 0}) == 5);
}

TEST_CASE("advectGrid: does not depend on the number of threads", "[vdb]") {
    std::vector<AdvectedGrid> moved;
    for (const int threads : {1, 2}) {
        const ThreadLimit limit(threads);
        moved.push_back(advectGrid(*fog(1.0 / 32), enrightFlow(), 0, 0.5, {.map = {.step = 0.05}}));
    }
    CHECK(floats(moved[0]).activeVoxelCount() == floats(moved[1]).activeVoxelCount());
    for (auto value = floats(moved[0]).cbeginValueOn(); value; ++value)
        if (floats(moved[1]).tree().getValue(value.getCoord()) != *value) FAIL("they differ");
}

TEST_CASE("advectGrid: unsuitable grids are errors that say why", "[vdb]") {
    const Flow flow = uniformFlow({{1, 0, 0}});
    const auto sphere = openvdb::tools::createLevelSetSphere<openvdb::FloatGrid>(1, {0, 0, 0}, 0.2f);
    CHECK_THROWS_WITH(advectGrid(*sphere, flow, 0, 1), Catch::ContainsSubstring("-advectLevelSet"));
    CHECK_THROWS_WITH(advectGrid(*openvdb::FloatGrid::create(), flow, 0, 1),
                      Catch::ContainsSubstring("no active voxel"));
    CHECK_THROWS_WITH(advectGrid(*openvdb::BoolGrid::create(), flow, 0, 1), Catch::ContainsSubstring("bool"));
    auto velocity = openvdb::Vec3SGrid::create();
    velocity->setGridClass(openvdb::GRID_STAGGERED);
    CHECK_THROWS_WITH(advectGrid(*velocity, flow, 0, 1), Catch::ContainsSubstring("staggered"));
    auto bad = openvdb::FloatGrid::create();
    bad->tree().setValue({0, 0, 0}, std::nanf(""));
    CHECK_THROWS_WITH(advectGrid(*bad, flow, 0, 1), Catch::ContainsSubstring("finite"));
    bad->tree().setValue({0, 0, 0}, 1);
    CHECK_THROWS_AS(advectGrid(*bad, flow, 0, std::numeric_limits<double>::infinity()), ValueError);
    CHECK_THROWS_AS(
        advectGrid(*bad, flow, 0, 1, {.map = {.step = 0.1}}, {.report = {}, .cancelled = [] { return true; }}),
        Interrupted);
}
