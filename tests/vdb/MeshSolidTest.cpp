// SPDX-License-Identifier: Apache-2.0
#include "curlew/base/Error.h"
#include "curlew/base/Parallel.h"
#include "curlew/base/Random.h"
#include "curlew/vdb/MeshSolid.h"
#include "curlew/vdb/SolidDistance.h"
#include "support/Meshes.h"
#include "support/Points.h"
#include "support/Samples.h"

#include <openvdb/tools/LevelSetMeasure.h>
#include <openvdb/tools/MeshToVolume.h>

#include <cmath>
#include <functional>
#include <numbers>
#include <numeric>

using namespace curlew;

namespace {

MeshSolid solid(const Mesh& mesh, const SolidOptions& options) {
    return solidOf(std::make_shared<Mesh>(mesh), options);
}

/// Counts random points around a mesh that the spline puts on the wrong side by more than half a voxel, by the exact
/// winding number. Half of the points are close to the surface.
size_t wrong(const Mesh& mesh, const LevelSet& levelSet, size_t count) {
    const Sdf sdf = sdfOf(levelSet);
    const double voxel = levelSet.voxelSize();
    Box box;
    for (int axis = 0; axis < 3; ++axis) {
        box.lower[axis] = 1e30, box.upper[axis] = -1e30;
        for (const auto& p : mesh.points) {
            box.lower[axis] = std::min(box.lower[axis], static_cast<double>(p[axis]) - voxel);
            box.upper[axis] = std::max(box.upper[axis], static_cast<double>(p[axis]) + voxel);
        }
    }
    const auto random = test::randomPoints(box, count, 31);
    size_t found = 0;
    for (size_t n = 0; n < count; ++n) {
        Vec3d p = random[n];
        if (n % 2 == 0) {
            const auto& corner = mesh.points[n * 7919 % mesh.points.size()];
            const Vec3d offset = test::randomPoint(test::cube(3 * voxel), 32, n);
            for (int axis = 0; axis < 3; ++axis) p[axis] = static_cast<double>(corner[axis]) + offset[axis];
        }
        const double d = sdf.distance.at<0>(p).value;
        if (std::abs(d) < 0.5 * voxel) continue;
        const double w = std::abs(test::windingNumber(mesh, {p[0], p[1], p[2]}));
        found += (w > 0.5) != (d < 0);
    }
    return found;
}

/// Returns the share of voxels near the surface whose value differs from that of a neighbour by more than 1.05 voxels.
/// Distances differ by at most one voxel.
double notDistances(const LevelSet& levelSet) {
    const auto& tree = levelSet.grid->tree();
    const openvdb::tree::ValueAccessor<const openvdb::FloatTree> at(tree);
    const double h = levelSet.voxelSize();
    size_t all = 0, off = 0;
    for (auto value = levelSet.grid->cbeginValueOn(); value; ++value) {
        if (std::abs(static_cast<double>(*value)) > 1.2 * h) continue;
        ++all;
        for (int axis = 0; axis < 3; ++axis) {
            openvdb::Coord next = value.getCoord();
            ++next[axis];
            if (std::abs(static_cast<double>(at.getValue(next) - *value)) > 1.05 * h) {
                ++off;
                break;
            }
        }
    }
    return static_cast<double>(off) / static_cast<double>(all);
}

double volumeOf(const LevelSet& levelSet) { return openvdb::tools::levelSetVolume(*levelSet.grid); }

} // namespace

