// SPDX-License-Identifier: Apache-2.0
// Level sets between two frames of a deforming mesh (vdb/DeformingLevelSet.h).
#include "curlew/base/Error.h"
#include "curlew/math/Rotation.h"
#include "curlew/vdb/DeformingLevelSet.h"
#include "support/Points.h"

using namespace curlew;
using namespace curlew::test;

namespace {

constexpr double kVoxel = 0.0125, kWidth = 0.08;
const Vec3d kHalf{{0.5, 0.03, 0.03}};
const DeformingLevelSet::Options kOptions{.tolerance = 0.2 * kWidth, .minTolerance = 0.5 * kVoxel};

/// Returns the position of a point of the bar after the bar has rotated by `angle` and bent accordingly.
Vec3d placeOf(const Vec3d& p, double angle) {
    const double s = p[0] / kHalf[0];
    return rotationBy({{0, 0, angle}}) * Vec3d{{p[0], p[1] + 0.1 * angle * s * s, p[2]}};
}

std::shared_ptr<const Mesh> bar(double angle) {
    Mesh mesh;
    constexpr int kParts = 20;
    for (int i = 0; i <= kParts; ++i)
        for (const auto& [y, z] : {std::pair(-1, -1), std::pair(1, -1), std::pair(1, 1), std::pair(-1, 1)}) {
            const Vec3d p = placeOf({{(2.0 * i / kParts - 1) * kHalf[0], y * kHalf[1], z * kHalf[2]}}, angle);
            mesh.points.emplace_back(openvdb::Vec3s(openvdb::Vec3d(p[0], p[1], p[2])));
        }
    for (unsigned i = 0; i < kParts; ++i)
        for (unsigned k = 0; k < 4; ++k) {
            const unsigned a = 4 * i + k, b = 4 * i + (k + 1) % 4;
            mesh.quads.emplace_back(a, b, b + 4, a + 4);
        }
    mesh.quads.emplace_back(3, 2, 1, 0);
    mesh.quads.emplace_back(4 * kParts, 4 * kParts + 1, 4 * kParts + 2, 4 * kParts + 3);
    return std::make_shared<const Mesh>(std::move(mesh));
}

LevelSet levelSetAt(double angle) {
    return meshToLevelSet(bar(angle), {.voxel = kVoxel, .halfWidth = kWidth / kVoxel + kSplineSupport});
}

/// The bar rotates by `angle` from frame to frame.
DeformingLevelSet deformedBy(double angle) {
    return {levelSetAt(-angle), levelSetAt(0), levelSetAt(angle),
            MeshKeys{.before = bar(-angle), .from = bar(0), .to = bar(angle), .after = bar(2 * angle)}, kOptions};
}

/// Returns the greatest distance value on the sides of the bar at `angle`, where the exact distance is 0. Checks that
/// the middle of the bar is inside.
double errorAt(const Sdf& sdf, double angle) {
    double worst = 0;
    for (int i = -8; i <= 8; ++i) {
        const double x = 0.9 * kHalf[0] * i / 8;
        for (const double y : {-1.0, 0.0, 1.0}) {
            const double found = sdf.distance.at<0>(placeOf({{x, y * kHalf[1], 0}}, angle)).value;
            if (y == 0) CHECK(found < -0.4 * kHalf[1]); // inside the bar
            if (y != 0) worst = std::max(worst, std::abs(found));
        }
    }
    return worst;
}

} // namespace

TEST_CASE("DeformingLevelSet: small motions need no level set between frames", "[vdb]") {
    const DeformingLevelSet levelSet = deformedBy(0.03);
    CHECK(levelSet.levelSetsBetween() == 0);
    for (const double part : {0.25, 0.5, 0.75}) {
        const Sdf sdf = levelSet.at(part);
        CHECK(errorAt(sdf, 0.03 * part) < 0.1 * kVoxel);
        CHECK(sdf.reach >= kWidth - 1e-6);
    }
}

