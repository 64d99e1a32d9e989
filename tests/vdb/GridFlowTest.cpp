// SPDX-License-Identifier: Apache-2.0
#include "curlew/base/Error.h"
#include "curlew/field/NoiseField.h"
#include "curlew/flow/Flows.h"
#include "curlew/track/Advect.h"
#include "curlew/track/FlowAtWall.h"
#include "curlew/track/Scatter.h"
#include "curlew/track/Splitting.h"
#include "curlew/vdb/GridFlow.h"
#include "curlew/vdb/VelocityGrid.h"
#include "support/FlowChecks.h"
#include "support/Points.h"

#include <openvdb/tools/Interpolation.h>

#include <cmath>
#include <functional>
#include <limits>
#include <numbers>

using namespace curlew;
using Catch::Matchers::ContainsSubstring;
using openvdb::Coord;
using openvdb::Vec3SGrid;

namespace {

constexpr double kPi = std::numbers::pi;
using Velocity = std::function<Vec3d(const Vec3d&)>;

/// The ABC flow (Arnold, Beltrami, Childress): divergence-free, with the period 2 pi.
Vec3d abc(const Vec3d& p) {
    constexpr double a = 1, b = 0.7, c = 0.43;
    return {{a * std::sin(p[2]) + c * std::cos(p[1]), b * std::sin(p[0]) + a * std::cos(p[2]),
             c * std::sin(p[1]) + b * std::cos(p[0])}};
}

/// Calls use(offset, offset, weight) for 4 x 4 Gauss points in the square from -1/2 to 1/2; the weights add up to 1.
template <class Use>
void overFace(const Use& use) {
    constexpr std::array<double, 4> x{-0.8611363115940526, -0.3399810435848563, 0.3399810435848563, 0.8611363115940526},
        w{0.3478548451374538, 0.6521451548625461, 0.6521451548625461, 0.3478548451374538};
    for (size_t a = 0; a < 4; ++a)
        for (size_t b = 0; b < 4; ++b) use(x[a] / 2, x[b] / 2, w[a] * w[b] / 4);
}

/// A staggered grid of n³ voxels (and their upper faces) of the size h from the origin: averages over the faces.
Vec3SGrid::Ptr staggeredGrid(int n, double h, const Velocity& velocity) {
    auto grid = Vec3SGrid::create();
    grid->setTransform(openvdb::math::Transform::createLinearTransform(h));
    grid->transform().postTranslate(openvdb::Vec3d(h / 2)); // the lowest corner is the origin
    grid->setGridClass(openvdb::GRID_STAGGERED);
    for (int i = 0; i <= n; ++i)
        for (int j = 0; j <= n; ++j)
            for (int k = 0; k <= n; ++k) {
                openvdb::Vec3s v;
                for (int axis = 0; axis < 3; ++axis) {
                    double sum = 0;
                    overFace([&](double across, double along, double weight) {
                        Vec3d p{{i + 0.5, j + 0.5, k + 0.5}};
                        p[axis] -= 0.5;
                        p[(axis + 1) % 3] += across;
                        p[(axis + 2) % 3] += along;
                        sum += weight * velocity(p * h)[axis];
                    });
                    v[axis] = static_cast<float>(sum);
                }
                grid->tree().setValueOn({i, j, k}, v);
            }
    return grid;
}

/// The flux of a flow through the face of a voxel, divided by the area.
double throughFace(const Flow& flow, const Vec3SGrid& grid, const Coord& ijk, int axis) {
    PointBatch points;
    std::vector<double> weights;
    overFace([&](double across, double along, double weight) {
        openvdb::Vec3d at(ijk[0], ijk[1], ijk[2]);
        at[axis] -= 0.5;
        at[(axis + 1) % 3] += across;
        at[(axis + 2) % 3] += along;
        const auto p = grid.indexToWorld(at);
        points.push({{p[0], p[1], p[2]}});
        weights.push_back(weight);
    });
    VecBatch<double> c;
    flow.velocity(points, c);
    const auto normal =
        grid.transform().baseMap()->applyJacobian(openvdb::Vec3d(axis == 0, axis == 1, axis == 2)).unit();
    double sum = 0;
    for (int k = 0; k < points.size; ++k)
        sum += weights[static_cast<size_t>(k)] * dot(c[k], Vec3d{{normal[0], normal[1], normal[2]}});
    return sum;
}

/// The largest difference between the fluxes of a flow and a grid of n³ voxels, at some of the faces.
double worstFlux(const Flow& flow, const Vec3SGrid& grid, int n) {
    double worst = 0;
    for (int k = 0; k < 400; ++k) {
        const auto axis = static_cast<int>(3 * randomUniform(8, static_cast<uint64_t>(k), 3));
        Coord ijk;
        for (int d = 0; d < 3; ++d)
            ijk[d] = static_cast<int>((n + (d == axis ? 1 : 0)) *
                                      randomUniform(8, static_cast<uint64_t>(k), static_cast<uint64_t>(d)));
        const double given = static_cast<double>(grid.tree().getValue(ijk)[axis]);
        worst = std::max(worst, std::abs(throughFace(flow, grid, ijk, axis) - given));
    }
    return worst;
}

double rmsError(const Flow& flow, const Box& box, const Velocity& exact) {
    double sum = 0;
    const auto points = test::randomPoints(box, 2000, 5);
    for (const Vec3d& p : points) {
        const Vec3d e = flow.at(p).velocity - exact(p);
        sum += dot(e, e);
    }
    return std::sqrt(sum / static_cast<double>(points.size()));
}

/// The largest net flux out of small cubes, divided by their volume and by the rms velocity gradient.
double divergenceBySmallBoxes(const Flow& flow, const Box& box, double edge) {
    double worst = 0, squares = 0;
    const auto points = test::randomPoints(box, 300, 6);
    auto cube = Vec3SGrid::create();
    cube->setTransform(openvdb::math::Transform::createLinearTransform(edge));
    for (const Vec3d& p : points) {
        auto there = cube->transform().copy();
        there->postTranslate({p[0], p[1], p[2]});
        cube->setTransform(there);
        double net = 0;
        for (int axis = 0; axis < 3; ++axis) {
            Coord above;
            above[axis] = 1;
            net += throughFace(flow, *cube, above, axis) - throughFace(flow, *cube, {}, axis);
        }
        cube->setTransform(openvdb::math::Transform::createLinearTransform(edge));
        worst = std::max(worst, std::abs(net) / edge);
        const double gradient = test::frobenius(flow.at(p).derivative);
        squares += gradient * gradient;
    }
    return worst / std::sqrt(squares / static_cast<double>(points.size()));
}

/// A swirl in the cube [0, pi]³ through whose sides nothing flows (Taylor and Green).
Vec3d taylorGreen(const Vec3d& p) {
    return {{std::sin(p[0]) * std::cos(p[1]) * std::cos(p[2]), std::cos(p[0]) * std::sin(p[1]) * std::cos(p[2]),
             -2 * std::cos(p[0]) * std::cos(p[1]) * std::sin(p[2])}};
}

/// Such swirls, placed so that they flow through all sides of the cube [0, 2 pi]³, with the ABC flow.
Vec3d swirls(const Vec3d& p) { return taylorGreen(p + Vec3d{{0.3, 0.5, 0.7}}) + abc(p) * 0.5; }

Vec3SGrid::Ptr openGrid(int n) { return staggeredGrid(n, 2 * kPi / n, swirls); }

Box boxTo(double edge) { return {{{0, 0, 0}}, {{edge, edge, edge}}}; }

} // namespace

