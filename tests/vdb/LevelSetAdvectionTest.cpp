// SPDX-License-Identifier: Apache-2.0
#include "curlew/base/Error.h"
#include "curlew/base/Parallel.h"
#include "curlew/field/NoiseField.h"
#include "curlew/flow/Flows.h"
#include "curlew/vdb/LevelSetAdvection.h"
#include "support/Points.h"
#include "support/Samples.h"

#include <openvdb/tools/LevelSetMeasure.h>
#include <openvdb/tools/LevelSetSphere.h>

#include <limits>
#include <numbers>

using namespace curlew;
using namespace curlew::test;

namespace {

LevelSet ball(const Vec3d& center, double radius, double voxel) {
    return {
        openvdb::tools::createLevelSetSphere<openvdb::FloatGrid>(
            static_cast<float>(radius),
            openvdb::Vec3f(static_cast<float>(center[0]), static_cast<float>(center[1]), static_cast<float>(center[2])),
            static_cast<float>(voxel)),
        nullptr};
}

LevelSet enrightBall(int dim) { return ball({{0.35, 0.35, 0.35}}, 0.15, 1.0 / dim); }

Vec3d worldOf(const openvdb::FloatGrid& grid, const openvdb::Coord& voxel) {
    const auto p = grid.indexToWorld(voxel);
    return {{p[0], p[1], p[2]}};
}

/// Errors of the samples relative to the distance to a sphere, in voxels.
struct SphereErrors {
    double surface = 0, band = 0;
    double mean = 0; ///< Mean error at the surface.
};
SphereErrors errorsOf(const openvdb::FloatGrid& grid, const Vec3d& center, double radius) {
    SphereErrors errors;
    const double voxel = grid.voxelSize()[0];
    double count = 0;
    for (auto value = grid.cbeginValueOn(); value; ++value) {
        const double exact = length(worldOf(grid, value.getCoord()) - center) - radius,
                     error = std::abs(static_cast<double>(*value) - exact) / voxel;
        errors.band = std::max(errors.band, error);
        if (!(std::abs(exact) < voxel)) continue;
        errors.surface = std::max(errors.surface, error);
        errors.mean += error;
        ++count;
    }
    errors.mean /= count;
    return errors;
}

double volumeChange(const LevelSet& after, const LevelSet& before) {
    return openvdb::tools::levelSetVolume(*after.grid) / openvdb::tools::levelSetVolume(*before.grid) - 1;
}

bool same(const openvdb::FloatGrid& a, const openvdb::FloatGrid& b) {
    if (a.activeVoxelCount() != b.activeVoxelCount() || a.background() != b.background()) return false;
    for (auto value = a.cbeginValueOn(); value; ++value)
        if (!b.tree().isValueOn(value.getCoord()) || b.tree().getValue(value.getCoord()) != *value) return false;
    return true;
}

double greatestDifference(const openvdb::FloatGrid& a, const openvdb::FloatGrid& b) {
    double worst = 0;
    for (auto value = a.cbeginValueOn(); value; ++value)
        worst = std::max(worst, std::abs(static_cast<double>(*value - b.tree().getValue(value.getCoord()))));
    return worst / a.voxelSize()[0];
}

/// A flow inside a ball of radius 1.
Flow contained(double width) {
    const Wall wall{.sdf = sphereSdf(1), .side = Side::inside, .width = width};
    return withSpeed(Flow(noiseField<Psrd3>({.seed = 1}, {.frequency = 1}),
                          bounded(noiseField<Psrd3>({.seed = 2}, {.frequency = 1}), wall), Domain::of(wall)),
                     1);
}

/// Returns the greatest distance by which an inside voxel is beyond the unit sphere, in voxels. Negative if none is.
double beyondUnitSphere(const openvdb::FloatGrid& grid) {
    double worst = -std::numeric_limits<double>::infinity();
    for (auto value = grid.cbeginValueOn(); value; ++value)
        if (*value < 0) worst = std::max(worst, (length(worldOf(grid, value.getCoord())) - 1) / grid.voxelSize()[0]);
    return worst;
}

} // namespace