TEST_CASE("DeformingLevelSet: a limb that moves farther than its thickness exists between frames", "[vdb]") {
    constexpr double kAngle = 0.3; // its ends move by 0.15, which is five times half the thickness
    const DeformingLevelSet levelSet = deformedBy(kAngle);
    CHECK(levelSet.levelSetsBetween() >= 3);
    CHECK(levelSet.error() <= kOptions.tolerance);
    for (const double part : {0.1, 0.3, 0.5, 0.6, 0.85}) {
        const Sdf sdf = levelSet.at(part);
        CHECK(errorAt(sdf, kAngle * part) <= 1.1 * kOptions.tolerance);
        CHECK(sdf.reach >= kWidth - 1e-6);
        // Samples round the corners of the mesh off by up to a voxel, and voxels between frames are larger.
        CAPTURE(part);
        const auto mesh = bar(kAngle * part);
        for (const auto& p : mesh->points)
            CHECK(sdf.bounds.padded(1.5 * kVoxel)
                      .contains({{static_cast<double>(p[0]), static_cast<double>(p[1]), static_cast<double>(p[2])}}));
    }
    // The mean of the level sets of both frames does not contain the limb there.
    const Vec3d end = placeOf({{0.48, 0, 0}}, kAngle / 2);
    CHECK(sdfOf(levelSetAt(0)).distance.at<0>(end).value + sdfOf(levelSetAt(kAngle)).distance.at<0>(end).value > 0);
}

TEST_CASE("DeformingLevelSet: starts and ends at the level sets of the frames without jumps", "[vdb]") {
    const DeformingLevelSet levelSet = deformedBy(0.2);
    const Sdf from = sdfOf(levelSetAt(0)), to = sdfOf(levelSetAt(0.2)), first = levelSet.at(0), last = levelSet.at(1);
    for (const Vec3d& p : randomPoints(cube(0.5), 200, 1)) {
        CHECK(first.distance.at<0>(p).value == from.distance.at<0>(p).value);
        CHECK(last.distance.at<0>(p).value == to.distance.at<0>(p).value);
    }
    // The level set is continuous in time, also at a level set between the frames.
    for (const double part : {0.25, 0.5, 0.75}) {
        const Sdf before = levelSet.at(part - 1e-9), after = levelSet.at(part + 1e-9);
        for (const Vec3d& p : randomPoints(cube(0.3), 50, 2))
            CHECK(std::abs(after.distance.at<0>(p).value - before.distance.at<0>(p).value) < 1e-6);
    }
}

TEST_CASE("DeformingLevelSet: the velocity of the surface is that of the mesh to second order in the frame", "[vdb]") {
    constexpr double kRate = 2; // radians per second
    // The point of the bar at `rest` has this velocity when the bar has rotated by `angle`.
    const auto velocityOf = [](const Vec3d& rest, double angle) {
        constexpr double kStep = 1e-4;
        return (placeOf(rest, angle + kStep) - placeOf(rest, angle - kStep)) * (kRate / (2 * kStep));
    };
    const auto errorOver = [&](double angle) {
        DeformingLevelSet::Options options = kOptions;
        options.seconds = angle / kRate;
        const DeformingLevelSet levelSet(
            {}, levelSetAt(0), levelSetAt(angle),
            {.before = bar(-angle), .from = bar(0), .to = bar(angle), .after = bar(2 * angle)}, options);
        double worst = 0;
        for (const double part : {0.0, 0.4, 1.0}) {
            const Sdf sdf = levelSet.at(part);
            REQUIRE(sdf.surfaceVelocity);
            for (int i = -8; i <= 8; ++i)
                for (const double away : {0.0, 0.5 * kWidth}) { // beside the middle of a long face, and farther out
                    const Vec3d rest{{0.9 * kHalf[0] * i / 8, 0, kHalf[2]}};
                    const Vec3d p = placeOf(rest, angle * part) + Vec3d{{0, 0, away}};
                    Vec3d v;
                    for (int axis = 0; axis < 3; ++axis)
                        v[axis] = (*sdf.surfaceVelocity)[static_cast<size_t>(axis)].at<0>(p).value;
                    worst = std::max(worst, length(v - velocityOf(rest, angle * part)));
                }
        }
        return worst;
    };
    const double coarse = errorOver(0.4), fine = errorOver(0.2);
    CAPTURE(coarse, fine);
    CHECK(fine < 0.02 * kRate * kHalf[0]); // the bar has 20 parts, between which its bend is a polygon
    CHECK(fine < 0.5 * coarse);
    // Without a time there is no velocity.
    CHECK_FALSE(deformedBy(0.03).at(0.5).surfaceVelocity);
}

TEST_CASE("DeformingLevelSet: level sets without meshes are refused", "[vdb]") {
    LevelSet without = levelSetAt(0);
    without.mesh = nullptr;
    CHECK_THROWS_AS(
        DeformingLevelSet({}, without, levelSetAt(0.1),
                          MeshKeys{.before = nullptr, .from = bar(0), .to = bar(0.1), .after = nullptr}, kOptions),
        ValueError);
}