TEST_CASE("potentialFlow: has the fluxes of the grid and no divergence at any point", "[vdb]") {
    const int n = 12;
    const auto grid = openGrid(n);
    const PotentialFlow made = potentialFlow({grid});
    CHECK(made.cells == Vec<int, 3>{{n, n, n}});
    CHECK(made.divergence < 1e-6); // of values rounded to float
    CHECK(made.residual < 1e-10);
    CHECK(made.change < 1e-6);
    CHECK(made.flow.divergenceFree());
    CHECK(worstFlux(made.flow, *grid, n) < 1e-6);
    // The polynomials of a box that lies in one voxel are integrated exactly; others have kinks of the second order.
    const Box inner = boxTo(2 * kPi).padded(-0.1);
    CHECK(divergenceBySmallBoxes(made.flow, inner, 1e-3) < 1e-6);
    CHECK(divergenceBySmallBoxes(sampledFlow({grid}), inner, 1e-3) > 0.03);
    test::requireJacobian(made.flow, inner, 200, 3);
    // Across the sides of the box and beyond, velocities are continuous and divergence-free, too.
    const Box around = boxTo(2 * kPi).padded(0.4);
    CHECK(divergenceBySmallBoxes(made.flow, around, 1e-3) < 1e-6);
    double jump = 0;
    for (uint64_t k = 0; k < 200; ++k) {
        Vec3d p = test::randomPoint(boxTo(2 * kPi), 4, k), q = p;
        const auto axis = static_cast<int>(k % 3);
        p[axis] = k % 2 ? 2 * kPi : 0;
        q[axis] = p[axis] + 1e-9;
        p[axis] -= 1e-9;
        jump = std::max(jump, length(made.flow.at(p).velocity - made.flow.at(q).velocity));
    }
    CHECK(jump < 1e-7);
}