TEST_CASE("solidOf: a clean closed mesh matches OpenVDB meshToVolume", "[vdb]") {
    const Mesh mesh = GENERATE(test::spot(), test::flipped(test::spot()), test::ball(4));
    const double voxel = 2.0 / 80;
    const auto transform = openvdb::math::Transform::createLinearTransform(voxel);
    std::vector<openvdb::Vec3s> points;
    for (const auto& p : mesh.points) points.push_back(p / static_cast<float>(voxel));
    std::vector<openvdb::Vec4I> faces = mesh.quads;
    for (const auto& t : mesh.triangles) faces.emplace_back(t[0], t[1], t[2], openvdb::util::INVALID_IDX);
    // OpenVDB's default renormalisation would move samples by one or two hundredths of a voxel.
    const auto reference = openvdb::tools::meshToVolume<openvdb::FloatGrid>(
        openvdb::tools::QuadAndTriangleDataAdapter<openvdb::Vec3s, openvdb::Vec4I>(points, faces), *transform, 3, 3,
        openvdb::tools::DISABLE_RENORMALIZATION);
    const MeshSolid made = solid(mesh, {.voxel = voxel});
    CHECK(made.figures.clean);
    CHECK(made.figures.hidden == 0);
    size_t all = 0, different = 0;
    double worst = 0; // greatest deviation from the exact signed distance among the voxels that differ
    for (auto value = reference->cbeginValueOn(); value; ++value) {
        const auto d = static_cast<double>(made.levelSet.grid->tree().getValue(value.getCoord()));
        if (std::abs(static_cast<double>(*value)) > 1.5 * voxel)
            continue; // the outermost voxels of the band may be missing
        ++all;
        if (std::abs(d - static_cast<double>(*value)) < 0.01 * voxel) continue;
        ++different;
        const openvdb::Vec3d p = transform->indexToWorld(value.getCoord());
        const double exact = std::min(test::distanceTo(mesh, p), 3 * voxel);
        const bool inside = std::abs(test::windingNumber(mesh, p)) > 0.5;
        worst = std::max(worst, std::abs(d - (inside ? -exact : exact)) / voxel);
    }
    CHECK(static_cast<double>(different) < 0.02 * static_cast<double>(all)); // the ears of spot are thinner than voxels
    CHECK(worst < 0.01);
    CHECK(wrong(mesh, made.levelSet, 300) == 0);
}

TEST_CASE("solidOf: distances in a wide band are those to the closest face", "[vdb]") {
    // Faces larger than voxels, smaller ones, and slivers; the legs and the body of spot have ridges between them.
    const auto [mesh, dim] =
        GENERATE(table<Mesh, int>({{test::spot(), 64}, {test::ball(6), 40}, {test::bipyramid(300), 60}}));
    const MeshSolid made = solid(mesh, {.dim = dim, .halfWidth = 9});
    const double voxel = made.levelSet.voxelSize();
    size_t n = 0, compared = 0;
    double worst = 0, squares = 0; // in voxels
    for (auto value = made.levelSet.grid->cbeginValueOn(); value; ++value) {
        if (n++ % (test::kSanitized ? 2000 : 400) != 0) continue;
        const openvdb::Vec3d p = made.levelSet.grid->indexToWorld(value.getCoord());
        const double error = std::abs(std::abs(static_cast<double>(*value)) - test::distanceTo(mesh, p)) / voxel;
        worst = std::max(worst, error);
        squares += error * error;
        ++compared;
    }
    CHECK(compared > 30);
    CHECK(worst < 0.05);
    CHECK(std::sqrt(squares / static_cast<double>(compared)) < 0.002);
}

TEST_CASE("solidOf: a wide band reports its progress, and can be cancelled while it grows", "[vdb]") {
    double done = 0;
    bool rises = true;
    Monitor monitor{.report =
                        [&](double fraction) {
                            rises = rises && fraction >= done && fraction <= 1;
                            done = fraction;
                        },
                    .cancelled = {}};
    const auto mesh = std::make_shared<const Mesh>(test::ball(6)); // faces smaller than voxels: the band grows
    solidOf(mesh, {.dim = 40, .halfWidth = 12}, monitor);
    CHECK(rises);
    CHECK(done > 0.8);
    done = 0;
    monitor.cancelled = [&] { return done > 0.5; };
    CHECK_THROWS_AS(solidOf(mesh, {.dim = 40, .halfWidth = 12}, monitor), Interrupted);
}

TEST_CASE("solidOf: inverted faces are flipped and reported", "[vdb]") {
    const MeshSolid right = solid(test::spot(), {.dim = 44}), turned = solid(test::flipped(test::spot()), {.dim = 44});
    CHECK_FALSE(right.figures.turned);
    CHECK(turned.figures.turned);
    CHECK(volumeOf(turned.levelSet) == Approx(volumeOf(right.levelSet)));
    const Mesh open = test::flipped(test::withHole(test::spot(), {0, 0.4, 0.3}, 0.2));
    CHECK(solid(open, {.dim = 44}).figures.turned);
}

