// SPDX-License-Identifier: Apache-2.0
#include "curlew/base/Error.h"
#include "curlew/base/Random.h"
#include "curlew/field/Algebra.h"
#include "curlew/field/Bound.h"
#include "curlew/field/NoiseField.h"
#include "curlew/vdb/LevelSet.h"
#include "support/Lattices.h"
#include "support/Points.h"

#include <openvdb/tools/ChangeBackground.h>
#include <openvdb/tools/LevelSetSphere.h>

#include <cmath>

using namespace curlew;

namespace {

/// A closed mesh of a sphere: the six faces of a cube, subdivided and projected onto the sphere, all quads.
std::shared_ptr<const Mesh> cubeSphere(double radius, int division) {
    auto mesh = std::make_shared<Mesh>();
    std::map<std::array<int, 3>, openvdb::Index32> known;
    const auto vertex = [&](std::array<int, 3> p) {
        const auto [entry, isNew] = known.emplace(p, static_cast<openvdb::Index32>(mesh->points.size()));
        if (isNew) {
            openvdb::Vec3d v(p[0], p[1], p[2]);
            mesh->points.emplace_back(openvdb::Vec3s(v * (radius / v.length())));
        }
        return entry->second;
    };
    for (size_t axis = 0; axis < 3; ++axis)
        for (const int side : {-division, division})
            for (int a = -division; a < division; a += 2)
                for (int b = -division; b < division; b += 2) {
                    openvdb::Vec4I quad;
                    for (int corner = 0; corner < 4; ++corner) {
                        std::array<int, 3> p{};
                        p[axis] = side;
                        p[(axis + 1) % 3] = a + (corner == 1 || corner == 2 ? 2 : 0);
                        p[(axis + 2) % 3] = b + (corner >= 2 ? 2 : 0);
                        quad[side > 0 ? corner : 3 - corner] = vertex(p);
                    }
                    mesh->quads.push_back(quad);
                }
    return mesh;
}

/// A level set whose samples are the exact distance to a sphere, so that the spline can be compared with exact values.
LevelSet exactSphere(double radius, double voxel, int halfWidth) {
    auto grid = openvdb::FloatGrid::create(static_cast<float>(halfWidth * voxel));
    grid->setTransform(openvdb::math::Transform::createLinearTransform(voxel));
    grid->setGridClass(openvdb::GRID_LEVEL_SET);
    const int n = static_cast<int>(std::ceil(radius / voxel)) + halfWidth + 1;
    auto accessor = grid->getAccessor();
    for (int i = -n; i <= n; ++i)
        for (int j = -n; j <= n; ++j)
            for (int k = -n; k <= n; ++k) {
                const double d = voxel * std::sqrt(double(i * i + j * j + k * k)) - radius;
                if (std::abs(d) < halfWidth * voxel)
                    accessor.setValue({i, j, k}, static_cast<float>(d));
                else if (d < 0)
                    accessor.setValueOff({i, j, k}, static_cast<float>(-halfWidth * voxel));
            }
    return {grid, nullptr};
}

Vec3d onSphere(double radius, uint64_t k) {
    const double z = 2 * randomUniform(5, k, 0) - 1, angle = 2 * M_PI * randomUniform(5, k, 1),
                 r = std::sqrt(1 - z * z);
    return Vec3d{{r * std::cos(angle), r * std::sin(angle), z}} * radius;
}

} // namespace

