// SPDX-License-Identifier: Apache-2.0
#include "curlew/base/Error.h"
#include "curlew/vdb/WideSdf.h"
#include "support/FiniteDifference.h"
#include "support/Lattices.h"
#include "support/SymbolInterpreter.h"

#include <openvdb/tools/LevelSetSphere.h>

#include <cmath>

using namespace curlew;
using test::randomPoints;

namespace {

constexpr double kRadius = 1, kVoxel = 0.04;

/// A ball without a mesh.
LevelSet ball() {
    return {openvdb::tools::createLevelSetSphere<openvdb::FloatGrid>(float(kRadius), {0, 0, 0}, float(kVoxel), 3),
            nullptr};
}

/// A box between -size/2 and size/2.
LevelSet boxOf(const Vec3d& size, double voxel) {
    auto mesh = std::make_shared<Mesh>();
    for (int k = 0; k < 8; ++k)
        mesh->points.emplace_back(float((k & 1 ? 0.5 : -0.5) * size[0]), float((k & 2 ? 0.5 : -0.5) * size[1]),
                                  float((k & 4 ? 0.5 : -0.5) * size[2]));
    mesh->quads = {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}};
    return meshToLevelSet(mesh, {.voxel = voxel});
}

double distanceToBox(const Vec3d& size, const Vec3d& p) {
    double squares = 0, deepest = -1e9;
    for (int i = 0; i < 3; ++i) {
        const double beyond = std::abs(p[i]) - size[i] / 2;
        squares += std::max(beyond, 0.0) * std::max(beyond, 0.0);
        deepest = std::max(deepest, beyond);
    }
    return deepest > 0 ? std::sqrt(squares) : deepest;
}

} // namespace

TEST_CASE("sdfUpTo: a narrow request is one band", "[vdb]") {
    const LevelSet levelSet = ball();
    const Sdf one = sdfOf(widened(levelSet, 0.4 / levelSet.voxelSize() + kSplineSupport)),
              same = sdfUpTo(levelSet, 0.4);
    for (const Vec3d& p : randomPoints(test::cube(1.3), 500, 1))
        CHECK(same.distance.at<1>(p).gradient == one.distance.at<1>(p).gradient);
    CHECK(same.reach == one.reach);
}

TEST_CASE("sdfUpTo: a recorded one has the same distances and gradients", "[vdb]") {
    // The same operations, except that the rows of the matrix to voxels are summed in another order.
    const LevelSet levelSet = ball();
    for (const Sdf& sdf : {sdfOf(levelSet), sdfUpTo(levelSet, 2), sdfOf(boxOf({{1, 1.2, 0.8}}, 0.05))}) {
        const auto exact = test::symbolErrors<double>(sdf.distance, test::cube(2.5), 3000, 1);
        CHECK(exact.value < 1e-12);
        CHECK(exact.gradient < 1e-12);
        const auto rounded = test::symbolErrors<float>(sdf.distance, test::cube(2.5), 3000, 2);
        CHECK(rounded.value < 1e-6);
        CHECK(rounded.gradient < 1e-5);
    }
}

TEST_CASE("sdfUpTo: bands of larger voxels continue the distance to a ball", "[vdb]") {
    const Sdf sdf = sdfUpTo(ball(), 3); // 75 voxels
    CHECK(sdf.reach == Approx(3));
    CHECK(sdf.lipschitz < 2); // at the edge of the outermost band, where it levels off
    for (const Vec3d& p : randomPoints(test::cube(2.2), 4000, 2)) {
        const double exact = length(p) - kRadius;
        if (exact < -0.6 * kRadius) continue; // within two voxels of the widest band of the kink at the centre
        const auto d = sdf.distance.at<1>(p);
        CAPTURE(p, exact, d.value);
        // The distance to the polygons of the level set, and linear sweeping at the edge of its band.
        if (std::abs(d.value - exact) > std::max(0.1 * kVoxel, 0.01 * std::abs(exact))) FAIL("wrong distance");
        if (length(d.gradient - p * (1 / length(p))) > 0.05) FAIL("wrong gradient");
        if (length(d.gradient) > sdf.lipschitz + 1e-6) FAIL("steeper than its bound");
    }
}

TEST_CASE("sdfUpTo: value and derivatives at the surface are those of the finest band", "[vdb]") {
    const LevelSet levelSet = ball();
    const Sdf fine = sdfOf(widened(levelSet, 16)), wide = sdfUpTo(levelSet, 3);
    for (const Vec3d& p : randomPoints(test::cube(1.1), 20000, 3)) {
        const auto a = fine.distance.at<1>(p), b = wide.distance.at<1>(p);
        if (std::abs(a.value) > 0.5 * kVoxel) continue;
        CAPTURE(p, a.value);
        CHECK(std::abs(a.value - b.value) < 1e-4 * kVoxel);
        CHECK((a.value < 0) == (b.value < 0));
        CHECK(length(a.gradient - b.gradient) < 1e-3);
    }
}