TEST_CASE("solidOf: faces that run against their neighbours are reversed and counted", "[vdb]") {
    const Mesh open = test::withHole(test::spot(), {0, 0.4, 0.3}, 0.2);
    const Mesh right =
        GENERATE_COPY(test::spot(), open, test::together(test::spot(), test::moved(test::spot(), {3, 0, 0})));
    Mesh mesh{.points = right.points, .triangles = test::trianglesOf(right), .quads = {}};
    const std::vector<openvdb::Vec3I> before = mesh.triangles;
    for (size_t n = 0; n < mesh.triangles.size(); ++n)
        if (randomUniform(5, n) < 0.05) std::swap(mesh.triangles[n][0], mesh.triangles[n][1]);
    const auto count =
        static_cast<size_t>(std::inner_product(before.begin(), before.end(), mesh.triangles.begin(), 0, std::plus<>(),
                                               [](const auto& a, const auto& b) { return a == b ? 0 : 1; }));
    REQUIRE(count > 100);
    const MeshSolid made = solid(mesh, {.dim = 44}), expected = solid(right, {.dim = 44});
    CHECK(made.figures.reversedFaces == count);
    CHECK(expected.figures.reversedFaces == 0);
    CHECK(made.figures.clean == expected.figures.clean);
    CHECK(volumeOf(made.levelSet) == Approx(volumeOf(expected.levelSet)).epsilon(1e-6));
    CHECK(wrong(right, made.levelSet, 300) == 0);
}

TEST_CASE("solidOf: a strip with one side is left as it is", "[vdb]") {
    const Mesh strip = test::moebius(0.5, 100);
    CHECK(solid(test::together(test::spot(), strip), {.dim = 44}).figures.reversedFaces == 0);
}

TEST_CASE("solidOf: no sample is on the wrong side by more than half a voxel for any mesh", "[vdb]") {
    const auto [name, mesh] = GENERATE_COPY(table<std::string, Mesh>(
        {{"a hole", test::withHole(test::spot(), {0, 0.4, 0.3}, 0.25)},
         {"two holes", test::withHole(test::withHole(test::spot(), {0, 0.9, 0.5}, 0.2), {0.3, -0.2, 0}, 0.25)},
         {"overlapping", test::together(test::spot(), test::moved(test::spot(), {0.31f, 0.13f, 0.22f}))},
         {"triangles that are not joined", test::soup(test::spot(), 0.003)},
         {"turned and open", test::flipped(test::withHole(test::spot(), {0, 0.4, 0.3}, 0.25))},
         {"each face twice", test::together(test::spot(), test::spot())},
         {"half a ball", test::withHole(test::ball(4), {0, 0, -1}, 1.4)}}));
    CAPTURE(name);
    const MeshSolid made = solid(mesh, {.dim = 42});
    CHECK(made.figures.clean == (name == "each face twice"));
    CHECK(wrong(mesh, made.levelSet, test::kSanitized ? 100 : 250) == 0);
    CHECK(notDistances(made.levelSet) < 0.001);
    // Widening the band keeps the surface, and hardly changes the distances farther out.
    const LevelSet wide = widened(made.levelSet, 6);
    const double voxel = made.levelSet.voxelSize();
    double near = 0, far = 0;
    for (auto value = made.levelSet.grid->cbeginValueOn(); value; ++value) {
        const double change = std::abs(static_cast<double>(*value - wide.grid->tree().getValue(value.getCoord())));
        double& greatest = std::abs(static_cast<double>(*value)) < 1.5 * voxel ? near : far;
        greatest = std::max(greatest, change);
    }
    CHECK(near < 1e-3 * voxel);
    CHECK(far < 0.05 * voxel);
}

