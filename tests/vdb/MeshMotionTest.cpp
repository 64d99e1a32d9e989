// SPDX-License-Identifier: Apache-2.0
#include "curlew/math/Rotation.h"
#include "curlew/vdb/MeshMotion.h"
#include "support/Points.h"

#include <memory>

using namespace curlew;
using namespace curlew::test;

namespace {

openvdb::Vec3s stored(const Vec3d& p) { return openvdb::Vec3s(openvdb::Vec3d(p[0], p[1], p[2])); }

/// Random points in a box with these half edges. The faces do not matter.
Mesh cloud(const Vec3d& half, size_t count, uint64_t seed) {
    Mesh mesh;
    for (uint64_t k = 0; k < count; ++k) {
        Vec3d p = randomPoint(cube(1), seed, k);
        for (int axis = 0; axis < 3; ++axis) p[axis] *= half[axis];
        mesh.points.push_back(stored(p));
    }
    mesh.triangles.emplace_back(0, 1, 2);
    return mesh;
}

Mesh moved(Mesh mesh, const Matrix3& turn, const Vec3d& offset) {
    for (auto& p : mesh.points) {
        const Vec3d q{{static_cast<double>(p[0]), static_cast<double>(p[1]), static_cast<double>(p[2])}};
        p = stored(turn * q + offset);
    }
    return mesh;
}

} // namespace

TEST_CASE("rigidFit: finds the rigid motion of solid and flat and thin meshes", "[vdb]") {
    const auto edges = GENERATE(Vec3d{{1, 0.7, 0.5}}, Vec3d{{1, 1, 1}}, Vec3d{{1, 0.06, 0.06}}, Vec3d{{1, 0.5, 0}});
    const Mesh mesh = cloud(edges, 300, 1);
    for (uint64_t k = 0; k < 30; ++k) {
        const Matrix3 turn = rotationBy(randomPoint(cube(1.7), 5, k));
        const RigidFit fit = rigidFit(mesh, moved(mesh, turn, {{5, -3, 2}}));
        CAPTURE(edges, k, fit.residual);
        CHECK(fit.rigid());
        CHECK(fit.residual < 1e-6); // rounding of floats at 5
        // A thin mesh determines its rotation about its long axis less precisely.
        CHECK(length(rotationVector(fit.now.axes * transpose(turn))) < 2e-5);
    }
    CHECK(rigidFit(mesh, mesh).residual == 0);
    CHECK(rigidFit(mesh, mesh).now.axes == Matrix3{});
}

TEST_CASE("rigidFit: finds the motion of balls and other bodies of revolution", "[vdb]") {
    const double height = GENERATE(1.0, 3.0, 0.2);
    Mesh mesh; // a UV sphere, stretched along z
    for (int i = 0; i <= 16; ++i)
        for (int j = 0; j < 24; ++j) {
            const double u = i * 3.14159265358979 / 16, v = j * 3.14159265358979 / 12;
            mesh.points.push_back(
                stored({{std::sin(u) * std::cos(v), std::sin(u) * std::sin(v), height * std::cos(u)}}));
        }
    mesh.triangles.emplace_back(0, 1, 2);
    for (uint64_t k = 0; k < 30; ++k) {
        const Matrix3 turn = k == 0 ? Matrix3{} : rotationBy(randomPoint(cube(1.7), 5, k));
        const RigidFit fit = rigidFit(mesh, moved(mesh, turn, {{0.3, 0.1 * static_cast<double>(k), 0}}));
        CAPTURE(height, k, fit.residual);
        CHECK(fit.rigid());
        CHECK(length(rotationVector(fit.now.axes * transpose(turn))) < 1e-6);
    }
}