TEST_CASE("sdfOf: the spline converges with orders 4 and 3 and 2 for value and gradient and Hessian", "[vdb]") {
    // Greatest errors on spheres near the surface, for three voxel sizes, each half of the one before. The radius is 1,
    // so that fourth derivatives are O(1).
    std::array<std::array<double, 3>, 3> errors{};
    const std::array<double, 3> voxels{0.1, 0.05, 0.025};
    for (size_t n = 0; n < voxels.size(); ++n) {
        const Sdf sdf = sdfOf(exactSphere(1, voxels[n], 8));
        for (uint64_t k = 0; k < 2000; ++k) {
            const double radius = 1 + (randomUniform(6, k) - 0.5) * 0.1;
            const Vec3d p = onSphere(radius, k), normal = p * (1 / radius);
            const auto jet = sdf.distance.at<2>(p);
            errors[0][n] = std::max(errors[0][n], std::abs(jet.value - (radius - 1)));
            errors[1][n] = std::max(errors[1][n], length(jet.gradient - normal));
            for (int i = 0; i < 3; ++i)
                for (int j = i; j < 3; ++j)
                    errors[2][n] =
                        std::max(errors[2][n],
                                 std::abs(jet.hessian(i, j) - ((i == j ? 1 : 0) - normal[i] * normal[j]) / radius));
        }
    }
    const std::array<double, 3> orders{4, 3, 2};
    for (size_t derivative = 0; derivative < 3; ++derivative)
        for (size_t n = 1; n < 3; ++n) {
            CAPTURE(derivative, n, errors[derivative][n - 1], errors[derivative][n]);
            // Samples are floats. Their rounding error, 6e-8 / h per derivative, affects the finest Hessian slightly.
            CHECK(std::log2(errors[derivative][n - 1] / errors[derivative][n]) > orders[derivative] - 0.4);
        }
}

TEST_CASE("sdfOf: the spline is C² across leaves with exact derivatives", "[vdb]") {
    const double voxel = 0.1;
    const Sdf sdf = sdfOf(exactSphere(1, voxel, 8));
    for (uint64_t k = 0; k < 500; ++k) {
        Vec3d p = onSphere(1, k);
        CAPTURE(p[0], p[1], p[2]);
        // The tolerance is the error of central differences of the jets: h² times a third derivative.
        const double h = 1e-5;
        const auto jet = sdf.distance.at<2>(p);
        for (int i = 0; i < 3; ++i) {
            Vec3d step;
            step[i] = h;
            const auto up = sdf.distance.at<1>(p + step), down = sdf.distance.at<1>(p - step);
            CHECK(jet.gradient[i] == Approx((up.value - down.value) / (2 * h)).margin(1e-8));
            for (int j = 0; j < 3; ++j)
                CHECK(jet.hessian(i, j) == Approx((up.gradient[j] - down.gradient[j]) / (2 * h)).margin(2e-4));
        }
        // Move to a face between voxels; every eighth is a face between leaves. Both sides agree there.
        p[0] = std::round(p[0] / voxel) * voxel;
        const auto left = sdf.distance.at<2>(p - Vec3d{{1e-9, 0, 0}}),
                   right = sdf.distance.at<2>(p + Vec3d{{1e-9, 0, 0}});
        for (int c = 0; c < Jet<double, 3, 2>::kSize; ++c)
            CHECK(left.component(c) == Approx(right.component(c)).margin(1e-6));
    }
}

TEST_CASE("sdfOf: float agrees with double", "[vdb]") {
    const Sdf sdf = sdfOf(exactSphere(1, 0.1, 8));
    for (uint64_t k = 0; k < 500; ++k) {
        const Vec3d p = onSphere(1, k);
        const auto exact = sdf.distance.at<1>(p);
        const auto rounded = sdf.distance.at<1, float>(p);
        CAPTURE(k);
        CHECK(static_cast<double>(rounded.value) == Approx(exact.value).margin(1e-6));
        CHECK(static_cast<double>(rounded.gradient[0]) == Approx(exact.gradient[0]).margin(1e-5));
    }
}

TEST_CASE("sdfOf: values stay within the range of the spline", "[vdb]") {
    const Sdf sdf = sdfOf(exactSphere(1, 0.1, 5));
    const Interval range = sdf.distance.range();
    CHECK(range.finite());
    CHECK(range.maxAbs() < 2 * 0.5); // twice the band: filtered samples hardly exceed the samples
    test::Worst worst;
    for (const Vec3d& p : test::randomPoints(test::cube(2), 20000, 7))
        worst.see(std::abs(sdf.distance.at<0>(p).value), p);
    CAPTURE(worst.where);
    CHECK(worst.value <= range.maxAbs());
    // The range makes it usable as a divisor if it is shifted away from zero.
    CHECK_NOTHROW(constantField(1) / (sdf.distance + constantField(2)));
}

