// SPDX-License-Identifier: Apache-2.0
#include "curlew/base/Error.h"
#include "curlew/field/Transforms.h"
#include "curlew/vdb/LevelSetBoolean.h"
#include "support/Meshes.h"
#include "support/Points.h"

#include <openvdb/tools/LevelSetMeasure.h>
#include <openvdb/tools/LevelSetSphere.h>

using namespace curlew;

namespace {

constexpr double kVoxel = 0.04;

LevelSet sphere(double x, double voxel = kVoxel) {
    return {openvdb::tools::createLevelSetSphere<openvdb::FloatGrid>(1, {static_cast<float>(x), 0, 0},
                                                                     static_cast<float>(voxel)),
            nullptr};
}

double volumeOf(const LevelSet& levelSet) { return openvdb::tools::levelSetVolume(*levelSet.grid); }

/// Returns the volume of the cap that a plane at distance `a` from the centre cuts off a unit ball.
double cap(double a) { return M_PI * (1 - a) * (1 - a) * (2 + a) / 3; }

/// Returns the greatest error in voxels, relative to the exact distance to a surface made of parts of two unit spheres,
/// 0.8 apart along x. `firstBelow` chooses the part of the first sphere with x below 0.4, otherwise that above;
/// `secondBelow` does so for the second.
double worst(const LevelSet& levelSet, bool firstBelow, bool secondBelow) {
    double most = 0;
    for (auto value = levelSet.grid->cbeginValueOn(); value; ++value) {
        const openvdb::Vec3d p = levelSet.grid->indexToWorld(value.getCoord());
        const double x = p[0] - 0.4, r = std::hypot(p[1], p[2]) - std::sqrt(1 - 0.16);
        double exact = std::hypot(x, r); // the circle in which the spheres intersect
        const auto see = [&](double center, bool below) {
            const double length = std::hypot(p[0] - center, p[1], p[2]);
            if (length > 0 && ((p[0] - center) / length < 0.4 - center) == below)
                exact = std::min(exact, std::abs(length - 1));
        };
        see(0, firstBelow);
        see(0.8, secondBelow);
        most = std::max(most, std::abs(std::abs(static_cast<double>(*value)) - exact) / levelSet.voxelSize());
    }
    return most;
}

} // namespace

TEST_CASE("level set boolean: union and intersection and difference of two spheres", "[vdb]") {
    const double ball = 4.0 / 3 * M_PI, shared = 2 * cap(0.4);
    const LevelSet a = sphere(0), b = sphere(0.8);
    const LevelSet both = combined(a, b, Boolean::unite), lens = combined(a, b, Boolean::intersect),
                   crescent = combined(a, b, Boolean::subtract);
    CHECK(volumeOf(both) == Approx(2 * ball - shared).epsilon(0.005));
    CHECK(volumeOf(lens) == Approx(shared).epsilon(0.01));
    CHECK(volumeOf(crescent) == Approx(ball - shared).epsilon(0.01));
    // Near the edges, fast sweeping is first-order accurate: within a third of a voxel, three voxels away.
    CHECK(worst(both, true, false) < 0.35);
    CHECK(worst(lens, false, true) < 0.35);
    CHECK(worst(crescent, true, true) < 1.1); // its edge has an angle of 47°, too sharp for the samples
    CHECK_THROWS_WITH(combined(a, sphere(5), Boolean::intersect), Catch::ContainsSubstring("do not overlap"));
    CHECK_THROWS_WITH(combined(a, a, Boolean::subtract), Catch::ContainsSubstring("nothing is left"));
}

TEST_CASE("level set boolean: operands on other grids are resampled and narrow bands widened", "[vdb]") {
    const double ball = 4.0 / 3 * M_PI, shared = 2 * cap(0.4);
    const LevelSet both = combined(widened(sphere(0), 5), sphere(0.8, 0.03), Boolean::unite);
    CHECK(both.halfWidth() == Approx(5));
    CHECK(both.voxelSize() == Approx(kVoxel));
    CHECK(volumeOf(both) == Approx(2 * ball - shared).epsilon(0.005));
    CHECK(worst(both, true, false) < 0.6); // at five voxels from the surface
}