TEST_CASE("rigidFit: bending and scaling and mirroring are not rigid", "[vdb]") {
    const Mesh mesh = cloud({{1, 0.7, 0.5}}, 200, 2);
    Mesh bent = mesh, shrunk = mesh, mirrored = mesh, line = mesh;
    for (auto& p : bent.points) p[1] += 0.01f * p[0] * p[0];
    for (auto& p : shrunk.points) p *= 0.999f;
    for (auto& p : mirrored.points) p[0] = -p[0];
    for (auto& p : line.points) p[1] = p[2] = 0;
    for (const Mesh& other : {bent, shrunk, mirrored, line}) CHECK_FALSE(rigidFit(mesh, other).rigid());
}

TEST_CASE("correspond: meshes correspond if their faces are equal", "[vdb]") {
    const Mesh mesh = cloud({{1, 1, 1}}, 20, 3);
    Mesh turned = mesh, more = mesh, other = mesh;
    turned.points[3] = {9, 9, 9};
    more.points.emplace_back(1, 2, 3);
    other.triangles[0] = {0, 2, 1};
    CHECK(correspond(mesh, turned));
    CHECK_FALSE(correspond(mesh, more));
    CHECK_FALSE(correspond(mesh, other));
}

TEST_CASE("meshBetween: interpolates points between frames to third order", "[vdb]") {
    const Mesh mesh = cloud({{1, 0.5, 0.3}}, 100, 4);
    const auto at = [&](double t) {
        Mesh bent = mesh;
        for (auto& p : bent.points)
            p = openvdb::Vec3s(p[0] + static_cast<float>(std::sin(3 * t)) * p[1], p[1] * static_cast<float>(1 + t * t),
                               p[2] + static_cast<float>(std::exp(t)));
        return std::make_shared<const Mesh>(std::move(bent));
    };
    const auto errorAt = [&](double step, bool ends) {
        const MeshKeys keys{.before = ends ? nullptr : at(0.2 - step),
                            .from = at(0.2),
                            .to = at(0.2 + step),
                            .after = at(0.2 + 2 * step)};
        const Mesh found = meshBetween(keys, 0.4), exact = *at(0.2 + 0.4 * step);
        float worst = 0;
        for (size_t k = 0; k < exact.points.size(); ++k)
            worst = std::max(worst, (found.points[k] - exact.points[k]).length());
        return static_cast<double>(worst);
    };
    for (const bool ends : {false, true}) {
        // The argument of sin 3t changes by 0.3 and 0.15 in a step. At 0.3, the fourth-order term still reduces the
        // measured order.
        const double coarse = errorAt(0.1, ends), fine = errorAt(0.05, ends);
        CAPTURE(ends, coarse, fine);
        CHECK(std::log2(coarse / fine) > 2.6);
    }
    const MeshKeys keys{.before = nullptr, .from = at(0), .to = at(1), .after = nullptr};
    CHECK(meshBetween(keys, 0).points == keys.from->points);
    CHECK(meshBetween(keys, 1).points == keys.to->points);
}

TEST_CASE("velocitiesBetween: are the derivatives of meshBetween", "[vdb]") {
    const auto at = [](double t) {
        Mesh mesh = cloud({{1, 0.7, 0.5}}, 50, 3);
        for (auto& p : mesh.points)
            p += openvdb::Vec3s(openvdb::Vec3d(2 * t, t * t * static_cast<double>(p[1]), t * t * t));
        return std::make_shared<const Mesh>(mesh);
    };
    constexpr double kFrame = 0.25, kStep = 1e-2;
    const MeshKeys keys{.before = at(-kFrame), .from = at(0), .to = at(kFrame), .after = at(2 * kFrame)};
    for (const double part : {0.1, 0.5, 0.8}) {
        const auto velocities = velocitiesBetween(keys, part, kFrame);
        const Mesh below = meshBetween(keys, part - kStep), above = meshBetween(keys, part + kStep);
        REQUIRE(velocities.size() == below.points.size());
        for (size_t k = 0; k < velocities.size(); ++k) {
            const auto difference = (above.points[k] - below.points[k]) / static_cast<float>(2 * kStep * kFrame);
            CHECK((velocities[k] - difference).length() < 1e-3f); // the points are floats, so 1e-7 / (kStep kFrame)
        }
    }
}
