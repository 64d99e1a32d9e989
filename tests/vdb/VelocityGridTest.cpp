// SPDX-License-Identifier: Apache-2.0
#include "curlew/base/Error.h"
#include "curlew/base/Parallel.h"
#include "curlew/field/Algebra.h"
#include "curlew/field/NoiseField.h"
#include "curlew/vdb/GridDiagnostics.h"
#include "curlew/vdb/ScalarGrids.h"
#include "curlew/vdb/VelocityGrid.h"
#include "support/Catch.h"

#include <openvdb/tools/GridOperators.h>

#include <algorithm>
#include <cmath>

using namespace curlew;

namespace {

/// A plane wave, which is smooth.
struct Wave {
    Vec3d k;
    double phase;
    template <int Order, class T>
    Jet<T, 3, Order> at(const Vec3d& p) const {
        Jet<T, 3, Order> angle(static_cast<T>(dot(k, p) + phase));
        if constexpr (Order >= 1)
            for (int i = 0; i < 3; ++i) angle.gradient[i] = static_cast<T>(k[i]);
        return sin(angle);
    }
    double maxAbs() const { return 1; }
};

Flow waves(const Domain& domain = {}) {
    return Flow(ScalarField(Wave{{{2, 1, -1}}, 0.3}), ScalarField(Wave{{{-1, 2, 1.5}}, 1.1}), domain);
}

Flow contained(Side side = Side::inside) {
    const Wall wall{.sdf = sphereSdf(0.8), .side = side, .width = 0.2};
    return Flow(noiseField<Psrd3>({.seed = 1}, {.frequency = 2}),
                bounded(noiseField<Psrd3>({.seed = 2}, {.frequency = 2}), wall), Domain::of(wall, 0.3));
}

Vec3d centreOf(const openvdb::Vec3SGrid& grid, const openvdb::Coord& ijk) {
    const auto p = grid.indexToWorld(ijk);
    return {{p[0], p[1], p[2]}};
}

/// Returns rms of div · voxel / rms |c| over all active voxels, computed by OpenVDB's operator.
double overallDivergence(const openvdb::Vec3SGrid& grid) { return diagnoseGrid(grid).divergenceOverall; }

} // namespace

TEST_CASE("velocityGrid: collocated velocities equal the flow and exist only in its domain", "[vdb]") {
    const Flow flow = contained();
    const auto grid = velocityGrid(flow, {.voxel = 0.04, .wallFade = 3});
    CHECK(grid->getName() == "vel");
    CHECK(grid->getVectorType() == openvdb::VEC_CONTRAVARIANT_RELATIVE);
    CHECK(grid->getGridClass() == openvdb::GRID_UNKNOWN);
    CHECK(grid->background() == openvdb::Vec3s(0));
    CHECK(grid->isInWorldSpace());
    size_t inside = 0;
    for (auto value = grid->cbeginValueOn(); value; ++value) {
        const Vec3d p = centreOf(*grid, value.getCoord());
        const double d = length(p) - 0.8;
        CAPTURE(p[0], p[1], p[2], d);
        REQUIRE(d < 3 * 0.04);
        if (d > 1.75 * 0.04) continue; // in the fading zone
        ++inside;
        const Vec3d c = flow.at(p).velocity;
        // Gradients of the float kernels are accurate to 5e-4. Both gradients are below about 10 here.
        for (int i = 0; i < 3; ++i) REQUIRE(static_cast<double>((*value)[i]) == Approx(c[i]).margin(1e-2));
    }
    // The grid covers at least the volume of the sphere: 4/3 pi r³ / h³ voxels.
    CHECK(static_cast<double>(inside) > 4.0 / 3 * M_PI * std::pow(0.8 / 0.04, 3));
    CHECK(grid->tree().activeTileCount() == 0);
    const auto dense = std::pow(2 * (0.8 + 0.12) / 0.04, 3);
    CHECK(static_cast<double>(grid->activeVoxelCount()) < 0.56 * dense);
}

TEST_CASE("velocityGrid: velocities fade to the background beyond the wall", "[vdb]") {
    const auto grid = velocityGrid(contained(), {.voxel = 0.04, .wallFade = 3});
    double last = 0, most = 0;
    for (auto value = grid->cbeginValueOn(); value; ++value) {
        const double d = length(centreOf(*grid, value.getCoord())) - 0.8, speed = static_cast<double>(value->length());
        most = std::max(most, speed);
        if (d > 2.8 * 0.04) last = std::max(last, speed);
    }
    CHECK(last < 0.02 * most);
}