TEST_CASE("sdfOf: is constant beyond the band and at NaN positions", "[vdb]") {
    const Sdf sdf = sdfOf(exactSphere(1, 0.1, 5));
    CHECK(sdf.distance.at<0>({{0, 0, 0}}).value == Approx(-0.5));
    CHECK(sdf.distance.at<0>({{100, 0, 0}}).value == Approx(0.5));
    CHECK(sdf.distance.at<0>({{1e300, 0, 0}}).value == Approx(0.5));
    CHECK(sdf.distance.at<0>({{std::nan(""), 0, 0}}).value == Approx(0.5));
    CHECK(sdf.reach == Approx(0.2));
    CHECK(sdf.bounds.contains({{0.99, 0, 0}}));
    CHECK_FALSE(sdf.bounds.contains({{1.25, 0, 0}}));
}

TEST_CASE("sdfOf: parts far from each other have the same values as a part alone", "[vdb]") {
    constexpr float kVoxel = 0.1F, kFar = 70; // 176 leaves along each axis
    const auto sphere = [](float x) {
        return openvdb::tools::createLevelSetSphere<openvdb::FloatGrid>(1, openvdb::Vec3f(x), kVoxel);
    };
    const auto both = sphere(kFar);
    both->tree().merge(sphere(-kFar)->tree());
    const Sdf far = sdfOf(levelSetOf(both)), alone = sdfOf(levelSetOf(sphere(kFar)));
    size_t inBand = 0;
    for (const Vec3d& p : test::randomPoints(test::cube(1.6), 2000, 4)) {
        const Vec3d at = p + Vec3d{{kFar, kFar, kFar}};
        const auto value = far.distance.at<1>(at), expected = alone.distance.at<1>(at);
        REQUIRE(value.value == expected.value);
        REQUIRE(value.gradient == expected.gradient);
        inBand += dot(value.gradient, value.gradient) > 0;
        REQUIRE(far.distance.at<0>(at - Vec3d{{kFar, kFar, kFar}}).value == Approx(3 * kVoxel)); // between the two
    }
    CHECK(inBand > 500);
}

TEST_CASE("sdfOf: measures the Lipschitz bound of a level set", "[vdb]") {
    const LevelSet sphere = exactSphere(1, 0.1, 6);
    CHECK(sdfOf(sphere).lipschitz == Approx(1.1).epsilon(0.1));
    // A level set whose values are three times the distance.
    auto steep = sphere.grid->deepCopy();
    openvdb::tools::changeLevelSetBackground(steep->tree(), 3 * sphere.grid->background());
    for (auto value = steep->beginValueOn(); value; ++value) value.setValue(3 * *value);
    const Sdf sdf = sdfOf({steep, nullptr});
    CHECK(sdf.lipschitz == Approx(3.3).epsilon(0.1));
    // The distance from the wall takes the Lipschitz bound into account: a batch gives the same values as single
    // positions.
    const ScalarField field = bounded(constantField(0.1), Wall{sdf, Side::inside, 0.5}, {.amplitude = 0});
    PointBatch points;
    for (const Vec3d& offset : test::randomPoints(test::cube(0.12), kBatch, 3))
        points.push(Vec3d{{0.72, 0, 0}} + offset);
    JetBatch<double, 1> jets;
    field.eval(points, jets);
    for (int i = 0; i < points.size; ++i) CHECK(jets[i].value == field.at<1>(points[i]).value);
}

TEST_CASE("sdfOf: grids may be rotated and translated and scaled", "[vdb]") {
    LevelSet levelSet = exactSphere(1, 0.1, 8);
    auto grid = levelSet.grid->deepCopy();
    grid->transform().postRotate(0.7, openvdb::math::Y_AXIS);
    grid->transform().postScale(2.0);
    grid->transform().postTranslate({3, -1, 2});
    levelSet = levelSetOf(grid);
    const Sdf sdf = sdfOf(levelSet);
    // In voxel units, the samples are still those of the small sphere, so the values are half the distance.
    const Vec3d center{{3, -1, 2}};
    for (uint64_t k = 0; k < 100; ++k) {
        const Vec3d normal = onSphere(1, k);
        const auto jet = sdf.distance.at<1>(center + normal * 2.1);
        CAPTURE(k);
        CHECK(jet.value == Approx(0.05).margin(1e-4));
        for (int i = 0; i < 3; ++i) CHECK(jet.gradient[i] == Approx(0.5 * normal[i]).margin(1e-3));
    }
}

