// SPDX-License-Identifier: Apache-2.0
#include "curlew/base/Error.h"
#include "curlew/base/Parallel.h"
#include "curlew/field/Algebra.h"
#include "curlew/field/NoiseField.h"
#include "curlew/vdb/DisplacedAir.h"
#include "curlew/vdb/GridDiagnostics.h"
#include "curlew/vdb/Openvdb.h"
#include "curlew/vdb/VelocityGrid.h"
#include "support/Points.h"

#include <numbers>

using namespace curlew;
using namespace curlew::test;

namespace {

constexpr double kRadius = 0.4, kStep = 1e-3;
const Vec3d kVelocity{{1, 0.3, -0.2}};

/// A sphere that moves, or grows at 1 per second.
Wall sphere(double t, bool grows) {
    const Sdf body = grows ? sphereSdf(kRadius + t) : placed(sphereSdf(kRadius), Placement{.offset = kVelocity * t});
    return {.sdf = body, .side = Side::outside, .width = 0.2};
}

struct Sphere {
    bool grows = false;
    double half = 3 * kRadius; ///< Half the edge of the box.

    Domain domain() const { return {.box = cube(half), .wall = sphere(0, grows)}; }
    WallVelocity motion() const {
        return {sphere(0, grows), sphere(kStep, grows), sphere(2 * kStep, grows), kStep, cube(half)};
    }
    DisplacedAir air(double voxel, int corrections = 2, const Vec3d& origin = {}) const {
        return displacedAir(domain(), motion(), {.voxels = {voxel, origin}, .corrections = corrections});
    }
    /// The exact potential flow in unbounded space: a dipole, or a source.
    Vec3d exact(const Vec3d& x) const {
        const double r = length(x);
        if (grows) return x * (kRadius * kRadius / (r * r * r));
        const Vec3d n = x * (1 / r);
        return (n * (3 * dot(kVelocity, n)) - kVelocity) * (kRadius * kRadius * kRadius / (2 * r * r * r));
    }
};

Vec3d toVec(const openvdb::Vec3d& p) { return {{p[0], p[1], p[2]}}; }

/// Root mean square of the error of the faces up to half a radius from the sphere, relative to its speed. The box adds
/// a uniform flow around the sphere to the exact flow in unbounded space: that part of the error does not count.
double errorOf(const Sphere& sphere, const DisplacedAir& air) {
    double squares = 0, count = 0, ofBox = 0, boxSquares = 0;
    const openvdb::Vec3SGrid& grid = *air.faces;
    for (auto value = grid.cbeginValueOn(); value; ++value)
        for (int axis = 0; axis < 3; ++axis) {
            openvdb::Vec3d p = value.getCoord().asVec3d();
            p[axis] -= 0.5;
            const Vec3d x = toVec(grid.indexToWorld(p));
            if (length(x) < kRadius || length(x) > 1.5 * kRadius) continue;
            const double error = static_cast<double>((*value)[axis]) - sphere.exact(x)[axis];
            const double aroundSphere = kVelocity[axis] - sphere.exact(x)[axis];
            squares += error * error;
            ofBox += error * aroundSphere;
            boxSquares += aroundSphere * aroundSphere;
            count += 1;
        }
    return std::sqrt((squares - ofBox * ofBox / boxSquares) / count) / length(kVelocity);
}

/// The greatest discrete divergence of voxels whose centres are in the air, in speeds per voxel.
double divergenceOf(const Sphere& sphere, const DisplacedAir& air) {
    double worst = 0;
    const auto faces = air.faces->getConstAccessor();
    for (auto value = air.faces->cbeginValueOn(); value; ++value) {
        const openvdb::Coord ijk = value.getCoord();
        const Vec3d x = toVec(air.faces->indexToWorld(ijk));
        if (length(x) <= kRadius || std::abs(x[0]) > sphere.half - 2 * air.faces->voxelSize()[0]) continue;
        double sum = 0;
        for (int axis = 0; axis < 3; ++axis) {
            openvdb::Coord next = ijk;
            ++next[axis];
            sum += static_cast<double>(faces.getValue(next)[axis] - (*value)[axis]);
        }
        worst = std::max(worst, std::abs(sum));
    }
    return worst;
}

} // namespace