TEST_CASE("velocityGrid: staggered velocities are divergence-free to rounding by OpenVDB's operator", "[vdb]") {
    SECTION("contained flow everywhere") {
        const auto grid = velocityGrid(contained(), {.voxel = 0.04, .layout = Layout::staggered});
        CHECK(grid->getGridClass() == openvdb::GRID_STAGGERED);
        CHECK(overallDivergence(*grid) < 1e-6);
    }
    SECTION("obstacle and box and both sides except for the last layer") {
        for (const Flow& flow : {contained(Side::outside), contained(Side::both), waves()}) {
            const GridDiagnostics check =
                diagnoseGrid(*velocityGrid(flow, {.voxel = 0.05, .layout = Layout::staggered}));
            CHECK(check.interior > 10000);
            CHECK(check.divergence < 1e-6);
        }
    }
    SECTION("collocated grids show that the measure detects divergence") {
        CHECK(diagnoseGrid(*velocityGrid(contained(), {.voxel = 0.04})).divergence > 1e-4);
    }
}

TEST_CASE("velocityGrid: the fade of a staggered grid adds as little speed to small voxels as to large ones", "[vdb]") {
    // One of the potentials is nearly constant where the flow fades.
    const Side side = GENERATE(Side::inside, Side::outside);
    const Flow flow = contained(side), swapped(flow.potentials()[1], flow.potentials()[0], flow.domain());
    for (const Flow& either : {flow, swapped})
        for (const double voxel : {0.04, 0.02, 0.01}) {
            const auto grid = velocityGrid(either, {.voxel = voxel, .layout = Layout::staggered});
            double beyond = 0, before = 0;
            for (auto value = grid->cbeginValueOn(); value; ++value) {
                const double d = length(centreOf(*grid, value.getCoord())) - 0.8;
                const double speed = static_cast<double>(value->length());
                if (std::abs(d) > 5 * voxel) continue;
                double& most = (d > 0) == (side == Side::inside) ? beyond : before;
                most = std::max(most, speed);
            }
            CAPTURE(side, voxel);
            CHECK(beyond < 1.3 * before);
        }
}

TEST_CASE("velocityGrid: staggered velocities follow a changing flow smoothly beyond the wall", "[vdb]") {
    // First one of the potentials is best to fade, in the end the other.
    const auto noise = [](uint64_t seed, double frequency) {
        return noiseField<Psrd3>({.seed = seed}, {.frequency = frequency});
    };
    const ScalarField low = noise(1, 1), high = noise(2, 3), middle = noise(3, 1.7);
    const Domain domain = Domain::of({.sdf = sphereSdf(0.8), .side = Side::inside, .width = 0.2});
    // Returns the largest change from one of so many frames to the next.
    const auto change = [&](int frames) {
        double most = 0;
        openvdb::Vec3SGrid::Ptr last;
        for (int frame = 0; frame <= frames; ++frame) {
            const double s = double(frame) / frames;
            const ScalarField f = constantField(3) + (1 - s) * low + (s / 3) * high;
            const auto grid = velocityGrid(Flow(f, middle, domain), {.voxel = 0.1, .layout = Layout::staggered});
            for (auto value = grid->cbeginValueOn(); value && last; ++value)
                if (length(centreOf(*grid, value.getCoord())) > 0.8)
                    most = std::max(most,
                                    static_cast<double>((*value - last->tree().getValue(value.getCoord())).length()));
            last = grid;
        }
        return most;
    };
    const double few = change(40), many = change(80);
    CAPTURE(few, many);
    CHECK(many < 0.6 * few);
}

TEST_CASE("velocityGrid: staggered velocities are second-order accurate", "[vdb]") {
    const Flow flow = waves();
    std::array<double, 3> error{};
    const std::array<double, 3> voxels{0.1, 0.05, 0.025};
    for (size_t n = 0; n < 3; ++n) {
        const auto grid = velocityGrid(flow, {.voxel = voxels[n], .layout = Layout::staggered});
        for (auto value = grid->cbeginValueOn(); value; ++value) {
            for (int axis = 0; axis < 3; ++axis) {
                Vec3d face = centreOf(*grid, value.getCoord());
                face[axis] -= 0.5 * voxels[n];
                error[n] =
                    std::max(error[n], std::abs(static_cast<double>((*value)[axis]) - flow.at(face).velocity[axis]));
            }
        }
    }
    CAPTURE(error[0], error[1], error[2]);
    CHECK(std::log2(error[0] / error[1]) == Approx(2).margin(0.1));
    CHECK(std::log2(error[1] / error[2]) == Approx(2).margin(0.1));
}

