// SPDX-License-Identifier: Apache-2.0
#include "curlew/base/Error.h"
#include "curlew/base/Parallel.h"
#include "curlew/vdb/LevelSetBoolean.h"
#include "curlew/vdb/MeshSolid.h"
#include "curlew/vdb/SolidDistance.h"
#include "support/Meshes.h"
#include "support/Points.h"

#include <algorithm>
#include <cmath>

using namespace curlew;

namespace {

/// Random points as arrays.
struct Arrays {
    std::vector<double> x, y, z;
    Arrays(double reach, size_t count) {
        for (const Vec3d& p : test::randomPoints(test::cube(reach), count, 3))
            x.push_back(p[0]), y.push_back(p[1]), z.push_back(p[2]);
    }
};

WrongSide wrong(std::vector<const SolidDistance*> solids, Side side, const Arrays& at) {
    return wrongSideOf(solids, side, at.x, at.y, at.z);
}

/// A mesh with a ring of quads, wide and flat, around the points on the unit circle in the plane y = 0.
Mesh inRing(Mesh mesh) {
    const float reach = 1000;
    std::vector<std::pair<double, openvdb::Index32>> circle;
    for (openvdb::Index32 k = 0; k < mesh.points.size(); ++k)
        if (mesh.points[k][1] == 0) circle.emplace_back(std::atan2(mesh.points[k][2], mesh.points[k][0]), k);
    std::sort(circle.begin(), circle.end());
    const auto first = static_cast<openvdb::Index32>(mesh.points.size());
    const auto count = static_cast<openvdb::Index32>(circle.size());
    for (const auto& [angle, k] : circle) mesh.points.push_back(mesh.points[k] * reach);
    for (openvdb::Index32 k = 0; k < count; ++k) {
        const openvdb::Index32 next = (k + 1) % count;
        mesh.quads.emplace_back(circle[k].second, circle[next].second, first + next, first + k);
    }
    return mesh;
}

/// A box with edges of 1 and a point at the origin, its floor at y = 0. Points can be shared with test::plane(n, n).
Mesh box(bool withFloor) {
    Mesh mesh;
    mesh.points = {{0, 0, 0}, {1, 0, 0}, {1, 0, 1}, {0, 0, 1}, {0, 1, 0}, {1, 1, 0}, {1, 1, 1}, {0, 1, 1}};
    mesh.quads = {{4, 7, 6, 5}, {0, 4, 5, 1}, {1, 5, 6, 2}, {2, 6, 7, 3}, {3, 7, 4, 0}};
    if (withFloor) mesh.quads.emplace_back(0, 1, 2, 3);
    return mesh;
}

} // namespace

TEST_CASE("SolidDistance: sheets that are joined to a closed body leave it whole", "[vdb]") {
    const Mesh ball = test::ball(3), ground = test::plane(400, 400);
    Mesh apart = ground; // the same, without the quad below the box
    std::erase_if(apart.quads, [&](const auto& q) {
        return apart.points[q[0]] == openvdb::Vec3s(0) && apart.points[q[2]] == openvdb::Vec3s(1, 0, 1);
    });
    CHECK(apart.faces() + 1 == ground.faces());
    Mesh cornerOnly = box(true);
    for (auto& p : cornerOnly.points) p = openvdb::Vec3s(0.5f * p[0], p[1], 0.5f * p[2]);
    const Mesh closed = box(true), above = test::moved(closed, {0, 1, 0}), both = test::together(closed, above);
    Mesh leaky = closed; // stands below a closed box; its top is back to back with the floor of that
    leaky.triangles.emplace_back(0, 1, 2);
    leaky.quads.pop_back();
    const auto [name, mesh, body] = GENERATE_COPY(table<std::string, Mesh, Mesh>(
        {{"ground around a ball", inRing(ball), ball},
         {"turned ground around a ball", test::flipped(inRing(test::flipped(ball))), ball},
         {"a box on the ground", test::together(ground, closed), closed},
         {"a box on turned ground", test::together(test::flipped(ground), closed), closed},
         {"a box whose floor is the ground's", test::together(ground, box(false)), closed},
         {"a box in the ground", test::together(apart, closed), closed},
         {"a box on one with a hole", test::together(leaky, above), both},
         {"a box that shares a point with the ground", test::together(ground, cornerOnly), cornerOnly}}));
    CAPTURE(name);
    const SolidDistance joined(mesh), alone(body);
    size_t differ = 0;
    for (const Vec3d& p : test::randomPoints(test::cube(1.2), 2000, 4)) differ += joined.inside(p) != alone.inside(p);
    CHECK(differ == 0);
}