TEST_CASE("advectLevelSet: a uniform flow translates a sphere unchanged", "[vdb]") {
    const LevelSet start = ball({{0.1, 0.2, -0.3}}, 0.5, 0.05);
    const auto moved = advectLevelSet(start, uniformFlow({{1, 0.5, -0.25}}), 0, 0.777, {.step = 1});
    const auto errors = errorsOf(*moved.levelSet.grid, {{0.877, 0.5885, -0.49425}}, 0.5);
    CHECK(errors.surface < 2e-3); // closest points are on the surface to within 0.001 voxels
    CHECK(errors.band < 3e-3);
    CHECK(moved.levelSet.halfWidth() == Approx(3));
    CHECK(moved.levelSet.grid->getGridClass() == openvdb::GRID_LEVEL_SET);
    CHECK(moved.levelSet.grid->activeVoxelCount() ==
          Approx(static_cast<double>(start.grid->activeVoxelCount())).epsilon(0.02));
    CHECK(moved.meanShift < 0.01); // the chord error of a sphere with a radius of 10 voxels
    CHECK(moved.unconverged < 10); // of 8000
    CHECK(moved.stalled == 0);
    // The sign is also right beyond the band.
    CHECK(moved.levelSet.grid->tree().getValue(
              moved.levelSet.grid->transform().worldToIndexCellCentered({0.877, 0.5885, -0.49425})) == Approx(-0.15));
    CHECK(moved.levelSet.grid->tree().getValue({0, 0, 0}) == Approx(0.15));
}

TEST_CASE("advectLevelSet: a vortex rotates a sphere unchanged in rotated grids too", "[vdb]") {
    auto grid = ball({{0.4, 0.1, 0}}, 0.25, 0.025).grid->deepCopy();
    grid->setName("surface");
    grid->insertMeta("note", openvdb::StringMetadata("kept"));
    const bool turned = GENERATE(false, true);
    CAPTURE(turned);
    Vec3d center{{0.4, 0.1, 0}};
    if (turned) {
        grid->transform().postRotate(std::numbers::pi / 2, openvdb::math::Z_AXIS);
        const auto c = grid->indexToWorld(openvdb::Vec3d(16, 4, 0));
        center = {{c[0], c[1], c[2]}};
    }
    // With such a wide core the rotation is rigid to 1e-8. The time is half a turn about y.
    const auto moved = advectLevelSet({grid, nullptr}, vortexFlow(0.5, 1e4), 0, 1, {.step = 0.02});
    const auto errors = errorsOf(*moved.levelSet.grid, {{-center[0], center[1], -center[2]}}, 0.25);
    CHECK(errors.surface < 2e-3);
    CHECK(errors.band < 4e-3);
    CHECK(moved.levelSet.grid->getName() == "surface");
    CHECK(moved.levelSet.grid->metaValue<std::string>("note") == "kept");
}

TEST_CASE("advectLevelSet: a sphere returns from the Enright deformation and keeps its volume where resolved",
          "[vdb]") {
    const LevelSet start = enrightBall(48);
    const auto end = advectLevelSet(start, enrightFlowInTime(3), 0, 3, {.step = 0.04});
    const auto errors = errorsOf(*end.levelSet.grid, {{0.35, 0.35, 0.35}}, 0.15);
    CAPTURE(errors.surface, errors.band);
    CHECK(errors.surface < 0.02);
    CHECK(std::abs(volumeChange(end.levelSet, start)) < 1e-3);
    // Half way, the sphere is a sheet one or two voxels thick. At the early time it is still well resolved.
    const auto early = advectLevelSet(start, enrightFlowInTime(3), 0, 0.4, {.step = 0.04});
    CHECK(std::abs(volumeChange(early.levelSet, start)) < 0.01);
    const auto sheet = advectLevelSet(start, enrightFlowInTime(3), 0, 1.5, {.step = 0.04});
    CHECK(sheet.levelSet.grid->activeVoxelCount() > 2 * start.grid->activeVoxelCount());
}