TEST_CASE("solidOf: open sheets beside or across a closed body leave it whole", "[vdb]") {
    const Mesh ball = test::ball(3), level = test::plane(6, 12), cut = test::moved(test::plane(2.4, 8), {0, 0.13f, 0});
    const Mesh ground = test::moved(level, {0, -1.04f, 0});
    const auto [name, mesh] = GENERATE_COPY(table<std::string, Mesh>(
        {{"a plane in it", test::together(ball, test::moved(test::plane(0.9, 8), {0.1f, 0.13f, 0}))},
         {"a plane across it", test::together(ball, cut)},
         {"a turned plane across it", test::together(ball, test::flipped(cut))},
         {"a plane across it, turned inside out", test::together(test::flipped(ball), cut)},
         {"ground", test::together(ball, ground)},
         {"turned ground", test::together(ball, test::flipped(ground))}}));
    CAPTURE(name);
    const double voxel = 0.09;
    const MeshSolid made = solid(mesh, {.voxel = voxel}), alone = solid(ball, {.voxel = voxel});
    const openvdb::tree::ValueAccessor<const openvdb::FloatTree> at(made.levelSet.grid->tree());
    test::Worst worst;
    for (auto value = alone.levelSet.grid->cbeginValueOn(); value; ++value) {
        const openvdb::Vec3d p = alone.levelSet.grid->indexToWorld(value.getCoord());
        worst.see(std::abs(static_cast<double>(*value - at.getValue(value.getCoord()))) / voxel, {{p[0], p[1], p[2]}});
    }
    CAPTURE(worst.where);
    CHECK(worst.value < 0.25); // where the plane cuts faces
    const SolidDistance judge(made.levelSet), judgeAlone(alone.levelSet);
    size_t differ = 0;
    for (const Vec3d& p : test::randomPoints(test::cube(1.2), 1000, 3))
        differ += judge.inside(p) != judgeAlone.inside(p);
    CHECK(differ == 0);
}

TEST_CASE("solidOf: a closed shell within an open body is a cavity if its faces point inward", "[vdb]") {
    const Mesh body = test::withHole(test::ball(5), {0, 1, 0}, 0.25);
    Mesh inner = test::flipped(test::ball(3));
    for (auto& p : inner.points) p *= 0.5f;
    const MeshSolid hollow = solid(test::together(body, inner), {.voxel = 0.05});
    const Sdf sdf = sdfOf(hollow.levelSet);
    CHECK(sdf.distance.at<0>({{0.05, 0, 0.42}}).value > 0.04);
    CHECK(sdf.distance.at<0>({{0.05, 0, 0.6}}).value < -0.04);
    CHECK(!SolidDistance(hollow.levelSet).inside({{0, 0, 0.1}}));
    // A tube that is closed inside: many of the cavity's faces are near the open ends.
    const auto box = [](float size, float height) {
        Mesh mesh;
        for (const float y : {-height, height})
            for (const auto& [x, z] : {std::pair{-size, -size}, {size, -size}, {size, size}, {-size, size}})
                mesh.points.emplace_back(x, y, z);
        mesh.quads = {{0, 4, 5, 1}, {1, 5, 6, 2}, {2, 6, 7, 3}, {3, 7, 4, 0}, {4, 7, 6, 5}, {0, 1, 2, 3}};
        return mesh;
    };
    Mesh tube = box(0.5f, 0.5f);
    tube.quads.resize(4);
    const MeshSolid pipe = solid(test::together(tube, test::flipped(box(0.3f, 0.48f))), {.voxel = 0.04});
    CHECK(sdfOf(pipe.levelSet).distance.at<0>({{0.22, 0, 0.01}}).value > 0.04);
    CHECK(sdfOf(pipe.levelSet).distance.at<0>({{0.4, 0, 0.01}}).value < -0.04);
}

TEST_CASE("solidOf: a reversed closed part that reaches out of an open body leaves no pit", "[vdb]") {
    const Mesh body = test::withHole(test::ball(5), {0, -1, 0}, 0.3);
    for (const int level : {2, 3}) {
        Mesh eye = test::flipped(test::ball(level));
        for (auto& p : eye.points) p = 0.3f * p + openvdb::Vec3s(0, 0, 1);
        const MeshSolid made = solid(test::together(body, eye), {.voxel = 0.05});
        const Sdf sdf = sdfOf(made.levelSet);
        for (const double z : {0.75, 0.85, 0.95, 1.05, 1.2}) CHECK(sdf.distance.at<0>({{0, 0, z}}).value < -0.04);
    }
}