TEST_CASE("SolidDistance: a ball has the distance of a sphere for either orientation of its faces", "[vdb]") {
    const Mesh mesh = GENERATE(test::ball(5), test::flipped(test::ball(5)));
    const SolidDistance solid(mesh);
    test::Worst worst;
    for (uint64_t k = 0; k < 500; ++k) {
        const Vec3d p = test::randomPoint(test::cube(2), 1, k);
        worst.see(std::abs(solid.at(p) - (length(p) - 1)), p);
        CHECK(solid.inside(p) == (solid.at(p) < 0));
    }
    CAPTURE(worst.where);
    CHECK(worst.value < 1e-3); // facets of 2 degrees: 1 - cos(1°) = 1.5e-4 in the middle, a few times that at corners
}

TEST_CASE("SolidDistance: a cavity is outside and an inner shell that points outward is inside", "[vdb]") {
    Mesh inner = test::ball(4);
    for (auto& p : inner.points) p *= 0.5f;
    const SolidDistance hollow(test::together(test::ball(4), test::flipped(inner))),
        full(test::together(test::ball(4), inner));
    CHECK(hollow.at({{0.1, 0, 0}}) == Approx(0.4).margin(0.01));
    CHECK(hollow.at({{0.7, 0, 0}}) == Approx(-0.2).margin(0.01));
    CHECK(full.inside({{0.1, 0, 0}}));
}

TEST_CASE("SolidDistance: near a hole the distance is that to the surface that closes it", "[vdb]") {
    // Half a ball: w = 1/2 in the middle of its open disc, which is that surface there.
    const SolidDistance solid(test::withHole(test::ball(5), {0, 0, -1}, 1.414));
    // On the axis, w = (1 + z / sqrt(1 + z²)) / 2, so |w| = 1/2 at z = 0.
    CHECK(solid.at({{0, 0, 0.05}}) == Approx(-0.05).margin(0.02));
    CHECK(solid.at({{0, 0, -0.05}}) == Approx(0.05).margin(0.02));
    CHECK(solid.at({{0, 0, -2}}) > 1); // far away it is the distance to the faces
}

TEST_CASE("SolidDistance: a sheet is judged by its shell", "[vdb]") {
    const SolidDistance solid(test::plane(2, 4), 0.3);
    for (const double y : {-0.4, -0.1, 0.0, 0.1, 0.2})
        CHECK(solid.at({{0.3, y, -0.2}}) == Approx(std::abs(y) - 0.15).margin(1e-6));
    CHECK(solid.at({{2, 0, 0}}) == Approx(1 - 0.15).margin(1e-6));
    // The thickness travels with the level set, also through a motion.
    const LevelSet made =
        solidOf(std::make_shared<Mesh>(test::plane(2, 4)), {.voxel = 0.05, .thickness = 0.3}).levelSet;
    const SolidDistance moved(placed(made, {.offset = {{0, 5, 0}}, .scale = {{2, 2, 2}}}));
    CHECK(moved.at({{0.3, 5.1, -0.2}}) == Approx(0.1 - 0.3).margin(1e-5));
    CHECK_THROWS_AS(SolidDistance(LevelSet{made.grid, nullptr}), ValueError);
}

TEST_CASE("wrongSideOf: counts points and measures the deepest on either side and for unions", "[vdb]") {
    const SolidDistance ball(test::ball(5)), second(test::moved(test::ball(5), {1, 0, 0}));
    const Arrays at(1.5, 2000);
    size_t inside = 0, inUnion = 0;
    double depth = 0, height = 0;
    for (size_t k = 0; k < at.x.size(); ++k) {
        const double d = std::hypot(at.x[k], at.y[k], at.z[k]) - 1, e = std::hypot(at.x[k] - 1, at.y[k], at.z[k]) - 1;
        inside += d < 0;
        inUnion += d < 0 || e < 0;
        depth = std::max(depth, -d);
        height = std::max(height, d);
    }
    const WrongSide of = wrong({&ball}, Side::outside, at), in = wrong({&ball}, Side::inside, at);
    CHECK(std::abs(static_cast<double>(of.points) - static_cast<double>(inside)) <=
          2); // points between facets and sphere
    CHECK(of.depth == Approx(depth).margin(1e-3));
    CHECK(of.points + in.points == at.x.size());
    CHECK(in.depth == Approx(height).margin(1e-3));
    const WrongSide both = wrong({&ball, &second}, Side::outside, at);
    CHECK(std::abs(static_cast<double>(both.points) - static_cast<double>(inUnion)) <= 3);
    CHECK(wrong({&ball}, Side::both, at).points == 0);
    CHECK(wrong({}, Side::inside, at).points == 0);
    const ThreadLimit limit(1);
    CHECK(wrong({&ball}, Side::outside, at).depth == of.depth);
}

