// SPDX-License-Identifier: Apache-2.0
// Velocity grids of flows with a moving wall (vdb/VelocityGrid.h, track/WallVelocity.h).
#include "curlew/base/Parallel.h"
#include "curlew/field/Algebra.h"
#include "curlew/field/NoiseField.h"
#include "curlew/track/Scatter.h"
#include "curlew/vdb/GridDiagnostics.h"
#include "curlew/vdb/VelocityGrid.h"
#include "support/Points.h"
#include "support/Samples.h"

#include <openvdb/points/PointAdvect.h>
#include <openvdb/points/PointConversion.h>

using namespace curlew;
using namespace curlew::test;

namespace {

constexpr double kRadius = 0.4, kWidth = 0.2, kSpeed = 2, kFrame = 1.0 / 24;

/// The flow around a sphere that moves along x.
Flow aroundSphere(double t) {
    const Sdf sphere = placed(sphereSdf(kRadius), Placement{.offset = {{kSpeed * t, 0, 0}}});
    const Wall wall{.sdf = sphere, .side = Side::outside, .width = kWidth};
    return Flow(0.2 * noiseField<Psrd3>({.alpha = t, .seed = 1}), bounded(noiseField<Psrd3>({.seed = 2}), wall),
                Domain::of(wall, 0.4));
}

/// The flow around a rounded box that translates and rotates.
Flow aroundBox(double t) {
    const Placement place{.offset = {{kSpeed * t, 0, 0}}, .rotate = {{0, 90 * t, 200 * t}}};
    const Wall wall{.sdf = placed(boxSdf({{0.8, 0.5, 0.4}}, 0.15), place), .side = Side::outside, .width = kWidth};
    return Flow(0.2 * noiseField<Psrd3>({.seed = 1}), bounded(noiseField<Psrd3>({.seed = 2}), wall),
                Domain::of(wall, 0.4));
}

Flow inGrowingSphere(double t) {
    const Wall wall{.sdf = sphereSdf(kRadius + t), .side = Side::inside, .width = kWidth};
    return Flow(0.2 * noiseField<Psrd3>({.seed = 1}), bounded(noiseField<Psrd3>({.seed = 2}), wall), Domain::of(wall));
}

openvdb::Vec3SGrid::Ptr gridAt(Flow (*flowAt)(double), double t, Layout layout, double voxel = 0.03) {
    return velocityGrid(flowAt(t),
                        {.voxel = voxel, .layout = layout, .moving = wallVelocity(FlowInTime(flowAt), t, kFrame)});
}

openvdb::points::PointDataGrid::Ptr pointGridOf(const std::vector<openvdb::Vec3d>& positions) {
    const auto transform = openvdb::math::Transform::createLinearTransform(0.1);
    return openvdb::points::createPointDataGrid<openvdb::points::NullCodec, openvdb::points::PointDataGrid>(positions,
                                                                                                            *transform);
}

/// Calls use(position) for each point.
template <class Use>
void visitPoints(const openvdb::points::PointDataGrid& grid, const Use& use) {
    for (auto leaf = grid.tree().cbeginLeaf(); leaf; ++leaf) {
        const openvdb::points::AttributeHandle<openvdb::Vec3f> offset(leaf->constAttributeArray("P"));
        for (auto index = leaf->beginIndexOn(); index; ++index)
            use(grid.transform().indexToWorld(openvdb::Vec3d(offset.get(*index)) + index.getCoord().asVec3d()));
    }
}

} // namespace

TEST_CASE("velocityGrid: at the front of a moving sphere has the velocity of the sphere", "[vdb]") {
    const auto layout = GENERATE(Layout::collocated, Layout::staggered);
    const double t = 0.1, voxel = 0.02;
    const auto grid = gridAt(aroundSphere, t, layout, voxel);
    const auto accessor = grid->getConstAccessor();
    const double shift = layout == Layout::staggered ? -0.5 : 0; // of component x
    size_t front = 0;
    for (int i = 20; i < 40; ++i)
        for (int j = -1; j <= 1; ++j) // away from the axis, the slipping flow has an x component, too
            for (int k = -1; k <= 1; ++k) {
                const Vec3d p{{(i + shift) * voxel, j * voxel, k * voxel}};
                const double d = length(p - Vec3d{{kSpeed * t, 0, 0}}) - kRadius;
                if (d < 0 || d > voxel) continue;
                ++front;
                CAPTURE(i, j, k, d);
                CHECK(static_cast<double>(accessor.getValue({i, j, k})[0]) == Approx(kSpeed).epsilon(0.02));
            }
    CHECK(front >= 9);
    // Inside the body the velocity is that of the body.
    CHECK(static_cast<double>(accessor.getValue({10, 0, 0})[0]) == Approx(kSpeed).epsilon(1e-5));
    CHECK(accessor.isValueOn({10, 0, 0}));
}