TEST_CASE("potentialFlow: is accurate to the third order up to the sides of the box", "[vdb]") {
    const Box box = boxTo(2 * kPi);
    const double coarse = rmsError(potentialFlow({openGrid(12)}).flow, box, swirls),
                 fine = rmsError(potentialFlow({openGrid(24)}).flow, box, swirls),
                 linear = rmsError(sampledFlow({openGrid(24)}), box.padded(-0.3), swirls);
    CAPTURE(coarse, fine, linear);
    CHECK(test::observedOrder(coarse, fine) > 2.7);
    CHECK(fine < linear / 10);
}

TEST_CASE("sampledFlow: interpolates as OpenVDB's samplers do", "[vdb]") {
    const auto staggered = openGrid(10);
    auto collocated = staggered->deepCopy();
    collocated->setGridClass(openvdb::GRID_UNKNOWN);
    const Flow faces = sampledFlow({staggered}), centres = sampledFlow({collocated});
    CHECK(isStaggered({staggered}));
    CHECK_FALSE(isStaggered({collocated}));
    CHECK_FALSE(faces.divergenceFree());
    CHECK_FALSE(faces.hasTracks());
    test::Worst worst;
    for (const Vec3d& p : test::randomPoints(boxTo(2 * kPi).padded(-0.4), 500, 2)) {
        const openvdb::Vec3d at(p[0], p[1], p[2]), index = staggered->worldToIndex(at);
        const auto there = openvdb::tools::StaggeredBoxSampler::sample(staggered->tree(), index);
        const auto centre = openvdb::tools::BoxSampler::sample(collocated->tree(), index);
        for (int axis = 0; axis < 3; ++axis) {
            worst.see(std::abs(faces.at(p).velocity[axis] - static_cast<double>(there[axis])), p);
            worst.see(std::abs(centres.at(p).velocity[axis] - static_cast<double>(centre[axis])), p);
        }
    }
    CAPTURE(worst.where);
    CHECK(worst.value < 1e-6); // OpenVDB interpolates in float
    CHECK(length(centres.at({{100, 0, 0}}).velocity) == 0);
    constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
    CHECK_NOTHROW(centres.at({{kNaN, 0, 0}}));
    // The cubic spline is C², so central differences converge to its derivative with the second order.
    test::requireJacobian(sampledFlow({collocated}, GridSampling::cubic), boxTo(2 * kPi).padded(-1.5), 200, 3);
}