TEST_CASE("meshToLevelSet: samples the surface of a mesh", "[vdb]") {
    const LevelSet levelSet = meshToLevelSet(cubeSphere(1, 40), {.dim = 50});
    CHECK(levelSet.voxelSize() == Approx(0.04).epsilon(1e-3));
    CHECK(levelSet.halfWidth() == Approx(3));
    const Sdf sdf = sdfOf(levelSet);
    // The facets lie inside the sphere by at most (edge length)² / 8 ≈ (1/20)² / 4.
    for (uint64_t k = 0; k < 500; ++k) CHECK(std::abs(sdf.distance.at<0>(onSphere(1, k)).value) < 1e-3);
}

TEST_CASE("widened: extends the band without moving the surface", "[vdb]") {
    for (const bool fromMesh : {true, false}) {
        LevelSet narrow = meshToLevelSet(cubeSphere(1, 40), {.dim = 50});
        if (!fromMesh) narrow.mesh = nullptr;
        const LevelSet wide = widened(narrow, 8.5);
        CAPTURE(fromMesh);
        CHECK(wide.halfWidth() == Approx(8.5));
        CHECK(wide.grid->activeVoxelCount() > 2 * narrow.grid->activeVoxelCount());
        for (auto value = narrow.grid->cbeginValueOn(); value; ++value) {
            const double difference =
                std::abs(static_cast<double>(*value - wide.grid->tree().getValue(value.getCoord())));
            if (difference > 1e-5) FAIL("a sample moved by " << difference);
        }
        // The added samples are distances, within a fraction of a voxel: first-order fast sweeping and facets both are.
        const Sdf sdf = sdfOf(wide);
        for (const double r : {0.85, 1.15})
            for (uint64_t k = 0; k < 100; ++k)
                CHECK(sdf.distance.at<0>(onSphere(r, k)).value == Approx(r - 1).margin(0.01));
        CHECK(sdf.distance.at<0>({{0, 0, 0}}).value < -0.3);
        CHECK(sdf.distance.at<0>({{9, 0, 0}}).value > 0.3);
        CHECK(widened(wide, 5).grid == wide.grid);
    }
}

TEST_CASE("widened: without a mesh, the band is as wide in every direction, in any unit", "[vdb]") {
    const double unit = GENERATE(1.0, 1e4);
    const double voxel = 0.05 * unit;
    const LevelSet narrow{
        openvdb::tools::createLevelSetSphere<openvdb::FloatGrid>(float(unit), {0, 0, 0}, float(voxel), 3), nullptr};
    const LevelSet wide = widened(narrow, 15);
    const Sdf sdf = sdfOf(wide);
    for (const Vec3d& p : test::randomPoints(test::cube(1.7 * unit), 2000, 1)) {
        const double exact = length(p) - unit;
        if (exact < -0.55 * unit || exact > sdf.reach) continue;
        const double d = sdf.distance.at<0>(p).value;
        CAPTURE(unit, p, exact, d);
        CHECK(std::abs(d - exact) < 0.3 * voxel); // sweeping is of first order
    }
    for (auto value = wide.grid->cbeginValueOn(); value; ++value) REQUIRE(std::abs(*value) < wide.grid->background());
    for (auto value = narrow.grid->cbeginValueOn(); value; ++value)
        REQUIRE(wide.grid->tree().getValue(value.getCoord()) == *value);
}