TEST_CASE("sdfUpTo: derivatives are exact where bands blend", "[vdb]") {
    const Sdf sdf = sdfUpTo(boxOf({{1.2, 0.9, 1}}, kVoxel), 2);
    const auto errors = test::derivativeErrors(sdf.distance, randomPoints(test::cube(1.2), 2000, 4), 1e-4);
    // The spline's third derivatives jump by up to a few per voxel squared.
    CHECK(errors.worstGradient() < 1e-3);
    CHECK(errors.worstHessian() < 0.02 / kVoxel);
}

TEST_CASE("sdfUpTo: one band passes over into the next without a jump", "[vdb]") {
    const double halfWidth = GENERATE(3.0, 40.0); // of the level set
    const Sdf sdf = sdfUpTo(widened(ball(), halfWidth), 3);
    constexpr double kStep = 0.01 * kVoxel;
    for (uint64_t ray = 0; ray < 5; ++ray) {
        const Vec3d direction = normalized(test::randomPoint(test::cube(1), 7, ray));
        auto before = sdf.distance.at<1>(direction * kRadius);
        double value = 0, gradient = 0;
        for (double r = kRadius + kStep; r < kRadius + 50 * kVoxel; r += kStep) {
            const auto here = sdf.distance.at<1>(direction * r);
            value = std::max(value, std::abs(here.value - before.value - kStep));
            gradient = std::max(gradient, length(here.gradient - before.gradient));
            before = here;
        }
        CAPTURE(ray);
        CHECK(value < 0.05 * kStep); // the gradient of the distance is not quite 1
        CHECK(gradient < 4 * kStep); // second derivatives are about 1 / r
    }
}

TEST_CASE("sdfUpTo: the axes of the voxels may be turned and their origin elsewhere", "[vdb]") {
    LevelSet levelSet = ball();
    const auto grid = levelSet.grid->deepCopy();
    grid->transform().postRotate(0.4, openvdb::math::Y_AXIS);
    grid->transform().postRotate(0.3, openvdb::math::X_AXIS);
    grid->transform().postTranslate(openvdb::Vec3d(0.7, -0.31, 0.123));
    levelSet.grid = grid;
    const Sdf sdf = sdfUpTo(levelSet, 3);
    const Vec3d centre{{0.7, -0.31, 0.123}};
    for (const Vec3d& offset : randomPoints(test::cube(2.2), 2000, 8)) {
        const double exact = length(offset) - kRadius;
        if (exact < -0.6 * kRadius) continue;
        const auto d = sdf.distance.at<1>(centre + offset);
        CAPTURE(offset, exact, d.value);
        if (std::abs(d.value - exact) > std::max(0.1 * kVoxel, 0.01 * std::abs(exact))) FAIL("wrong distance");
        if (length(d.gradient - offset * (1 / length(offset))) > 0.05) FAIL("wrong gradient");
    }
}

TEST_CASE("sdfUpTo: thin bodies keep their sides and distances", "[vdb]") {
    const Vec3d size{{1, 1, kVoxel * GENERATE(2.5, 6.0)}}; // 0.8 and 2 voxels of the next band
    const Sdf sdf = sdfUpTo(boxOf(size, kVoxel), 2);
    for (const Vec3d& p : randomPoints(test::cube(1.5), 4000, 5)) {
        const double exact = distanceToBox(size, p), d = sdf.distance.at<0>(p).value;
        CAPTURE(size, p, exact, d);
        if (std::abs(exact) > 0.5 * kVoxel && (d < 0) != (exact < 0)) FAIL("on the wrong side");
        if (std::abs(d - exact) > 0.5 * kVoxel + 0.04 * std::abs(exact)) FAIL("wrong distance");
    }
}

TEST_CASE("sdfUpTo: a distance of many voxels needs few of them", "[vdb]") {
    // One band would have 2e8 voxels, more than widened() makes.
    CHECK_THROWS_AS(widened(ball(), 15 / kVoxel), ResourceError);
    const Sdf sdf = sdfUpTo(ball(), 15);
    for (const Vec3d& p : randomPoints(test::cube(5), 500, 6)) {
        const double exact = length(p) - kRadius;
        if (exact > 0) CHECK(sdf.distance.at<0>(p).value == Approx(exact).epsilon(0.02).margin(0.1 * kVoxel));
    }
}

TEST_CASE("sdfUpTo: several bands have the same bits on a lattice as at single positions", "[vdb]") {
    const auto x = test::coordinates(-1.7, 0.09, 33);
    CHECK(test::differing(sdfUpTo(ball(), 2).distance, PointLattice{{x, x, x}}) == 0);
}
