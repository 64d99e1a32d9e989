// SPDX-License-Identifier: Apache-2.0
#include "../../src/vdb/MeshDistances.h"
#include "support/Meshes.h"
#include "support/Points.h"
#include "support/Samples.h"

using namespace curlew;

namespace {

/// A tilted box of length 2 along x, with quads for four of its sides.
Mesh tiltedBox() {
    Mesh mesh;
    for (int n = 0; n < 8; ++n) {
        const auto x = static_cast<float>(n & 1) * 2 - 1, y = static_cast<float>((n >> 1) & 1) - 0.5F,
                   z = static_cast<float>(n >> 2) - 0.5F;
        mesh.points.emplace_back(0.8F * x - 0.6F * y, 0.6F * x + 0.8F * y, z + 0.3F * x);
    }
    mesh.quads = {{0, 1, 3, 2}, {4, 6, 7, 5}, {0, 4, 5, 1}, {2, 3, 7, 6}};
    mesh.triangles = {{0, 2, 6}, {0, 6, 4}, {1, 5, 7}, {1, 7, 3}};
    return mesh;
}

/// Unconnected random triangles; one is a line, and one a point.
Mesh soup() {
    Mesh mesh;
    for (uint64_t n = 0; n < 60; ++n) {
        const Vec3d p = test::randomPoint(test::cube(0.9), 6, n);
        for (uint64_t k = 0; k < 3; ++k) {
            const Vec3d q = p + test::randomPoint(test::cube(0.1), 7, 3 * n + k);
            mesh.points.emplace_back(q[0], q[1], q[2]);
        }
        const auto first = static_cast<openvdb::Index32>(3 * n);
        mesh.triangles.emplace_back(first, first + 1, first + 2);
    }
    mesh.triangles.emplace_back(0, 1, 1);
    mesh.triangles.emplace_back(2, 2, 2);
    return mesh;
}

struct Case {
    const char* name;
    Mesh mesh;
    double voxel, halfWidth;
    double grown = 1e-5; ///< Tolerance farther than 3 voxels away, in voxels.
};

} // namespace

TEST_CASE("distancesTo: every voxel of a band, and no other, has the distance of its closest face", "[vdb]") {
    // Faces of 10 voxels, of half a voxel, of hundreds of voxels across many leaves, slivers, and without area.
    const Case c = GENERATE(Case{"spot", test::spot(), 0.009, 3}, Case{"ball", test::ball(5), 0.05, 3},
                            Case{"box", tiltedBox(), 0.011, 3}, Case{"wide band of large faces", tiltedBox(), 0.04, 12},
                            Case{"wide band of small faces", test::ball(5), 0.2, 8, 0.05},
                            Case{"slivers", test::bipyramid(200), 0.03, 2.5}, Case{"soup", soup(), 0.02, 3});
    CAPTURE(c.name);
    const auto transform = openvdb::math::Transform::createLinearTransform(c.voxel);
    transform->postTranslate(openvdb::Vec3d(0.123, -0.045, 0.067) * c.voxel);
    const MeshDistances made = distancesTo(c.mesh, *transform, c.halfWidth, {});
    REQUIRE(made.distance->transform() == *transform);
    const openvdb::CoordBBox voxels = made.distance->evalActiveVoxelBoundingBox();
    const Vec3d size{{double(voxels.dim()[0]), double(voxels.dim()[1]), double(voxels.dim()[2])}};
    const auto count = static_cast<uint64_t>(test::kSanitized ? 300 : 3000);
    size_t near = 0;
    for (uint64_t n = 0; n < count; ++n) {
        // Half of them next to a vertex.
        openvdb::Coord ijk;
        const Vec3d part = test::randomPoint(test::cube(1), 3, n); // -1 to 1
        const openvdb::Vec3d vertex = transform->worldToIndex(c.mesh.points[n * 7919 % c.mesh.points.size()]);
        for (int axis = 0; axis < 3; ++axis)
            ijk[axis] = static_cast<int>(
                std::floor(n % 2 == 0 ? voxels.min()[axis] - 1 + (part[axis] + 1) / 2 * (size[axis] + 2)
                                      : vertex[axis] + part[axis] * (c.halfWidth + 1)));
        const double exact = test::distanceTo(c.mesh, transform->indexToWorld(ijk)) / c.voxel;
        const double tolerance = exact < 3 ? 1e-5 : c.grown;
        if (std::abs(exact - c.halfWidth) < 10 * tolerance) continue; // may be on either side
        INFO("voxel " << ijk << ", " << exact << " voxels from the mesh");
        float distance = 0;
        const bool active = made.distance->tree().probeValue(ijk, distance);
        REQUIRE(active == (exact < c.halfWidth));
        REQUIRE(made.face->tree().isValueOn(ijk) == active);
        if (!active) continue;
        ++near;
        REQUIRE(static_cast<double>(distance) / c.voxel == Approx(exact).margin(tolerance));
        const auto face = static_cast<size_t>(made.face->tree().getValue(ijk)), triangles = c.mesh.triangles.size();
        REQUIRE(face < c.mesh.faces());
        Mesh one{.points = c.mesh.points, .triangles = {}, .quads = {}};
        if (face < triangles)
            one.triangles = {c.mesh.triangles[face]};
        else
            one.quads = {c.mesh.quads[face - triangles]};
        REQUIRE(test::distanceTo(one, transform->indexToWorld(ijk)) / c.voxel == Approx(exact).margin(tolerance));
    }
    CHECK(near > count / 10);
}