TEST_CASE("meshToLevelSet: invalid meshes and options are refused", "[vdb]") {
    const auto sphere = cubeSphere(1, 8);
    auto flat = std::make_shared<Mesh>();
    flat->points = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    flat->triangles = {{0, 1, 2}, {0, 2, 1}};
    CHECK_THROWS_WITH(meshToLevelSet(flat, {.dim = 32}), Catch::ContainsSubstring("encloses nothing"));
    auto degenerate = std::make_shared<Mesh>();
    degenerate->points = {{0, 0, 0}, {1, 0, 0}};
    degenerate->triangles = {{0, 1, 1}};
    CHECK_THROWS_WITH(meshToLevelSet(degenerate, {}), Catch::ContainsSubstring("degenerate"));
    CHECK_THROWS_AS(meshToLevelSet(std::make_shared<Mesh>(), {}), ValueError);
    CHECK_THROWS_AS(meshToLevelSet(sphere, {.voxel = -1}), ValueError);
    CHECK_THROWS_AS(meshToLevelSet(sphere, {.dim = 0}), ValueError);
    CHECK_THROWS_AS(meshToLevelSet(sphere, {.voxel = 1e-30}), Error);
    CHECK_THROWS_WITH(meshToLevelSet(sphere, {.voxel = 1e-6}), Catch::ContainsSubstring("memory"));
    CHECK_THROWS_AS(meshToLevelSet(sphere, {.dim = 32, .halfWidth = 0}), ValueError);
}

TEST_CASE("meshToLevelSet: can be cancelled", "[vdb]") {
    CHECK_THROWS_AS(meshToLevelSet(cubeSphere(1, 40), {.dim = 100}, {.report = {}, .cancelled = [] { return true; }}),
                    Interrupted);
}

TEST_CASE("levelSetOf: a background far beyond the distances does not count as the width of the band", "[vdb]") {
    const LevelSet sphere = exactSphere(1, 0.1, 3);
    const auto foreign = sphere.grid->deepCopy();
    openvdb::tools::changeLevelSetBackground(foreign->tree(), 1000.0f);
    const LevelSet read = levelSetOf(foreign);
    CHECK(read.halfWidth() > 2.5);
    CHECK(read.halfWidth() < 4.5);
    CHECK(read.grid->tree().getValue(openvdb::Coord(0)) == -read.grid->background());
    CHECK(read.grid->activeVoxelCount() == foreign->activeVoxelCount());
    CHECK(foreign->background() == 1000);
    // The same with active voxels and tiles that hold it.
    const auto filled = foreign->deepCopy();
    for (auto value = filled->beginValueOff(); value; ++value) value.setActiveState(true);
    CHECK(filled->activeVoxelCount() > 10 * foreign->activeVoxelCount());
    const LevelSet marked = levelSetOf(filled);
    CHECK(marked.grid->background() == read.grid->background());
    CHECK(marked.grid->tree().getValue(openvdb::Coord(0)) == -read.grid->background());
    CHECK(marked.grid->activeVoxelCount() == foreign->activeVoxelCount());
    // Another one inside.
    for (auto value = filled->beginValueOn(); value; ++value)
        if (*value == -1000) value.setValue(-500);
    CHECK(levelSetOf(filled).grid->background() == read.grid->background());
    // Distances that differ by a voxel from one to the next are all believed.
    const LevelSet steep = exactSphere(1, 0.1, 8);
    CHECK(levelSetOf(steep.grid).grid == steep.grid);
}

TEST_CASE("levelSetOf: of an array of clipped distances, only the others count", "[vdb]") {
    constexpr float kVoxel = 0.1f, kMost = 3 * kVoxel;
    const auto grid = openvdb::FloatGrid::create(kMost);
    grid->setGridClass(openvdb::GRID_LEVEL_SET);
    grid->setTransform(openvdb::math::Transform::createLinearTransform(static_cast<double>(kVoxel)));
    auto to = grid->getAccessor();
    const openvdb::CoordBBox box(openvdb::Coord(-14), openvdb::Coord(14));
    for (auto ijk = box.begin(); ijk; ++ijk) {
        const auto distance = static_cast<float>((*ijk).asVec3d().length()) * kVoxel - 1;
        to.setValue(*ijk, std::clamp(distance, -kMost, kMost));
    }
    const LevelSet read = levelSetOf(grid);
    CHECK(read.grid->activeVoxelCount() < grid->activeVoxelCount() / 2);
    const Sdf sdf = sdfOf(widened(read, 9));
    for (const Vec3d& p : test::randomPoints(test::cube(1.5), 500, 1)) {
        const double exact = length(p) - 1;
        if (exact > -0.5 && exact < sdf.reach) // sweeping is of first order
            CHECK(sdf.distance.at<0>(p).value == Approx(exact).margin(0.03));
    }
    // A mask is no array of distances.
    for (auto value = grid->beginValueOn(); value; ++value) value.setValue(std::copysign(kMost, *value));
    CHECK(levelSetOf(grid).grid == grid);
}

