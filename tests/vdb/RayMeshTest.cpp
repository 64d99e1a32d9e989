// SPDX-License-Identifier: Apache-2.0
#include "curlew/base/Error.h"
#include "curlew/vdb/RayMesh.h"
#include "support/Meshes.h"
#include "support/Points.h"

#include <atomic>

using namespace curlew;

namespace {

double distanceTo(const Mesh& mesh, const Vec3d& p) { return test::distanceTo(mesh, {p[0], p[1], p[2]}); }

} // namespace

TEST_CASE("RayMesh: the closest triangle is that of a search through all triangles", "[vdb]") {
    // Also far from the origin, at a thousandth of the size, and for points far from the mesh.
    const auto [offset, scale] = GENERATE(table<float, float>({{0.0f, 1.0f}, {100.0f, 1.0f}, {0.0f, 0.001f}}));
    Mesh mesh = test::spot();
    for (auto& p : mesh.points) p = p * scale + test::Vec3s(offset);
    const RayMesh rays(mesh);
    test::Worst worst;
    for (uint64_t k = 0; k < 60; ++k) {
        const double reach = k % 3 == 0 ? 50 : k % 3 == 1 ? 1.2 : 0.3;
        Vec3d p = test::randomPoint(test::cube(reach), 5, k);
        for (int axis = 0; axis < 3; ++axis)
            p[axis] = p[axis] * static_cast<double>(scale) + static_cast<double>(offset);
        const double exact = distanceTo(mesh, p);
        worst.see(std::abs(rays.distanceTo(p) - exact) / exact, p);
    }
    CAPTURE(worst.where, worst.value);
    CHECK(worst.value < 1e-9);
    CHECK(std::isinf(rays.distanceTo({{std::nan(""), 0, 0}})));
}

TEST_CASE("RayMesh: a ray through a ball hits both sides with normals that point outward", "[vdb]") {
    const RayMesh rays(test::ball(4));
    const auto first = rays.hit({{{-3, 0.1, 0.2}}, {{1, 0, 0}}});
    REQUIRE(first);
    const double x = std::sqrt(1 - 0.01 - 0.04); // of the sphere; facets are within 0.002 of it
    CHECK(first->distance == Approx(3 - x).margin(0.005));
    CHECK(rays.normal(first->triangle)[0] < -0.9);
    const auto second = rays.hit({{{0, 0.1, 0.2}}, {{1, 0, 0}}});
    REQUIRE(second);
    CHECK(second->distance == Approx(x).margin(0.005));
    CHECK(rays.normal(second->triangle)[0] > 0.9);
    CHECK_THROWS_AS(RayMesh(Mesh{}), ValueError);
}

TEST_CASE("RayMesh: rays in packets hit what single rays hit", "[vdb]") {
    const RayMesh mesh(test::ball(4));
    std::vector<Ray> rays;
    for (uint64_t k = 0; k < 1003; ++k) { // no multiple of a packet's width
        const Vec3d eye{{-3, 0.1, 0.2}}, way = test::randomPoint(test::cube(1.2), 3, k) - eye;
        rays.push_back({eye, way * (1 / length(way))});
    }
    std::vector<std::optional<RayMesh::Hit>> hits(rays.size());
    std::vector<uint8_t> flags(rays.size());
    mesh.hits(rays, hits);
    mesh.occluded(rays, flags);
    size_t found = 0;
    for (size_t k = 0; k < rays.size(); ++k) {
        const auto alone = mesh.hit(rays[k]);
        CAPTURE(k);
        REQUIRE(hits[k].has_value() == alone.has_value());
        CHECK((flags[k] != 0) == alone.has_value());
        if (!alone) continue;
        ++found;
        CHECK(hits[k]->distance == Approx(alone->distance).epsilon(1e-9));
    }
    CHECK(found > 100);
    CHECK(found < 1000);
}

TEST_CASE("RayMesh: a caller can cancel the building of the tree", "[vdb]") {
    std::atomic<int> asked = 0;
    const Monitor stop{.report = {}, .cancelled = [&] { return ++asked > 0; }};
    CHECK_THROWS_AS(RayMesh(test::spot(), stop), Interrupted);
    CHECK(asked > 0);
}
