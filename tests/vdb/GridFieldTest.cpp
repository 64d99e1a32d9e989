// SPDX-License-Identifier: Apache-2.0
#include "curlew/base/Error.h"
#include "curlew/field/Algebra.h"
#include "curlew/field/NoiseField.h"
#include "curlew/vdb/GridField.h"
#include "support/FiniteDifference.h"
#include "support/Points.h"

#include <openvdb/tools/ValueTransformer.h>

#include <cmath>
#include <limits>
#include <string>

using namespace curlew;
using Catch::Matchers::ContainsSubstring;

namespace {

const ScalarField kNoise = noiseField<Psrd3>({.seed = 4});

openvdb::FloatGrid::Ptr baked(double voxel, double half = 1) {
    return bakedGrid(kNoise, {.box = test::cube(half), .voxel = voxel}, "noise");
}

double errorOf(const ScalarField& field) {
    double worst = 0;
    for (const Vec3d& p : test::randomPoints(test::cube(0.6), 500, 1))
        worst = std::max(worst, std::abs(field.at<0>(p).value - kNoise.at<0>(p).value));
    return worst;
}

} // namespace

TEST_CASE("gridField: a baked field is reproduced to fourth order", "[vdb]") {
    const double coarse = errorOf(gridField(*baked(0.1))), fine = errorOf(gridField(*baked(0.05)));
    CAPTURE(coarse, fine);
    CHECK(test::observedOrder(coarse, fine) > 3.3); // the noise is C²
    CHECK(fine < 2e-3);
}

TEST_CASE("gridField: derivatives are exact inside the grid and across its border", "[vdb]") {
    const ScalarField field = gridField(*baked(0.1, 0.5)); // a hole of zeros is around it
    const auto points = test::randomPoints(test::cube(0.55), 1000, 2);
    test::requireDerivatives(field, points, 0.002, 5000);
    CHECK(field.at<1>({{0.9, 0.9, 0.9}}).value == 0);
}

TEST_CASE("gridField: tiles, backgrounds and transforms keep their values", "[vdb]") {
    auto grid = openvdb::FloatGrid::create(2);
    grid->setTransform(openvdb::math::Transform::createLinearTransform(0.5));
    grid->transform().postRotate(0.7, openvdb::math::Y_AXIS);
    grid->transform().postTranslate({10, 20, 30});
    grid->fill(openvdb::CoordBBox({0, 0, 0}, {31, 31, 31}), 5); // tiles and leaves
    REQUIRE(grid->tree().activeTileCount() > 0);
    const ScalarField field = gridField(*grid);
    const auto at = [&](double i, double j, double k) {
        const openvdb::Vec3d p = grid->indexToWorld(openvdb::Vec3d(i, j, k));
        return field.at<0>({{p[0], p[1], p[2]}}).value;
    };
    CHECK(at(15.3, 12.1, 20.7) == Approx(5).margin(1e-5));
    CHECK(at(-9, 3, 3) == 2);
    CHECK(at(-0.5, 15, 15) == Approx(3.5).margin(1e-5));
    const auto doubles = std::make_shared<openvdb::DoubleGrid>(*grid);
    CHECK(gridField(*doubles).at<0>({{10.2, 20.9, 30.4}}).value == field.at<0>({{10.2, 20.9, 30.4}}).value);
}

TEST_CASE("gridField: refuses vector, empty and non-cubic grids", "[vdb]") {
    CHECK_THROWS_WITH(gridField(*openvdb::FloatGrid::create()), ContainsSubstring("no active voxels"));
    const auto vectors = openvdb::Vec3SGrid::create();
    vectors->fill(openvdb::CoordBBox({0, 0, 0}, {3, 3, 3}), openvdb::Vec3s(1));
    CHECK_THROWS_WITH(gridField(*vectors), ContainsSubstring("vec3s"));
    auto grid = baked(0.25);
    grid->transform().preScale(openvdb::Vec3d(1, 2, 1));
    CHECK_THROWS_WITH(gridField(*grid), ContainsSubstring("cubes"));
    grid = baked(0.25);
    grid->tree().setValueOn({1, 1, 1}, std::numeric_limits<float>::quiet_NaN());
    CHECK_THROWS_WITH(gridField(*grid), ContainsSubstring("1 values"));
}

TEST_CASE("bakedGrid: samples the centres of the voxels, and constants become tiles", "[vdb]") {
    const Box box{{{0, 0, 0}}, {{1, 2, 0.52}}};
    const auto grid = bakedGrid(kNoise, {.box = box, .dim = 20}, "noise");
    CHECK(grid->evalActiveVoxelDim() == openvdb::Coord(10, 20, 5));
    CHECK(grid->voxelSize()[0] == Approx(0.1));
    const auto p = grid->indexToWorld(openvdb::Coord(3, 11, 2));
    CHECK((p - openvdb::Vec3d(0.35, 1.15, 0.25)).length() < 1e-12);
    CHECK(grid->tree().getValue({3, 11, 2}) == kNoise.at<0, float>({{p[0], p[1], p[2]}}).value);
    const auto flat = bakedGrid(constantField(3), {.box = test::cube(1), .dim = 64}, "flat");
    CHECK(flat->tree().leafCount() == 0);
    CHECK(flat->activeVoxelCount() == 64 * 64 * 64);
    CHECK_THROWS_AS(bakedGrid(kNoise, {.box = Box{}}, "empty"), ValueError);
    CHECK_THROWS_AS(bakedGrid(kNoise, {.box = test::cube(1), .voxel = 1e-12}, "huge"), ValueError);
    CHECK_THROWS_AS(bakedGrid(kNoise, {.box = test::cube(1), .dim = 100000}, "huge"), ResourceError);
}

TEST_CASE("bakedGrid: a period of a field tiles without a seam", "[vdb]") {
    const ScalarField tile = noiseField<Psrd3>({.period = {{4, 4, 4}}}, {.frequency = 4});
    const auto one = bakedGrid(tile, {.box = {{{0, 0, 0}}, {{1, 1, 1}}}, .dim = 32}, "tile");
    const auto two = bakedGrid(tile, {.box = {{{0, 0, 0}}, {{2, 1, 1}}}, .dim = 64}, "tiles");
    size_t different = 0;
    for (auto value = two->cbeginValueOn(); value; ++value) {
        const openvdb::Coord ijk = value.getCoord();
        different += std::abs(one->tree().getValue({ijk[0] % 32, ijk[1], ijk[2]}) - *value) > 1e-6f;
    }
    CHECK(different == 0);
}

TEST_CASE("gridField: refuses voxels at the limits of int, and inactive values that are not finite", "[vdb]") {
    for (const int far : {2147483641, -2147483641}) {
        auto grid = openvdb::FloatGrid::create();
        grid->tree().setValueOn({0, far, 0}, 1);
        CHECK_THROWS_WITH(gridField(*grid), ContainsSubstring("index " + std::to_string(far)));
    }
    const auto near = openvdb::FloatGrid::create();
    near->tree().setValueOn({0, 1 << 29, 0}, 1);
    CHECK(gridField(*near).at<0>({{0, 0x1p29, 0}}).value > 0);
    const auto grid = baked(0.25);
    grid->tree().setValueOff({1, 1, 1}, std::numeric_limits<float>::quiet_NaN());
    CHECK_THROWS_WITH(gridField(*grid), ContainsSubstring("1 values"));
}