TEST_CASE("displacedAir: is the dipole flow around a moving sphere", "[vdb]") {
    const Sphere sphere;
    const DisplacedAir coarse = sphere.air(kRadius / 5), fine = sphere.air(kRadius / 10);
    const double errorCoarse = errorOf(sphere, coarse), errorFine = errorOf(sphere, fine);
    const double errorOfVoxels = errorOf(sphere, sphere.air(kRadius / 10, 0));
    CAPTURE(errorCoarse, errorFine, errorOfVoxels);
    CHECK(errorFine < 0.02);
    CHECK(errorFine < 0.65 * errorCoarse);
    // Without the velocity along the wall, the steps of the voxels show.
    CHECK(errorFine < 0.6 * errorOfVoxels);
    CHECK(divergenceOf(sphere, fine) < 1e-4); // the tolerance of the solver, and rounding to float
    CHECK(fine.voxels > coarse.voxels);
    CHECK(fine.iterations > 0);
    const DisplacedAir shifted = sphere.air(kRadius / 10, 2, {{0.31 * kRadius, 0.02 * kRadius, -7.77 * kRadius}});
    CHECK(errorOf(sphere, shifted) < 0.02);
    CHECK(divergenceOf(sphere, shifted) < 1e-4);
}

TEST_CASE("displacedAir: a growing sphere pushes its volume through the box", "[vdb]") {
    const Sphere sphere{.grows = true};
    const DisplacedAir air = sphere.air(kRadius / 8);
    CHECK(divergenceOf(sphere, air) < 1e-4);
    // The flux through a cube around it is the rate at which its volume grows.
    const auto faces = air.faces->getConstAccessor();
    const double voxel = air.faces->voxelSize()[0];
    constexpr int kHalf = 12;
    double flux = 0;
    for (int axis = 0; axis < 3; ++axis)
        for (int j = -kHalf; j <= kHalf; ++j)
            for (int k = -kHalf; k <= kHalf; ++k) {
                openvdb::Coord ijk;
                ijk[(axis + 1) % 3] = j;
                ijk[(axis + 2) % 3] = k;
                ijk[axis] = kHalf + 1;
                flux += static_cast<double>(faces.getValue(ijk)[axis]);
                ijk[axis] = -kHalf;
                flux -= static_cast<double>(faces.getValue(ijk)[axis]);
            }
    const double exact = 4 * std::numbers::pi * kRadius * kRadius;
    CHECK(flux * voxel * voxel == Approx(exact).epsilon(0.05)); // the sphere has the volume of its voxels
}