namespace {

constexpr double kVoxel = 0.05;

/// Returns how far a level set's spline is from the mesh at most, in voxels, as points near the surface show it: those
/// on different sides of the two. Half of them are within two voxels of the vertices.
double farthest(const Mesh& mesh, size_t count) {
    const SolidDistance solid(mesh);
    const Sdf sdf =
        sdfOf(widened(solidOf(std::make_shared<Mesh>(mesh), {.voxel = kVoxel, .measureParts = false}).levelSet, 5));
    double most = 0;
    for (uint64_t k = 0; k < count; ++k) {
        const auto& t = mesh.triangles[k * 7919 % mesh.triangles.size()];
        // A random point of a triangle, near its first vertex in half of the cases, moved by up to two voxels.
        double u = randomUniform(8, k, 0), v = randomUniform(8, k, 1) * (1 - u);
        if (k % 2 == 0) u *= 0.1, v *= 0.1;
        const openvdb::Vec3d at = openvdb::Vec3d(mesh.points[t[0]]) * (1 - u - v) +
                                  openvdb::Vec3d(mesh.points[t[1]]) * u + openvdb::Vec3d(mesh.points[t[2]]) * v;
        const Vec3d p = Vec3d{{at[0], at[1], at[2]}} + test::randomPoint(test::cube(2 * kVoxel), 9, k);
        const double exact = solid.at(p);
        if ((exact < 0) != (sdf.distance.at<0>(p).value < 0)) most = std::max(most, std::abs(exact) / kVoxel);
    }
    return most;
}

/// A box with its middle at the origin, rotated.
Mesh box(const openvdb::Vec3d& size, double degrees) {
    Mesh mesh;
    for (int k = 0; k < 8; ++k)
        mesh.points.emplace_back(k & 1 ? 0.5f : -0.5f, k & 2 ? 0.5f : -0.5f, k & 4 ? 0.5f : -0.5f);
    for (auto& p : mesh.points) p = test::Vec3s(openvdb::Vec3d(p) * size);
    const std::vector<openvdb::Vec4I> quads{{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4},
                                            {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
    for (const auto& q : quads) {
        mesh.triangles.emplace_back(q[0], q[1], q[2]);
        mesh.triangles.emplace_back(q[0], q[2], q[3]);
    }
    return placed(mesh, {.rotate = {{degrees, 1.7 * degrees, 0}}});
}

} // namespace

TEST_CASE("SolidDistance: a level set is within half a voxel of its mesh where nothing is thinner than three voxels",
          "[vdb]") {
    for (const double degrees : {0.0, 20.0, 45.0}) {
        CAPTURE(degrees);
        CHECK(farthest(box({1, 1, 1}, degrees), 1000) < 0.5); // with sharp edges and corners
        CHECK(farthest(box({1, kThinVoxels * kVoxel, 1}, degrees), 1000) < 0.5);
    }
    // A hollow ball whose skin is three voxels thick.
    Mesh inner = test::ball(3);
    for (auto& p : inner.points) p *= static_cast<float>(1 - kThinVoxels * kVoxel);
    CHECK(farthest(test::together(test::ball(3), test::flipped(inner)), 1000) < 0.5);
}

TEST_CASE("SolidDistance: a film much thinner than a voxel is missing from its level set", "[vdb]") {
    // It lies between two layers of voxels.
    const Mesh film = test::moved(box({1, 0.5 * kVoxel, 1}, 0), {0, 0.5f * static_cast<float>(kVoxel), 0});
    const Mesh mesh = test::together(film, test::moved(test::ball(2), {0, 3, 0}));
    const SolidDistance solid(mesh);
    const Sdf sdf = sdfOf(widened(solidOf(std::make_shared<Mesh>(mesh), {.voxel = kVoxel}).levelSet, 5));
    for (const Vec3d& p : test::randomPoints(test::cube(0.4), 100, 4)) {
        const Vec3d q{{p[0], (0.5 + 0.5 * p[1]) * kVoxel, p[2]}};
        CHECK(solid.inside(q));
        CHECK(sdf.distance.at<0>(q).value > 0);
    }
}