TEST_CASE("velocityGrid: voxels are active only on the side of the flow", "[vdb]") {
    const auto outside = velocityGrid(contained(Side::outside), {.voxel = 0.05});
    CHECK_FALSE(outside->tree().isValueOn({0, 0, 0}));
    CHECK(outside->tree().isValueOn({20, 0, 0}));
    CHECK_FALSE(outside->tree().isValueOn({30, 0, 0})); // the padding ends at 1.1
    const auto both = velocityGrid(contained(Side::both), {.voxel = 0.05});
    CHECK(both->tree().isValueOn({0, 0, 0}));
    CHECK(both->tree().isValueOn({20, 0, 0}));
}

TEST_CASE("velocityGrid: a mask selects the voxels to sample", "[vdb]") {
    auto mask = openvdb::MaskGrid::create();
    mask->setTransform(openvdb::math::Transform::createLinearTransform(0.1));
    mask->fill({{-3, -3, -3}, {4, 4, 20}}, true);
    for (const Layout layout : {Layout::collocated, Layout::staggered}) {
        const auto grid = velocityGrid(waves(), {.layout = layout, .mask = mask});
        CHECK(grid->activeVoxelCount() == mask->activeVoxelCount());
        CHECK(grid->evalActiveVoxelBoundingBox() == mask->evalActiveVoxelBoundingBox());
        CHECK(grid->tree().getValue({5, 0, 0}) == openvdb::Vec3s(0));
        CHECK(grid->transform() == mask->transform());
    }
}

TEST_CASE("velocityGrid: a mask may be anywhere, but its voxels must be cubes along the axes", "[vdb]") {
    auto mask = openvdb::MaskGrid::create();
    mask->setName("smoke");
    mask->setTransform(openvdb::math::Transform::createLinearTransform(0.1));
    mask->transform().postTranslate({0.03, 5, -0.05});
    mask->fill({{-3, -3, -3}, {4, 4, 20}}, true);
    const Flow flow = waves();
    const auto grid = velocityGrid(flow, {.mask = mask});
    CHECK(grid->transform() == mask->transform());
    CHECK(grid->activeVoxelCount() == mask->activeVoxelCount());
    const auto staggered = velocityGrid(flow, {.layout = Layout::staggered, .mask = mask});
    CHECK(diagnoseGrid(*staggered).divergence < 1e-6);
    double worst = 0, worstOnFace = 0;
    for (auto voxel = grid->cbeginValueOn(); voxel; ++voxel)
        for (int axis = 0; axis < 3; ++axis) {
            Vec3d p = centreOf(*grid, voxel.getCoord());
            const auto errorOf = [&](const openvdb::Vec3s& v) {
                return std::abs(static_cast<double>(v[axis]) - flow.at(p).velocity[axis]);
            };
            worst = std::max(worst, errorOf(*voxel));
            p[axis] -= 0.05;
            worstOnFace = std::max(worstOnFace, errorOf(staggered->tree().getValue(voxel.getCoord())));
        }
    CHECK(worst < 1e-5);
    CHECK(worstOnFace < 0.05);
    // Moving the origin by whole voxels and the indices back gives the same voxels.
    auto same = mask->deepCopy();
    same->transform().postTranslate({0, 0, -0.1 * 8});
    same->clear();
    same->fill({{-3, -3, 5}, {4, 4, 28}}, true);
    const auto moved = velocityGrid(flow, {.mask = same});
    for (auto voxel = moved->cbeginValueOn(); voxel; ++voxel)
        REQUIRE(double((grid->tree().getValue(voxel.getCoord().offsetBy(0, 0, -8)) - *voxel).length()) < 1e-5);

    for (const openvdb::Vec3d scale : {openvdb::Vec3d(1, 1, 2), openvdb::Vec3d(-1, 1, 1)}) {
        auto scaled = mask->deepCopy();
        scaled->transform().preScale(scale);
        CHECK_THROWS_WITH(velocityGrid(flow, {.mask = scaled}),
                          Catch::ContainsSubstring("'smoke'") && Catch::ContainsSubstring("not cubes along the axes"));
    }
    mask->transform().preRotate(0.3, openvdb::math::X_AXIS);
    CHECK_THROWS_WITH(velocityGrid(flow, {.mask = mask}), Catch::ContainsSubstring("not cubes along the axes"));
}