TEST_CASE("displacedAir: a velocity grid includes it beyond the layer and stays divergence-free", "[vdb]") {
    const Sphere sphere{.grows = true};
    const double voxel = kRadius / 8;
    const Flow flow(0.2 * noiseField<Psrd3>({.seed = 1}),
                    bounded(noiseField<Psrd3>({.seed = 2}), sphere.domain().wall.value()), sphere.domain());
    const DisplacedAir air = sphere.air(voxel);
    const auto gridOf = [&](Layout layout, bool displaced) {
        return velocityGrid(flow, {.voxel = voxel,
                                   .layout = layout,
                                   .moving = sphere.motion(),
                                   .displaced = displaced ? air.faces : nullptr});
    };
    const auto staggered = gridOf(Layout::staggered, true), faded = gridOf(Layout::staggered, false);
    const auto still = velocityGrid(flow, {.voxel = voxel, .layout = Layout::staggered});
    // 0.3 from the wall, beyond its layer of 0.2, air still moves.
    const openvdb::Coord far(0, static_cast<int>(std::lround(0.7 / voxel)), 0);
    const auto yAt = [&](const openvdb::Vec3SGrid::Ptr& grid) {
        return static_cast<double>(grid->tree().getValue(far)[1]);
    };
    CHECK(yAt(faded) == yAt(still));
    const Vec3d face{{0, (far[1] - 0.5) * voxel, 0}};
    CHECK(yAt(staggered) - yAt(still) == Approx(sphere.exact(face)[1]).epsilon(0.2)); // the box is close
    // Divergence-free in the air. The sphere grows, so there is divergence inside.
    const GridDiagnostics everywhere = diagnoseGrid(*staggered), inAir = diagnoseGrid(*staggered, flow.domain().wall);
    CAPTURE(everywhere.divergence, inAir.divergence, inAir.beyondWall);
    CHECK(everywhere.divergence > 1e-2);
    CHECK(inAir.divergence < 1e-5);
    CHECK(inAir.beyondWall > 100);
    CHECK(diagnoseGrid(*faded, flow.domain().wall).divergence > 1e-2);
    // Collocated: at the centres of voxels.
    const auto collocated = gridOf(Layout::collocated, true);
    const double added = yAt(collocated) - yAt(velocityGrid(flow, {.voxel = voxel}));
    CHECK(added == Approx(sphere.exact({{0, far[1] * voxel, 0}})[1]).epsilon(0.2));
    // On other voxels it cannot be added.
    CHECK_THROWS_WITH(velocityGrid(flow, {.voxel = 0.9 * voxel, .displaced = air.faces}),
                      Catch::ContainsSubstring("voxels of"));
}

TEST_CASE("displacedAir: does not depend on the number of threads", "[vdb]") {
    const Sphere sphere;
    const DisplacedAir air = sphere.air(kRadius / 5);
    const ThreadLimit limit(1);
    const DisplacedAir alone = sphere.air(kRadius / 5);
    REQUIRE(air.faces->activeVoxelCount() == alone.faces->activeVoxelCount());
    const auto accessor = alone.faces->getConstAccessor();
    for (auto value = air.faces->cbeginValueOn(); value; ++value)
        REQUIRE(*value == accessor.getValue(value.getCoord()));
}

TEST_CASE("displacedAir: errors say what is missing", "[vdb]") {
    const Sphere sphere;
    const WallVelocity motion = sphere.motion();
    const auto complaint = [&](const Domain& domain, double voxel) {
        try {
            displacedAir(domain, motion, {.voxels = {.size = voxel}});
        } catch (const ValueError& error) {
            return std::string(error.what());
        }
        return std::string("nothing is wrong");
    };
    Domain domain = sphere.domain();
    using Catch::ContainsSubstring;
    CHECK_THAT(complaint(domain, 0), ContainsSubstring("positive"));
    CHECK_THAT(complaint({.box = cube(1), .wall = {}}, 0.1), ContainsSubstring("no wall"));
    domain.wall->side = Side::inside;
    CHECK_THAT(complaint(domain, 0.1), ContainsSubstring("obstacle"));
    domain = sphere.domain();
    domain.wall->sdf.reach = 0.2;
    CHECK_THAT(complaint(domain, 0.1), ContainsSubstring("layer="));
    CHECK(complaint(domain, 0.06) == "nothing is wrong");
    domain = sphere.domain();
    domain.box = cube(0.2);
    CHECK_THAT(complaint(domain, 0.05), ContainsSubstring("fills the box"));
    domain.box = {{{0.6, 0.6, 0.6}}, {{1, 1, 1}}};
    CHECK_THAT(complaint(domain, 0.1), ContainsSubstring("in the obstacle"));
    CHECK_THROWS_WITH(displacedAir(sphere.domain(), motion, {.voxels = {.size = 0.1}, .iterations = 1}),
                      Catch::ContainsSubstring("not converged"));
}