TEST_CASE("level set boolean: the union of two meshes keeps the combined mesh", "[vdb]") {
    const auto of = [](const Mesh& mesh) { return meshToLevelSet(std::make_shared<Mesh>(mesh), {.voxel = kVoxel}); };
    const Mesh a = test::ball(5), b = test::moved(test::ball(5), {0.8f, 0, 0});
    const LevelSet both = combined(of(a), of(b), Boolean::unite);
    REQUIRE(both.mesh);
    CHECK(both.mesh->faces() == 2 * a.faces());
    CHECK(worst(both, true, false) < 0.25);
    // The other operations keep no mesh. The second level set is resampled to the voxels of the first.
    const LevelSet lens =
        combined(of(a), meshToLevelSet(std::make_shared<Mesh>(b), {.voxel = 0.07}), Boolean::intersect);
    CHECK_FALSE(lens.mesh);
    CHECK(worst(lens, false, true) < 0.35);
}

TEST_CASE("sampledShape: samples a shape on the grid of a level set", "[vdb]") {
    const LevelSet like = sphere(0), ball = sampledShape(sphereSdf(0.5), like);
    CHECK(volumeOf(ball) == Approx(M_PI / 6).epsilon(0.01));
    for (auto value = ball.grid->cbeginValueOn(); value; ++value) {
        const double exact = ball.grid->indexToWorld(value.getCoord()).length() - 0.5;
        if (std::abs(static_cast<double>(*value) - exact) > 1e-6)
            FAIL("off by " << static_cast<double>(*value) - exact);
    }
    // The half space is limited by the level set.
    const LevelSet dome = combined(like, sampledShape(planeSdf({{0, 1, 0}}, 0), like), Boolean::intersect);
    CHECK(volumeOf(dome) == Approx(2.0 / 3 * M_PI).epsilon(0.01));
    // A shape that lies between the voxel centres has no samples.
    const Placement between{.offset = {{0.02, 0.02, 0.02}}, .rotate = {}, .scale = {{1, 1, 1}}};
    CHECK_THROWS_AS(sampledShape(placed(sphereSdf(0.001), between), like), ValueError);
}

TEST_CASE("placed: meshes and level sets are transformed as shapes are", "[vdb]") {
    const Placement placement{.offset = {{3, -1, 2}}, .rotate = {{30, 40, 70}}, .scale = {{2, 2, 2}}};
    const Sdf box = boxSdf({{1, 0.6, 0.3}}, 0.05), there = placed(box, placement);
    const LevelSet levelSet = sampledShape(box, meshToLevelSet(std::make_shared<Mesh>(test::ball(3)), {.voxel = 0.02}));
    const LevelSet put = placed(levelSet, placement);
    CHECK(put.voxelSize() == Approx(0.04));
    for (auto value = put.grid->cbeginValueOn(); value; ++value) {
        const openvdb::Vec3d p = put.grid->indexToWorld(value.getCoord());
        const double exact = there.distance.at<0>({{p[0], p[1], p[2]}}).value;
        if (std::abs(static_cast<double>(*value) - exact) > 1e-5)
            FAIL("off by " << static_cast<double>(*value) - exact);
    }
    const Mesh ball = placed(test::ball(2), placement);
    for (const auto& p : ball.points)
        CHECK((openvdb::Vec3d(p) - openvdb::Vec3d(3, -1, 2)).length() == Approx(2).epsilon(1e-6));
    // The mesh and its level set are moved together.
    const LevelSet moved = placed(meshToLevelSet(std::make_shared<Mesh>(test::spot()), {.dim = 60}), placement);
    REQUIRE(moved.mesh);
    const Sdf sdf = sdfOf(moved);
    for (size_t n = 0; n < moved.mesh->points.size(); n += 37) {
        const auto& p = moved.mesh->points[n];
        CHECK(std::abs(sdf.distance.at<0>({{p[0], p[1], p[2]}}).value) < 0.5 * moved.voxelSize());
    }
    CHECK_THROWS_AS(placed(test::ball(1), Placement{.scale = {{1, 2, 1}}}), ValueError);
}

TEST_CASE("placed: velocity vectors rotate with their grid", "[vdb]") {
    auto grid = openvdb::Vec3SGrid::create();
    grid->tree().setValue({1, 2, 3}, {1, 0, 0});
    const auto put = placed(*grid, Placement{.offset = {{1, 0, 0}}, .rotate = {{0, 0, 90}}});
    const auto vectors = openvdb::GridBase::grid<openvdb::Vec3SGrid>(put);
    REQUIRE(vectors);
    const auto v = vectors->tree().getValue({1, 2, 3});
    CHECK(v[1] == Approx(1));
    const openvdb::Vec3d p = put->indexToWorld(openvdb::Coord(1, 2, 3));
    CHECK(p[0] == Approx(-1));
    CHECK(p[1] == Approx(1));
    grid->setGridClass(openvdb::GRID_STAGGERED);
    CHECK_THROWS_AS(placed(*grid, Placement{.rotate = {{0, 0, 90}}}), ValueError);
}

