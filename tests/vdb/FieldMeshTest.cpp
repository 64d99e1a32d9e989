// SPDX-License-Identifier: Apache-2.0
#include "curlew/base/Error.h"
#include "curlew/base/Parallel.h"
#include "curlew/field/Algebra.h"
#include "curlew/field/NoiseField.h"
#include "curlew/field/Shapes.h"
#include "curlew/vdb/FieldMesh.h"
#include "support/Files.h"
#include "support/Points.h"
#include "support/Polynomial.h"

using namespace curlew;
using namespace curlew::test;
using Catch::Matchers::ContainsSubstring;

namespace {

Vec3d doubles(const openvdb::Vec3s& v) { return {{v[0], v[1], v[2]}}; }

/// The unit normal of a quad or triangle, and whether the vertex normals are on the same side of it.
bool facesOutward(const Mesh& mesh) {
    const auto outward = [&](const auto& face) {
        const Vec3d a = doubles(mesh.points[face[0]]), b = doubles(mesh.points[face[1]]),
                    c = doubles(mesh.points[face[2]]);
        return dot(cross(b - a, c - b), doubles(mesh.normals[face[0]])) > 0;
    };
    return std::all_of(mesh.quads.begin(), mesh.quads.end(), outward) &&
           std::all_of(mesh.triangles.begin(), mesh.triangles.end(), outward);
}

/// A noise on a sphere: psrdnoise's figure 1d.
ScalarField bumpySphere() {
    return sphereSdf(1).distance - noiseField<Psrd3>({}, {.frequency = 1.5, .octaves = 3, .amplitude = 0.17});
}

} // namespace

TEST_CASE("isosurface: vertices are on the surface with the field's normals", "[vdb]") {
    const ScalarField field = bumpySphere();
    const Mesh mesh = isosurface(field, {.box = cube(1.5), .dim = 96});
    CHECK(topologyOf(mesh).closed());
    REQUIRE(mesh.normals.size() == mesh.points.size());
    CHECK(mesh.uvs.empty());
    Worst off, turned;
    for (size_t k = 0; k < mesh.points.size(); ++k) {
        const Vec3d p = doubles(mesh.points[k]), normal = doubles(mesh.normals[k]);
        const auto jet = field.at<1>(p);
        off.see(std::abs(jet.value), p);
        turned.see(length(normal - jet.gradient * (1 / length(jet.gradient))), p);
    }
    CAPTURE(off.where, turned.where);
    CHECK(off.value < 1e-6); // positions of about 1 are rounded to float: 6e-8 times a gradient of about 2, in 3D
    CHECK(turned.value < 1e-6);
    CHECK(facesOutward(mesh));
}

TEST_CASE("isosurface: the surface is at the value, and ends at the box", "[vdb]") {
    const ScalarField squares = formula<3>([](const auto& x) { return x[0] * x[0] + x[1] * x[1] + x[2] * x[2]; });
    const Mesh ball = isosurface(squares, {.iso = 0.25, .box = cube(1), .voxel = 0.1});
    CHECK(topologyOf(ball).closed());
    for (const auto& p : ball.points) CHECK(length(doubles(p)) == Approx(0.5).epsilon(1e-6));
    const Mesh cut = isosurface(squares, {.iso = 0.25, .box = {{{-1, -1, 0}}, {{1, 1, 1}}}, .voxel = 0.1});
    CHECK(!topologyOf(cut).closed());
    double lowest = 1;
    for (const auto& p : cut.points) lowest = std::min<double>(lowest, p[2]);
    CHECK(lowest >= 0);
    CHECK(lowest < 0.1); // within a voxel of the box
    const Mesh reversed = isosurface(-1.0 * squares, {.iso = -0.25, .box = cube(1), .voxel = 0.1, .reversed = true});
    CHECK(reversed.points == ball.points);
    CHECK(facesOutward(reversed));
    CHECK(facesOutward(ball));
    const Mesh few = isosurface(squares, {.iso = 0.25, .box = cube(1), .voxel = 0.02, .adaptivity = 1});
    CHECK(few.faces() < isosurface(squares, {.iso = 0.25, .box = cube(1), .voxel = 0.02}).faces() / 2);
}