TEST_CASE("advectLevelSetWeno5: loses twenty times the volume of our method in the Enright test", "[vdb]") {
    const LevelSet start = enrightBall(24);
    const double ours = volumeChange(advectLevelSet(start, enrightFlowInTime(3), 0, 3, {.step = 0.05}).levelSet, start);
    double theirs = -1; // -1: nothing is left
    try {
        theirs = volumeChange(advectLevelSetWeno5(start, enrightFlowInTime(3), 0, 3), start);
    } catch (const ValueError&) {
    }
    CHECK(std::abs(ours) < std::abs(theirs) / 20);
}

TEST_CASE("advectLevelSetWeno5: moves a level set and leaves the original unchanged", "[vdb]") {
    const LevelSet start = ball({{0, 0, 0}}, 0.5, 0.05);
    const LevelSet moved = advectLevelSetWeno5(start, uniformFlow({{1, 0, 0}}), 0, 0.3);
    CHECK(errorsOf(*moved.grid, {{0.3, 0, 0}}, 0.5).surface < 0.1);
    CHECK(errorsOf(*start.grid, {{0, 0, 0}}, 0.5).surface < 1e-3); // the original is unchanged
    CHECK_THROWS_AS(advectLevelSetWeno5(start, uniformFlow({{1, 0, 0}}), 0, std::nan("")), ValueError);
}

TEST_CASE("advectLevelSet: a shape stays in place in its own contained flow", "[vdb]") {
    const LevelSet start = ball({{0, 0, 0}}, 1, 0.08);
    const auto moved = advectLevelSet(start, contained(0.4), 0, 1, {.step = 0.02});
    const auto errors = errorsOf(*moved.levelSet.grid, {{0, 0, 0}}, 1);
    CAPTURE(errors.surface, errors.band, moved.unconverged);
    CHECK(errors.mean < 0.05);
    CHECK(std::abs(volumeChange(moved.levelSet, start)) < 6e-3); // a voxel is 1/12 of the radius
    CHECK(beyondUnitSphere(*moved.levelSet.grid) < 1e-3);
    CHECK(moved.stalled == 0);
}

TEST_CASE("advectLevelSet: a sphere in a contained flow keeps its volume and does not cross the wall", "[vdb]") {
    std::array<double, 2> changes{};
    for (const size_t n : {size_t{0}, size_t{1}}) {
        if (kSanitized && n == 1) continue; // takes a minute
        // The sphere overlaps the wall's layer.
        const LevelSet start = ball({{0.3, 0, 0}}, 0.6, n == 0 ? 0.06 : 0.03);
        const auto moved = advectLevelSet(start, contained(0.2), 0, 0.3, {.step = 0.02});
        changes[n] = std::abs(volumeChange(moved.levelSet, start));
        CHECK(beyondUnitSphere(*moved.levelSet.grid) < 0);
    }
    CAPTURE(changes);
    CHECK(changes[0] < 0.01);
    CHECK(changes[1] < 0.0025);
}