TEST_CASE("level set boolean: a shape that is larger than the level set gives the same values as its whole sample",
          "[vdb]") {
    const LevelSet ball = sphere(0);
    const Placement aside{.offset = {{2.3, 0.2, -0.1}}, .rotate = {{10, 20, 30}}, .scale = {{1, 1, 1}}};
    const Sdf shape = placed(boxSdf({{4, 4, 4}}, 0.4), aside); // its left side cuts the ball
    const LevelSet whole = sampledShape(shape, ball);
    const auto requireSame = [](const LevelSet& a, const LevelSet& b) {
        CHECK(a.grid->activeVoxelCount() == b.grid->activeVoxelCount());
        for (auto value = a.grid->cbeginValueOn(); value; ++value)
            if (b.grid->tree().getValue(value.getCoord()) != *value) FAIL("differs at " << value.getCoord());
    };
    requireSame(combined(ball, shape, Boolean::intersect), combined(ball, whole, Boolean::intersect));
    requireSame(combined(shape, ball, Boolean::intersect), combined(whole, ball, Boolean::intersect));
    requireSame(combined(ball, shape, Boolean::subtract), combined(ball, whole, Boolean::subtract));
    requireSame(combined(shape, ball, Boolean::subtract), combined(whole, ball, Boolean::subtract));
    requireSame(combined(ball, shape, Boolean::unite), combined(ball, whole, Boolean::unite));
    // A shape in the box of the level set, and unbounded ones that cut it or contain it.
    const Sdf small = sphereSdf(0.5);
    requireSame(combined(ball, small, Boolean::subtract), combined(ball, sampledShape(small, ball), Boolean::subtract));
    const Sdf cut = planeSdf({{0, 1, 0}}, 0);
    requireSame(combined(ball, cut, Boolean::intersect), combined(ball, sampledShape(cut, ball), Boolean::intersect));
    requireSame(combined(ball, planeSdf({{0, 1, 0}}, 7), Boolean::intersect), ball);
    CHECK_THROWS_WITH(combined(ball, planeSdf({{0, 1, 0}}, 7), Boolean::subtract),
                      Catch::ContainsSubstring("nothing is left"));
    requireSame(combined(ball, sphereSdf(1e7), Boolean::intersect), ball);
}

TEST_CASE("sampledShape: a shape with too many voxels is refused, and sampling can be stopped", "[vdb]") {
    const LevelSet ball = sphere(0);
    CHECK_THROWS_AS(sampledShape(sphereSdf(1e3), ball), ResourceError);
    CHECK_THROWS_AS(sampledShape(sphereSdf(1e12), ball), ResourceError);
    CHECK_THROWS_AS(combined(ball, sphereSdf(1e12), Boolean::unite), ResourceError);
    CHECK_THROWS_AS(sampledShape(sphereSdf(3), ball, {.report = {}, .cancelled = [] { return true; }}), Interrupted);
}

TEST_CASE("placed: vectors of doubles turn, distances of doubles scale, and colours stay", "[vdb]") {
    const Placement placement{.offset = {{1, 2, 3}}, .rotate = {{0, 0, 90}}, .scale = {{2, 2, 2}}};
    const auto vectors = openvdb::Vec3DGrid::create();
    vectors->tree().setValueOn({1, 2, 3}, openvdb::Vec3d(1, 0, 0));
    const auto turned = openvdb::gridPtrCast<openvdb::Vec3DGrid>(placed(*vectors, placement));
    CHECK((turned->tree().getValue({1, 2, 3}) - openvdb::Vec3d(0, 1, 0)).length() < 1e-12);
    const auto colors = openvdb::Vec3SGrid::create();
    colors->setName("Cd");
    colors->setVectorType(openvdb::VEC_INVARIANT);
    colors->tree().setValueOn({1, 2, 3}, openvdb::Vec3s(1, 0, 0));
    const auto kept = openvdb::gridPtrCast<openvdb::Vec3SGrid>(placed(*colors, placement));
    CHECK(kept->tree().getValue({1, 2, 3}) == openvdb::Vec3s(1, 0, 0));
    const auto ball = std::make_shared<openvdb::DoubleGrid>(*sphere(0).grid);
    ball->setGridClass(openvdb::GRID_LEVEL_SET);
    const auto larger = openvdb::gridPtrCast<openvdb::DoubleGrid>(placed(*ball, placement));
    CHECK(larger->background() == 2 * ball->background());
    for (auto value = ball->cbeginValueOn(); value; ++value)
        REQUIRE(larger->tree().getValue(value.getCoord()) == 2 * *value);
}