TEST_CASE("velocityGrid: staggered velocities around a moving rigid wall are divergence-free to rounding", "[vdb]") {
    const auto grid = gridAt(aroundBox, 0.1, Layout::staggered);
    const GridDiagnostics diagnostics = diagnoseGrid(*grid);
    CAPTURE(diagnostics.divergence);
    CHECK(diagnostics.divergence < 1e-6);
    // Beyond the layer, velocities equal those of the flow with the wall at rest.
    const auto rests = velocityGrid(aroundBox(0.1), {.voxel = 0.03, .layout = Layout::staggered});
    const auto accessor = rests->getConstAccessor();
    const ScalarField d = aroundBox(0.1).domain().wall->sdf.distance;
    size_t far = 0, near = 0;
    for (auto value = grid->cbeginValueOn(); value; ++value) {
        const auto p = grid->indexToWorld(value.getCoord());
        const double distance = d.at<0>({{p[0], p[1], p[2]}}).value;
        const bool same = *value == accessor.getValue(value.getCoord());
        if (distance > kWidth + 0.06) far += same ? 1 : 1000000;
        near += distance < 0 && !same;
    }
    CHECK(far > 1000);
    CHECK(far < 1000000);
    CHECK(near > 1000);
}

TEST_CASE("velocityGrid: collocated and staggered grids around a moving wall agree to second order", "[vdb]") {
    const Flow flow = aroundBox(0.1);
    const auto moving = wallVelocity(FlowInTime(aroundBox), 0.1, kFrame);
    REQUIRE(moving);
    const auto errorAt = [&](double voxel) {
        const auto grid = gridAt(aroundBox, 0.1, Layout::staggered, voxel);
        double squares = 0, count = 0;
        for (auto value = grid->cbeginValueOn(); value; ++value) {
            PointBatch face;
            const auto p = grid->indexToWorld(value.getCoord().asVec3d() - openvdb::Vec3d(0.5, 0, 0));
            face.push({{p[0], p[1], p[2]}});
            if (flow.domain().wall->sdf.distance.at<0>(face[0]).value < 0) continue;
            VecBatch<double> w;
            moving->eval(face, w);
            const double error = static_cast<double>((*value)[0]) - w[0][0] - flow.at(face[0]).velocity[0];
            squares += error * error;
            count += 1;
        }
        return std::sqrt(squares / count);
    };
    const double coarse = errorAt(0.08), fine = errorAt(0.04);
    CAPTURE(coarse, fine);
    CHECK(std::log2(coarse / fine) > 1.7);
}

TEST_CASE("velocityGrid: a deforming wall moves the air beside it", "[vdb]") {
    for (const Layout layout : {Layout::collocated, Layout::staggered}) {
        const auto grid = gridAt(inGrowingSphere, 0.1, layout, 0.025);
        const double shift = layout == Layout::staggered ? -0.5 : 0;
        const auto accessor = grid->getConstAccessor();
        const int wall = static_cast<int>(std::lround(0.5 / 0.025)); // the wall is at 0.5 and moves at speed 1
        CHECK(static_cast<double>(accessor.getValue({wall, 0, 0})[0]) == Approx(1).epsilon(0.05));
        CHECK(std::abs(static_cast<double>(accessor.getValue({0, 0, 0})[0]) -
                       inGrowingSphere(0.1).at({{shift * 0.025, 0, 0}}).velocity[0]) < 0.02);
    }
}

TEST_CASE("velocityGrid: OpenVDB point advection stays out of a moving sphere", "[vdb]") {
    openvdb::initialize(); // registers the attributes of points
    const auto layout = GENERATE(Layout::collocated, Layout::staggered);
    const int gridsPerFrame = GENERATE(4, 1); // the steps between two grids use the earlier one, made for their middle
    constexpr int kFrames = 6, kSubsteps = 4;
    std::vector<openvdb::Vec3d> positions;
    const Flow first = aroundSphere(0);
    // Enough points for a fraction of 0.001 to be significant; with sanitizers, for 0.002.
    for (uint64_t k = 0; positions.size() < samples(30000); ++k) {
        const Vec3d p = randomPoint(first.domain().box, 3, k);
        if (length(p) > kRadius) positions.emplace_back(p[0], p[1], p[2]);
    }
    const auto points = pointGridOf(positions);
    for (int k = 0; k < kFrames * gridsPerFrame; ++k) {
        const double time = kFrame / gridsPerFrame;
        const auto grid = gridAt(aroundSphere, (k + 0.5) * time, layout);
        openvdb::points::advectPoints(*points, *grid, 4, kFrame / kSubsteps, kSubsteps / gridsPerFrame);
    }
    size_t inside = 0, count = 0;
    visitPoints(*points, [&](const openvdb::Vec3d& p) {
        ++count;
        inside += (p - openvdb::Vec3d(kSpeed * kFrames * kFrame, 0, 0)).length() < kRadius;
    });
    CAPTURE(inside);
    CHECK(count == positions.size());
    CHECK(inside <= positions.size() / (kSanitized ? 500 : 1000));
}

TEST_CASE("velocityGrid: grids around a moving wall do not depend on threads", "[vdb]") {
    for (const Layout layout : {Layout::collocated, Layout::staggered}) {
        const auto grid = gridAt(aroundBox, 0.1, layout, 0.06);
        const ThreadLimit limit(1);
        const auto alone = gridAt(aroundBox, 0.1, layout, 0.06);
        REQUIRE(grid->activeVoxelCount() == alone->activeVoxelCount());
        const auto accessor = alone->getConstAccessor();
        for (auto value = grid->cbeginValueOn(); value; ++value) REQUIRE(*value == accessor.getValue(value.getCoord()));
    }
}