TEST_CASE("solidOf: a closed body in a hollow of the ground is whole", "[vdb]") {
    Mesh ground = test::plane(6, 40);
    for (auto& p : ground.points) p[1] = 0.15f * (p[0] * p[0] + p[2] * p[2]) - 1.2f;
    for (const Mesh& bowl : {ground, test::flipped(ground)}) {
        const MeshSolid made = solid(test::together(test::ball(4), bowl), {.voxel = 0.08});
        CHECK(sdfOf(made.levelSet).distance.at<0>({{0, 0.85, 0}}).value == Approx(-0.15).margin(0.01));
        CHECK(SolidDistance(made.levelSet).inside({{0.1, 0.1, 0.1}}));
    }
}

TEST_CASE("solidOf: the wall between two boxes is no wall, and none of their faces is reversed", "[vdb]") {
    const auto box = [](float x) {
        Mesh mesh;
        mesh.points = {{x, 0, 0}, {x + 1, 0, 0}, {x + 1, 0, 1}, {x, 0, 1},
                       {x, 1, 0}, {x + 1, 1, 0}, {x + 1, 1, 1}, {x, 1, 1}};
        mesh.quads = {{4, 7, 6, 5}, {0, 4, 5, 1}, {1, 5, 6, 2}, {2, 6, 7, 3}, {3, 7, 4, 0}, {0, 1, 2, 3}};
        return mesh;
    };
    Mesh window = box(0);
    window.triangles = test::trianglesOf(window);
    window.quads.clear();
    window.triangles.pop_back(); // of its floor
    const MeshSolid made = solid(test::together(window, box(1)), {.voxel = 0.05});
    CHECK(made.figures.reversedFaces == 0);
    CHECK(made.figures.filledShells == 0);
    CHECK(sdfOf(made.levelSet).distance.at<0>({{0.98, 0.6, 0.5}}).value < -0.1);
}

TEST_CASE("solidOf: a body with a large hole is no sheet, and hills are one", "[vdb]") {
    Mesh hills = test::plane(6, 60);
    for (auto& p : hills.points) p[1] = 0.3f * std::sin(3 * p[0]) * std::cos(2 * p[2]);
    CHECK(solid(hills, {.voxel = 0.07}).figures.undecided > 0.9);
    Mesh box; // without its floor
    box.points = {{0, 0, 0}, {1, 0, 0}, {1, 0, 1}, {0, 0, 1}, {0, 1, 0}, {1, 1, 0}, {1, 1, 1}, {0, 1, 1}};
    box.quads = {{4, 7, 6, 5}, {0, 4, 5, 1}, {1, 5, 6, 2}, {2, 6, 7, 3}, {3, 7, 4, 0}};
    const MeshSolid open = solid(box, {.voxel = 0.05});
    CHECK(open.figures.undecided < 0.5);
    CHECK(sdfOf(open.levelSet).distance.at<0>({{0.5, 0.88, 0.5}}).value == Approx(-0.12).margin(0.01));
}

TEST_CASE("solidOf: overlapping parts have no wall between them", "[vdb]") {
    // The union of two balls: the inside distance is measured to the outer surface, not to the hidden caps.
    const Mesh mesh = test::together(test::ball(5), test::moved(test::ball(5), {0.9f, 0, 0}));
    const MeshSolid made = solid(mesh, {.voxel = 0.04, .halfWidth = 8});
    CHECK(made.figures.hidden == Approx(0.275).margin(0.02)); // two caps of height 0.55 of spheres of diameter 2
    const openvdb::tree::ValueAccessor<const openvdb::FloatTree> at(made.levelSet.grid->tree());
    test::Worst worst;
    for (auto value = made.levelSet.grid->cbeginValueOn(); value; ++value) {
        const openvdb::Vec3d p = made.levelSet.grid->indexToWorld(value.getCoord());
        const openvdb::Vec3d q = p - openvdb::Vec3d(0.9, 0, 0);
        const double outside = std::min(p.length(), q.length()) - 1;
        // Inside, the closest point is on the visible part of either sphere or on the circle in which they intersect.
        const double x = p[0] - 0.45, r = std::hypot(p[1], p[2]) - std::sqrt(1 - 0.45 * 0.45);
        double exact = outside;
        if (outside < 0) {
            exact = std::hypot(x, r);
            if (p.length() > 0 && p[0] / p.length() < 0.45) exact = std::min(exact, std::abs(p.length() - 1));
            if (q.length() > 0 && q[0] / q.length() > -0.45) exact = std::min(exact, std::abs(q.length() - 1));
            exact = -exact;
        }
        worst.see(std::abs(static_cast<double>(*value) - exact) / 0.04, {{p[0], p[1], p[2]}});
    }
    CAPTURE(worst.where);
    CHECK(worst.value < 0.25); // faces cut by others end within 0.2 voxels; facets add 0.02
}