TEST_CASE("velocityGrid: does not depend on the number of threads", "[vdb]") {
    for (const Layout layout : {Layout::collocated, Layout::staggered}) {
        std::array<openvdb::Vec3SGrid::Ptr, 2> grids;
        for (const int threads : {1, 2}) {
            const ThreadLimit limit(threads);
            grids[static_cast<size_t>(threads - 1)] = velocityGrid(contained(), {.voxel = 0.05, .layout = layout});
        }
        REQUIRE(grids[0]->tree().hasSameTopology(grids[1]->tree()));
        for (auto value = grids[0]->cbeginValueOn(); value; ++value)
            REQUIRE(*value == grids[1]->tree().getValue(value.getCoord()));
    }
}

TEST_CASE("sampledGrid and densityGrid: use the voxels of a velocity grid", "[vdb]") {
    const Flow flow = contained();
    const auto where = velocityGrid(flow, {.voxel = 0.05});
    const auto f = sampledGrid(flow.f(), *where, "f");
    CHECK(f->getName() == "f");
    CHECK(f->activeVoxelCount() == where->activeVoxelCount());
    for (auto value = f->cbeginValueOn(); value; ++value)
        REQUIRE(static_cast<double>(*value) ==
                Approx(flow.f().at<0>(centreOf(*where, value.getCoord())).value).margin(1e-4));
    const auto density = densityGrid(flow.domain(), *where);
    CHECK(density->getGridClass() == openvdb::GRID_FOG_VOLUME);
    CHECK(density->tree().getValue({0, 0, 0}) == 1.0f);
    CHECK(density->tree().getValue({17, 0, 0}) == 0.0f);
}

TEST_CASE("velocityGrid: invalid options are refused", "[vdb]") {
    CHECK_THROWS_AS(velocityGrid(waves(), {.voxel = -1}), ValueError);
    CHECK_THROWS_AS(velocityGrid(waves(), {.dim = 0}), ValueError);
    CHECK_THROWS_AS(velocityGrid(waves(), {.voxel = 0.1, .wallFade = 0}), ValueError);
    CHECK_THROWS_WITH(velocityGrid(waves(), {.voxel = 1e-5}), Catch::ContainsSubstring("memory"));
    CHECK_THROWS_AS(velocityGrid(waves(), {.voxel = 1e-12}), Error);
    CHECK_THROWS_WITH(velocityGrid(contained(), {.voxel = 2e-4}), Catch::ContainsSubstring("larger voxels"));
    const double infinity = std::numeric_limits<double>::infinity();
    CHECK_THROWS_WITH(velocityGrid(waves({.box = {{{0, 0, 0}}, {{infinity, 1, 1}}}, .wall = {}}), {.voxel = 0.1}),
                      Catch::ContainsSubstring("infinite"));
    CHECK_THROWS_AS(velocityGrid(waves(), {.voxel = 0.02}, {.report = {}, .cancelled = [] { return true; }}),
                    Interrupted);
}

TEST_CASE("velocityGrid: voxels on the sides of a box are in it, whatever the rounding", "[vdb]") {
    const auto voxels = [](double lower, double upper, Layout layout) {
        const Flow flow = waves({.box = {{{lower, lower, lower}}, {{upper, upper, upper}}}, .wall = {}});
        const auto box = velocityGrid(flow, {.voxel = 0.1, .layout = layout})->evalActiveVoxelBoundingBox();
        return std::pair(box.min().x(), box.max().x());
    };
    for (const Layout layout : {Layout::collocated, Layout::staggered})
        for (const int k : {3, 6, 7, 12, 14, 17, 19}) { // k / 10 / 0.1 is not k for some of them
            CAPTURE(k);
            CHECK(voxels(-k / 10.0, k / 10.0, layout) == std::pair(-k, k));
        }
}

TEST_CASE("velocityGrid: a mask of tiles that does not fit in memory is refused", "[vdb]") {
    auto mask = openvdb::MaskGrid::create();
    mask->setTransform(openvdb::math::Transform::createLinearTransform(0.1));
    mask->fill({{0, 0, 0}, {16383, 16383, 16383}}, true);
    REQUIRE(mask->tree().leafCount() == 0);
    CHECK_THROWS_AS(velocityGrid(waves(), {.mask = mask}), ResourceError);
    CHECK_THROWS_AS(sampledGrid(waves().f(), *mask, "f"), ResourceError);
}