TEST_CASE("levelSetOf: accepts only valid float level sets", "[vdb]") {
    CHECK_THROWS_WITH(levelSetOf(openvdb::Vec3SGrid::create()), Catch::ContainsSubstring("float"));
    auto grid = openvdb::FloatGrid::create(1.0f);
    CHECK_THROWS_WITH(levelSetOf(grid), Catch::ContainsSubstring("class"));
    grid->setGridClass(openvdb::GRID_LEVEL_SET);
    CHECK_THROWS_WITH(levelSetOf(grid), Catch::ContainsSubstring("encloses nothing"));
    grid->tree().setValue({0, 0, 0}, std::nanf(""));
    CHECK_THROWS_WITH(levelSetOf(grid), Catch::ContainsSubstring("finite"));
    auto sphere = openvdb::tools::createLevelSetSphere<openvdb::FloatGrid>(1, {0, 0, 0}, 0.1f);
    CHECK(levelSetOf(sphere).halfWidth() == Approx(3));
    sphere->transform().postScale({1, 2, 1});
    CHECK_THROWS_WITH(levelSetOf(sphere), Catch::ContainsSubstring("cubic"));
}

TEST_CASE("levelSetOf: accepts cubic voxels of any size and rotation", "[vdb]") {
    const auto sphere = openvdb::tools::createLevelSetSphere<openvdb::FloatGrid>(1, {0, 0, 0}, 0.1f);
    for (const double scale : {1e-3, 0.01, 1.0, 1e3}) {
        auto grid = sphere->deepCopy();
        grid->transform().postScale(scale);
        for (int turns = 0; turns < 100; ++turns) {
            grid->transform().postRotate(0.0654, turns % 2 == 0 ? openvdb::math::Y_AXIS : openvdb::math::Z_AXIS);
            CAPTURE(scale, turns);
            REQUIRE(levelSetOf(grid).voxelSize() == Approx(0.1 * scale));
        }
        grid->transform().postShear(0.01, openvdb::math::X_AXIS, openvdb::math::Y_AXIS);
        CHECK_THROWS_WITH(levelSetOf(grid), Catch::ContainsSubstring("cubic"));
    }
}

TEST_CASE("LevelSet: a spline has the same bits on a lattice as at single positions", "[vdb]") {
    // Finer and coarser than the voxels of 0.05; the coarsest is computed position by position.
    const auto step = GENERATE(0.013, 0.05, 0.077, 0.4);
    const auto count = static_cast<size_t>(std::min(33.0, 3 / step));
    const auto x = test::coordinates(-1.31, step, count), y = test::coordinates(-0.4, step, count),
               z = test::coordinates(0.2 - 0.5 * step * static_cast<double>(count), step, count);
    const PointLattice lattice{{x, y, z}};
    const Sdf sdf = sdfOf(exactSphere(1, 0.05, 6));
    CHECK(test::differing(sdf.distance, lattice) == 0);
    const auto noise = noiseField<Psrd3>({.seed = 1}, {.frequency = 2});
    CHECK(test::differing(bounded(noise, Wall{.sdf = sdf, .side = Side::inside, .width = 0.15}), lattice) == 0);
    std::vector<uint32_t> some; // half of the positions, in groups
    for (uint32_t n = 0; n < lattice.size(); ++n)
        if (n % 100 < 50) some.push_back(n);
    CHECK(test::differing(sdf.distance, PointLattice{{x, y, z}, some}) == 0);
    // Far from the level set there is only its background.
    const auto far = test::coordinates(10, step, 9);
    CHECK(test::differing(sdf.distance, PointLattice{{far, far, far}}) == 0);
    // Descending coordinates.
    const std::vector<double> down(z.rbegin(), z.rend());
    CHECK(test::differing(sdf.distance, PointLattice{{x, y, down}}) == 0);
}