TEST_CASE("solidOf: a reversed part that reaches out of the others is solid where they overlap", "[vdb]") {
    Mesh eye = test::moved(test::ball(3), {3, 0, 0});
    for (auto& p : eye.points) p *= 0.3f; // its centre is at 0.9
    const bool large = GENERATE(false, true);
    const Mesh other = large ? test::moved(test::ball(3), {0.9f, 0, 0}) : eye;
    const Mesh right = test::together(test::ball(3), other), ground = test::plane(2.2, 1);
    const MeshSolid expected = solid(right, {.voxel = 0.07});
    CHECK(expected.figures.turnedShells == 0);
    const Mesh reversed = test::together(test::ball(3), test::flipped(other));
    for (const Mesh& mesh : {reversed, test::together(test::flipped(test::ball(3)), other),
                             test::together(reversed, ground)}) { // with a sheet through both
        const MeshSolid made = solid(mesh, {.voxel = 0.07});
        CHECK(made.figures.turnedShells == 1);
        CHECK(made.figures.thin == Approx(expected.figures.thin).margin(1e-3));
        CHECK(wrong(right, made.levelSet, 400) == 0);
        CHECK(volumeOf(made.levelSet) == Approx(volumeOf(expected.levelSet)).epsilon(1e-3));
    }
}

TEST_CASE("solidOf: a part whose faces are doubled back to back stays", "[vdb]") {
    const Mesh spot = test::spot();
    for (const float height : {0.2f, -0.3f, 0.6f}) {
        Mesh upper = test::flipped(spot);
        std::erase_if(upper.triangles, [&](const auto& t) { return spot.points[t[0]][1] < height; });
        std::erase_if(upper.quads, [&](const auto& q) { return spot.points[q[0]][1] < height; });
        const MeshSolid made = solid(test::together(spot, upper), {.dim = 44});
        CAPTURE(height, upper.faces(), made.figures.duplicateFaces);
        CHECK(made.figures.boundaryEdges == 0);
        CHECK(wrong(spot, made.levelSet, 400) == 0);
    }
}

TEST_CASE("solidOf: an inner shell is a cavity only if its faces point inward", "[vdb]") {
    Mesh inner = test::ball(4);
    for (auto& p : inner.points) p *= 0.5f;
    const double outer = volumeOf(solid(test::ball(4), {.voxel = 0.05}).levelSet);
    const MeshSolid hollow = solid(test::together(test::ball(4), test::flipped(inner)), {.voxel = 0.05});
    CHECK(volumeOf(hollow.levelSet) == Approx(outer * 7 / 8).epsilon(0.01));
    const MeshSolid full = solid(test::together(test::ball(4), inner), {.voxel = 0.05});
    CHECK(volumeOf(full.levelSet) == Approx(outer).epsilon(0.001));
    CHECK(full.figures.hidden == Approx(0.2).margin(0.01));
    // What is filled is counted; a cavity is not, nor are parts that overlap.
    CHECK(hollow.figures.filledShells == 0);
    CHECK(full.figures.filledShells == 1);
    CHECK(full.figures.filledFaces == inner.triangles.size());
    CHECK(full.figures.filledVolume == Approx(M_PI / 6).epsilon(0.01));
    const Mesh both = test::flipped(test::together(test::ball(4), inner)); // both turned inside out
    CHECK(solid(both, {.voxel = 0.05}).figures.filledShells == 1);
    const Mesh across = test::together(test::ball(4), test::moved(inner, {0.8f, 0, 0}));
    CHECK(solid(across, {.voxel = 0.05}).figures.filledShells == 0);
    // A body in a cavity is a body, and an outer shell that is turned inside out may have a cavity.
    Mesh pearl = inner;
    for (auto& p : pearl.points) p *= 0.5f;
    const Mesh nested = test::together(test::together(test::ball(4), test::flipped(inner)), pearl);
    const MeshSolid nut = solid(nested, {.voxel = 0.05});
    CHECK(nut.figures.clean);
    CHECK(volumeOf(nut.levelSet) == Approx(outer * (1 - 1.0 / 8 + 1.0 / 64)).epsilon(0.01));
    CHECK(volumeOf(solid(test::flipped(nested), {.voxel = 0.05}).levelSet) ==
          Approx(volumeOf(nut.levelSet)).epsilon(1e-4));
}