TEST_CASE("GridFlow: a grid that is split, rotated or mirrored is the same flow, moved", "[vdb]") {
    const auto grid = openGrid(8);
    const Flow flow = potentialFlow({grid}).flow, sampled = sampledFlow({grid});
    std::vector<openvdb::GridBase::ConstPtr> split;
    for (int axis = 0; axis < 3; ++axis) {
        auto part = openvdb::FloatGrid::create();
        auto transform = grid->transform().copy();
        openvdb::Vec3d shift(0);
        shift[axis] = -0.5;
        transform->preTranslate(shift);
        part->setTransform(transform);
        for (auto value = grid->cbeginValueOn(); value; ++value)
            part->tree().setValueOn(value.getCoord(), (*value)[axis]);
        split.push_back(part);
    }
    CHECK(isStaggered(split));
    auto turned = grid->deepCopy();
    turned->transform().postRotate(0.6, openvdb::math::Z_AXIS);
    turned->transform().postTranslate({1, 2, 3});
    auto mirrored = grid->deepCopy();
    mirrored->transform().postScale({-1, 1, 1});
    const Flow turnedFlow = potentialFlow({turned}).flow, mirroredFlow = potentialFlow({mirrored}).flow,
               splitFlow = potentialFlow(split).flow;
    test::Worst worst;
    for (const Vec3d& p : test::randomPoints(boxTo(2 * kPi).padded(-0.5), 100, 3)) {
        for (const bool exact : {true, false}) {
            const Vec3d v = (exact ? flow : sampled).at(p).velocity;
            worst.see(length((exact ? splitFlow : sampledFlow(split)).at(p).velocity - v), p);
            const Vec3d q{{-p[0], p[1], p[2]}}, w{{-v[0], v[1], v[2]}};
            worst.see(length((exact ? mirroredFlow : sampledFlow({mirrored})).at(q).velocity - w), p);
            // OpenVDB's rotation about z
            const openvdb::Vec3d there = turned->indexToWorld(grid->worldToIndex(openvdb::Vec3d(p[0], p[1], p[2])));
            const openvdb::Vec3d turnedV = turned->transform().baseMap()->applyJacobian(
                grid->transform().baseMap()->applyInverseJacobian(openvdb::Vec3d(v[0], v[1], v[2])));
            worst.see(
                length((exact ? turnedFlow : sampledFlow({turned})).at({{there[0], there[1], there[2]}}).velocity -
                       Vec3d{{turnedV[0], turnedV[1], turnedV[2]}}),
                p);
        }
    }
    CAPTURE(worst.where);
    CHECK(worst.value < 1e-6);
}

TEST_CASE("potentialFlow: each term is tangent to the closed sides of the box", "[vdb]") {
    const int n = 16;
    const auto grid = staggeredGrid(n, kPi / n, taylorGreen);
    for (auto value = grid->beginValueOn(); value; ++value) { // as solvers write it: without the faces in the walls
        const Coord ijk = value.getCoord();
        if (ijk[0] == n || ijk[1] == n || ijk[2] == n) {
            value.setValue(openvdb::Vec3s(0));
            value.setValueOff();
        }
    }
    const PotentialFlow made = potentialFlow({grid});
    CHECK(made.cells == Vec<int, 3>{{n, n, n}});
    CHECK(made.channels == 0);
    CHECK(worstFlux(made.flow, *grid, n) < 1e-6);
    double worst = 0;
    for (const auto& term : made.flow.terms()) {
        const Flow one(term, made.flow.domain());
        for (uint64_t k = 0; k < 300; ++k) {
            Vec3d p = test::randomPoint(boxTo(kPi), 3, k);
            const auto axis = static_cast<int>(k % 3);
            p[axis] = k % 2 ? kPi : 0;
            worst = std::max(worst, std::abs(one.at(p).velocity[axis]));
        }
    }
    CHECK(worst < 1e-6);
}