TEST_CASE("LevelSetSequence: frames equal direct advection to their times", "[vdb]") {
    const bool steady = GENERATE(true, false);
    CAPTURE(steady);
    const FlowInTime flow = steady ? FlowInTime(enrightFlow()) : enrightFlowInTime(3);
    const LevelSet start = enrightBall(32);
    const FlowMapOptions map{.step = 0.02};
    LevelSetSequence sequence(start, flow, 0, {.map = map});
    AdvectedLevelSet last;
    for (int frame = 1; frame <= 5; ++frame) {
        last = sequence.advance(0.04 * frame);
        CHECK_FALSE(last.restarted);
        CHECK(sequence.time() == 0.04 * frame);
    }
    const auto alone = advectLevelSet(start, flow, 0, 0.2, map);
    // Both use the same frozen flows, since all steps begin at multiples of the same length.
    CHECK(greatestDifference(*last.levelSet.grid, *alone.levelSet.grid) < 1e-3);
    CHECK(greatestDifference(*alone.levelSet.grid, *last.levelSet.grid) < 1e-3);
    // Back to the start, advancing to the same time twice.
    sequence.advance(0.2);
    const auto back = sequence.advance(0);
    CHECK(errorsOf(*back.levelSet.grid, {{0.35, 0.35, 0.35}}, 0.15).surface < 0.01);
}

TEST_CASE("LevelSetSequence: restarts beyond its horizon with little loss of accuracy", "[vdb]") {
    const LevelSet start = ball({{0, 0, 0}}, 0.4, 0.05);
    LevelSetSequence sequence(start, uniformFlow({{1, 0, 0}}), 0, {.map = {.step = 1}, .horizon = 0.2});
    AdvectedLevelSet last;
    int restarts = 0;
    for (int frame = 1; frame <= 10; ++frame) {
        last = sequence.advance(0.1 * frame);
        restarts += last.restarted;
    }
    CHECK(restarts == 5);
    CHECK(errorsOf(*last.levelSet.grid, {{1, 0, 0}}, 0.4).surface < 0.01); // 0.001 per restart
    CHECK(last.levelSet.halfWidth() == Approx(3));
}

TEST_CASE("advectLevelSet: does not depend on the number of threads", "[vdb]") {
    std::vector<openvdb::FloatGrid::ConstPtr> grids;
    for (const int threads : {1, 2}) {
        const ThreadLimit limit(threads);
        grids.push_back(advectLevelSet(enrightBall(32), enrightFlowInTime(3), 0, 1, {.step = 0.05}).levelSet.grid);
    }
    CHECK(same(*grids[0], *grids[1]));
}

TEST_CASE("advectLevelSet: invalid level sets and options are errors that say why", "[vdb]") {
    const LevelSet start = ball({{0, 0, 0}}, 0.5, 0.1);
    const Flow flow = uniformFlow({{1, 0, 0}});
    const double nan = std::nan(""), infinity = std::numeric_limits<double>::infinity();
    CHECK_THROWS_AS(advectLevelSet(start, flow, 0, nan), ValueError);
    CHECK_THROWS_AS(advectLevelSet(start, flow, nan, 1), ValueError);
    CHECK_THROWS_AS(advectLevelSet(start, flow, 0, infinity), ValueError);
    CHECK_THROWS_AS(advectLevelSet(start, flow, 0, 1, {.step = -1}), ValueError);
    CHECK_THROWS_WITH(LevelSetSequence(start, flow, 0, {.horizon = 0}), Catch::ContainsSubstring("horizon"));
    CHECK_THROWS_AS(advectLevelSet(start, flow, 0, 1, {.step = 0.1}, {.report = {}, .cancelled = [] { return true; }}),
                    Interrupted);
    // A ball that contains one voxel centre. After the motion it lies between eight voxels and contains none.
    auto tiny = openvdb::FloatGrid::create(0.3f);
    tiny->setTransform(openvdb::math::Transform::createLinearTransform(0.1));
    tiny->setGridClass(openvdb::GRID_LEVEL_SET);
    for (auto voxel = openvdb::CoordBBox({-3, -3, -3}, {3, 3, 3}).begin(); voxel; ++voxel)
        if (const double d = 0.1 * (*voxel).asVec3d().length() - 0.08; d < 0.3)
            tiny->tree().setValue(*voxel, static_cast<float>(d));
    CHECK_THROWS_WITH(advectLevelSet({tiny, nullptr}, uniformFlow({{1, 1, 1}}), 0, 0.05),
                      Catch::ContainsSubstring("smaller voxels"));
}