TEST_CASE("solidOf: coincident opposite faces bound nothing unless the whole mesh is double", "[vdb]") {
    // Two half balls, each closed by the same disc, make one ball.
    Mesh halves;
    const Mesh ball = test::ball(4);
    for (const double side : {1.0, -1.0}) {
        Mesh part = test::withHole(ball, {0, 0, -side * 100}, 100);
        std::map<std::pair<openvdb::Index32, openvdb::Index32>, int> edges;
        for (const auto& t : part.triangles)
            for (int k = 0; k < 3; ++k) edges[{t[k], t[(k + 1) % 3]}] = 1;
        const auto middle = static_cast<openvdb::Index32>(part.points.size());
        part.points.emplace_back(0.0f, 0.0f, 0.0f);
        for (const auto& [edge, one] : edges)
            if (!edges.count({edge.second, edge.first})) part.triangles.emplace_back(edge.second, edge.first, middle);
        halves = test::together(halves, part);
    }
    const MeshSolid whole = solid(halves, {.voxel = 0.05});
    CHECK(whole.figures.hidden == Approx(1.0 / 3).margin(0.02)); // two discs and a sphere: 2 π of 6 π
    CHECK(volumeOf(whole.levelSet) == Approx(volumeOf(solid(ball, {.voxel = 0.05}).levelSet)).epsilon(1e-4));
    const MeshSolid doubled = solid(test::together(ball, test::flipped(ball)), {.voxel = 0.05});
    CHECK(volumeOf(doubled.levelSet) == Approx(volumeOf(whole.levelSet)).epsilon(1e-4));
    CHECK(wrong(ball, doubled.levelSet, 200) == 0);
}

TEST_CASE("solidOf: an open sheet gets the given thickness", "[vdb]") {
    const Mesh flat = test::plane(2, 8);
    CHECK_THROWS_WITH(solid(flat, {.dim = 40}), Catch::ContainsSubstring("thickness="));
    const MeshSolid made = solid(flat, {.voxel = 0.05, .thickness = 0.3});
    const Sdf sdf = sdfOf(widened(made.levelSet, 9));
    for (const double y : {-0.4, -0.2, -0.1, 0.1, 0.2, 0.4})
        CHECK(sdf.distance.at<0>({{0.313, y, -0.271}}).value == Approx(std::abs(y) - 0.15).margin(0.002));
    CHECK(sdf.distance.at<0>({{0.313, 0, -0.271}}).value < -0.1);
    const MeshSolid strip = solid(test::moebius(0.6, 200), {.voxel = 0.05, .thickness = 0.2});
    // Area times thickness, plus a half disc along the edge, which goes around twice.
    CHECK(volumeOf(strip.levelSet) == Approx(2 * M_PI * 0.6 * 0.2 + 4 * M_PI * M_PI * 0.01 / 2).epsilon(0.05));
    CHECK_THROWS_AS(solid(flat, {.dim = 40, .thickness = -1}), ValueError);
}