TEST_CASE("potentialFlow: sources in a box that is closed on all sides are projected away", "[vdb]") {
    const auto bump = [](double t) { return (1 - t * t) * (1 - t * t); };
    const auto f = [&](const Vec3d& p) {
        return (p[0] + p[0] * p[0]) * (1 + p[1]) * bump(p[0]) * bump(p[1]) * bump(p[2]);
    };
    for (const int n : {24, 40}) {
        CAPTURE(n);
        auto grid = Vec3SGrid::create();
        grid->setTransform(openvdb::math::Transform::createLinearTransform(2.0 / n));
        for (int i = -n / 2; i <= n / 2; ++i)
            for (int j = -n / 2; j <= n / 2; ++j)
                for (int k = -n / 2; k <= n / 2; ++k) {
                    const Vec3d p{{2.0 * i / n, 2.0 * j / n, 2.0 * k / n}};
                    openvdb::Vec3s v(0);
                    for (int axis = 0; axis < 3; ++axis) {
                        if (std::max({std::abs(i), std::abs(j), std::abs(k)}) == n / 2) break; // at rest
                        constexpr double kStep = 1e-4;
                        Vec3d above = p, below = p;
                        above[axis] += kStep;
                        below[axis] -= kStep;
                        v[axis] = static_cast<float>((f(above) - f(below)) / (2 * kStep));
                    }
                    grid->tree().setValueOn({i, j, k}, v);
                }
        const PotentialFlow made = potentialFlow({grid}, {});
        CHECK(made.divergence > 0.1);
        CHECK(made.change > 0.9); // the flow was nearly all gradient
        CHECK(made.residual < 1e-9);
    }
}

TEST_CASE("potentialFlow: particles that follow its terms never cross the wall", "[vdb]") {
    // A wind past a ball, as a solver leaves it: stopped in the voxels of the ball, and not divergence-free beside it.
    const int n = 24;
    const double h = 2.0 / n;
    const Sdf ball = placed(sphereSdf(0.4), {.offset = {{1, 1, 1}}});
    auto grid = Vec3SGrid::create();
    grid->setTransform(openvdb::math::Transform::createLinearTransform(h));
    grid->transform().postTranslate(openvdb::Vec3d(h / 2));
    for (int i = 0; i < n; ++i)
        for (int j = 0; j < n; ++j)
            for (int k = 0; k < n; ++k) {
                const Vec3d p{{(i + 0.5) * h, (j + 0.5) * h, (k + 0.5) * h}};
                const double d = ball.distance.at<0>(p).value;
                grid->tree().setValueOn({i, j, k}, openvdb::Vec3s(d > 0 ? 1 : 0, 0, 0));
            }
    const Wall wall{.sdf = ball, .side = Side::outside, .width = 2 * h};
    const PotentialFlow made = potentialFlow({grid}, {.wall = wall});
    CHECK(made.divergence > 0.01);
    CHECK(made.residual < 1e-9);
    CHECK(made.change > 0.01);
    CHECK(made.channels == 1); // the closed sides: a wind tunnel
    const SumAtWall at = sumAtWall(made.flow);
    CHECK(at.whole.tangent());
    for (const AtWall& term : at.terms) CHECK(term.tangent());

    Points points = scatter(made.flow.domain(), 2000, 4);
    Points unsplit = points, leaking = points;
    const AdvectResult result = advect(made.flow, points, {.time = 2, .steps = 8, .splitting = Splitting::strang});
    CHECK(result.outside == 0);
    CHECK(result.notConverged < 20);
    CHECK(advect(made.flow, unsplit, {.time = 2, .steps = 8}).outside == 0);
    // The same grid as it is carries particles into the ball.
    advect(sampledFlow({grid}), leaking, {.time = 0.4, .steps = 20});
    size_t inside = 0;
    for (size_t k = 0; k < leaking.size(); ++k) inside += ball.distance.at<0>(leaking.position(k)).value < 0;
    CHECK(inside > 0);
}