TEST_CASE("isosurface: does not depend on the number of threads", "[vdb]") {
    const auto made = [](int threads) {
        const ThreadLimit limit(threads);
        return isosurface(bumpySphere(), {.box = cube(1.5), .dim = 40});
    };
    const Mesh one = made(1), many = made(4);
    CHECK(one.points == many.points);
    CHECK(one.normals == many.normals);
    CHECK(one.quads == many.quads);
}

TEST_CASE("heightMesh: a grid of quads with exact heights, normals and UVs", "[vdb]") {
    const ScalarFieldN<2> terrain = noiseField<PerlinNoise<2>>({}, {.octaves = 4});
    const HeightMeshOptions options{.box = {{{-1, 0}}, {{2, 1.5}}}, .edge = 0.1};
    const Mesh mesh = heightMesh(terrain, options);
    REQUIRE(mesh.points.size() == size_t{31} * 16);
    CHECK(mesh.quads.size() == size_t{30} * 15);
    CHECK(mesh.triangles.empty());
    for (const auto& face : mesh.quads) {
        const Vec3d a = doubles(mesh.points[face[0]]), b = doubles(mesh.points[face[1]]),
                    c = doubles(mesh.points[face[2]]);
        CHECK(cross(b - a, c - b)[2] > 0);
    }
    for (size_t k = 0; k < mesh.points.size(); ++k) {
        const Vec3d p = doubles(mesh.points[k]);
        const Vec<double, 2> at{{-1 + 3.0 * static_cast<double>(k % 31) / 30, 1.5 * static_cast<double>(k / 31) / 15}};
        const auto jet = terrain.at<1>(at);
        CAPTURE(k);
        CHECK(std::abs(p[0] - at[0]) < 1e-6);
        CHECK(std::abs(p[1] - at[1]) < 1e-6);
        CHECK(std::abs(p[2] - jet.value) < 1e-6);
        const Vec3d normal = doubles(mesh.normals[k]);
        CHECK(length(normal) == Approx(1).epsilon(1e-6));
        CHECK(normal[0] == Approx(-jet.gradient[0] * normal[2]).margin(1e-6));
        CHECK(normal[1] == Approx(-jet.gradient[1] * normal[2]).margin(1e-6));
        CHECK(mesh.uvs[k][0] == Approx((at[0] + 1) / 3).margin(1e-6));
        CHECK(mesh.uvs[k][1] == Approx(at[1] / 1.5).margin(1e-6));
    }
    CHECK(topologyOf(mesh).boundaryEdges == 2 * (30 + 15));
}

TEST_CASE("FieldMesh: bad options and fields without a surface are errors", "[vdb]") {
    const ScalarField ball = sphereSdf(0.5).distance;
    const double nan = std::numeric_limits<double>::quiet_NaN(), infinity = std::numeric_limits<double>::infinity();
    CHECK_THROWS_WITH(isosurface(ball, {.iso = 7, .box = cube(1), .dim = 16}), ContainsSubstring("value 7"));
    CHECK_THROWS_WITH(isosurface(ball, {.iso = nan, .box = cube(1)}), ContainsSubstring("finite"));
    CHECK_THROWS_WITH(isosurface(ball, {.box = cube(infinity)}), ContainsSubstring("box"));
    CHECK_THROWS_WITH(isosurface(ball, {.box = {}}), ContainsSubstring("box"));
    CHECK_THROWS_WITH(isosurface(ball, {.box = cube(1), .dim = 16, .adaptivity = 2}), ContainsSubstring("adaptivity"));
    CHECK_THROWS_AS(isosurface(ball, {.box = cube(1), .voxel = 1e-5}), Error);
    CHECK_THROWS_WITH(heightMesh(constantField<2>(0), {.box = {}}), ContainsSubstring("box"));
    CHECK_THROWS_AS(heightMesh(constantField<2>(0), {.edge = 1e-7}), Error);
}

TEST_CASE("heightMesh: a kinked or constant field has finite normals", "[vdb]") {
    const Mesh flat = heightMesh(constantField<2>(0.5), {.dim = 4});
    for (const auto& normal : flat.normals) CHECK(normal == openvdb::Vec3s(0, 0, 1));
    // The gradient of x² is zero on its level set 0, which is a plane; there, normals are those of the faces.
    const ScalarField cubed = formula<3>([](const auto& x) { return x[2] * x[2] * x[2]; });
    const Mesh plane = isosurface(cubed, {.box = cube(1), .dim = 8});
    for (const auto& normal : plane.normals) CHECK(std::abs(normal[2]) == Approx(1).epsilon(1e-3));
}