TEST_CASE("solidOf: thin parts are measured with the voxel size that they need", "[vdb]") {
    Mesh plate = test::ball(4);
    for (auto& p : plate.points) p[1] *= 0.01f;
    const MeshSolid thin = solid(test::together(test::ball(4), test::moved(plate, {3, 0, 0})), {.voxel = 0.05});
    CHECK(thin.figures.thin == Approx(1.0 / 3).margin(0.02)); // two discs of area π and a sphere of area 4 π
    CHECK(thin.figures.missing == Approx(1.0 / 3).margin(0.02));
    const MeshSolid ball = solid(test::ball(4), {.voxel = 0.05});
    CHECK(ball.figures.thin == 0);
    CHECK(ball.figures.enough == 0);
    CHECK(ball.figures.meanThickness == Approx(2.0 / 3 / 0.05).epsilon(0.01));
    // A box is not thin along its edges, and few large faces are sampled all over.
    const auto box = [](float x, float y, float z) {
        Mesh mesh;
        for (int k = 0; k < 8; ++k) mesh.points.emplace_back(k & 1 ? x : 0, k & 2 ? y : 0, k & 4 ? z : 0);
        mesh.quads = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
        return mesh;
    };
    CHECK(solid(box(1, 1, 1), {.voxel = 0.05}).figures.thin == 0);
    const MeshSolid tile = solid(box(1, 0.1f, 1), {.voxel = 0.05}); // two voxels thick
    CHECK(tile.figures.thin == Approx(2 / 2.4).epsilon(0.01));
    CHECK(tile.figures.missing == 0);
    CHECK(tile.figures.enough == Approx(0.1 / 3).epsilon(1e-3));
    CHECK(solid(box(1, 0.1f, 1), {.voxel = 0.99 * tile.figures.enough}).figures.thin == 0);
    // Neither the orientation nor faces inside the solid matter.
    CHECK(solid(test::flipped(box(1, 0.1f, 1)), {.voxel = 0.05}).figures.thin == Approx(2 / 2.4).epsilon(0.01));
    const Mesh crossed = test::together(box(1, 1, 1), test::moved(box(0.1f, 0.4f, 0.4f), {0.5f, 0.8f, 0.3f}));
    const double fin = 2 * 0.2 * 0.4; // two voxels thick, half of it visible
    CHECK(solid(crossed, {.voxel = 0.05}).figures.thin == Approx(fin / (6 + 2 * 0.2 * 0.5)).epsilon(0.2));
}

TEST_CASE("solidOf: a mesh too far from the origin for its voxels is refused", "[vdb]") {
    const auto at = [](float offset, float size) {
        Mesh mesh = test::ball(3);
        for (auto& p : mesh.points) p = p * size + test::Vec3s(offset, 0, 0);
        return mesh;
    };
    // Positions of 1e6 are 1/16 apart, those of 1e5 1/128.
    CHECK_THROWS_WITH(solid(at(1e6f, 1), {.dim = 100}), Catch::ContainsSubstring("1e+06 units from the origin") &&
                                                            Catch::ContainsSubstring("0.062 apart") &&
                                                            Catch::ContainsSubstring("move it to the origin"));
    CHECK_THROWS_WITH(solid(at(1e5f, 1e-3f), {.dim = 100}), Catch::ContainsSubstring("move it to the origin"));
    CHECK_THROWS_WITH(solid(at(1e5f, 1), {.dim = 100}), Catch::ContainsSubstring("voxels of at least 0.033"));
    CHECK_NOTHROW(solid(at(1e5f, 1), {.voxel = 0.033}));
    CHECK_NOTHROW(solid(at(1e5f, 100), {.dim = 100}));
    CHECK_NOTHROW(solid(at(1e3f, 1), {.dim = 100}));
}

TEST_CASE("solidOf: does not depend on the number of threads", "[vdb]") {
    const Mesh mesh = test::together(test::withHole(test::spot(), {0, 0.4, 0.3}, 0.25),
                                     test::moved(test::spot(), {0.31f, 0.13f, 0.22f}));
    std::vector<openvdb::FloatGrid::ConstPtr> grids;
    for (const int threads : {1, 4}) {
        const ThreadLimit limit(threads);
        grids.push_back(solid(mesh, {.dim = 50}).levelSet.grid);
    }
    CHECK(grids[0]->activeVoxelCount() == grids[1]->activeVoxelCount());
    size_t different = 0;
    for (auto value = grids[0]->cbeginValueOn(); value; ++value)
        different += *value != grids[1]->tree().getValue(value.getCoord());
    CHECK(different == 0);
}