TEST_CASE("GridFlow: takes our own coarse grids, half of whose motion fades beyond the wall", "[vdb]") {
    for (const Side side : {Side::inside, Side::outside})
        for (const double voxel : {0.4, 0.2, 0.1}) {
            const Wall wall{.sdf = sphereSdf(0.8), .side = side, .width = 0.4};
            const Flow flow(noiseField<Psrd3>({.seed = 1}, {.frequency = 2}),
                            bounded(noiseField<Psrd3>({.seed = 2}, {.frequency = 2}), wall), Domain::of(wall, 0.8));
            const auto grid = velocityGrid(flow, {.voxel = voxel, .layout = Layout::staggered});
            CAPTURE(side, voxel);
            CHECK(potentialFlow({grid}, {.wall = wall}).divergence < 1e-5);
            Wall inverted = wall;
            inverted.side = side == Side::inside ? Side::outside : Side::inside;
            if (voxel < 0.15) // coarser grids have no motion clear of the wall
                CHECK_THROWS_WITH(potentialFlow({grid}, {.wall = inverted}), ContainsSubstring("inside out"));
        }
}

TEST_CASE("GridFlow: refuses grids that are not velocities", "[vdb]") {
    CHECK_THROWS_WITH(sampledFlow({Vec3SGrid::create()}), ContainsSubstring("no active voxels"));
    const auto scalar = openvdb::FloatGrid::create();
    CHECK_THROWS_WITH(sampledFlow({scalar}), ContainsSubstring("one grid of vectors"));
    CHECK_THROWS_WITH(sampledFlow({}), ContainsSubstring("one grid of vectors"));
    auto grid = openGrid(6);
    grid->transform().preScale(openvdb::Vec3d(1, 1.5, 1));
    CHECK_THROWS_WITH(potentialFlow({grid}), ContainsSubstring("cubes"));
    grid = openGrid(6);
    grid->tree().setValueOn({2, 2, 2}, openvdb::Vec3s(std::numeric_limits<float>::infinity()));
    CHECK_THROWS_WITH(potentialFlow({grid}), ContainsSubstring("3 values that are not finite") ||
                                                 ContainsSubstring("1 values that are not finite"));
    CHECK_THROWS_WITH(potentialFlow({openGrid(3)}), ContainsSubstring("at least 4 voxels"));
    grid = openGrid(6);
    openvdb::FloatGrid::Ptr x = openvdb::FloatGrid::create(), y = x->deepCopy(), z = x->deepCopy();
    for (auto& part : {x, y, z}) part->tree().setValueOn({0, 0, 0}, 1);
    y->transform().postTranslate({0.3, 0, 0});
    CHECK_THROWS_WITH(sampledFlow({x, y, z}), ContainsSubstring("neither at the same voxels"));
    z->transform().preScale(2.0);
    y->setTransform(x->transform().copy());
    CHECK_THROWS_WITH(sampledFlow({x, y, z}), ContainsSubstring("different sizes"));
    const auto still = staggeredGrid(6, 0.1, [](const Vec3d&) { return Vec3d{}; });
    CHECK_THROWS_WITH(potentialFlow({still}), ContainsSubstring("does not move"));
    const Wall inverted{.sdf = placed(sphereSdf(4.5), {.offset = {{3, 3, 3}}}), .side = Side::outside, .width = 0.2};
    CHECK_THROWS_WITH(potentialFlow({openGrid(12)}, {.wall = inverted}), ContainsSubstring("inside out"));
}

TEST_CASE("GridFlow: a staggered grid whose box does not fit in memory is refused", "[vdb]") {
    auto grid = Vec3SGrid::create();
    grid->setGridClass(openvdb::GRID_STAGGERED);
    for (const int at : {0, 1 << 20}) grid->tree().setValueOn(Coord(at), openvdb::Vec3s(1, 2, 3));
    CHECK_THROWS_AS(sampledFlow({grid}, GridSampling::linear), ResourceError);
    CHECK_THROWS_AS(potentialFlow({grid}, {}), ResourceError);
}
