// SPDX-License-Identifier: Apache-2.0
#include "curlew/base/Error.h"
#include "curlew/field/Algebra.h"
#include "curlew/field/NoiseField.h"
#include "curlew/noise/GradientNoise.h"
#include "curlew/render/Surface.h"
#include "support/Points.h"

#include <openvdb/tools/LevelSetPlatonic.h>
#include <openvdb/tools/LevelSetSphere.h>

using namespace curlew;

namespace {

constexpr double kResolution = 0.002;

/// From around the origin into a box.
std::vector<Ray> raysInwards(size_t count, const Box& target = test::cube(0.9)) {
    std::vector<Ray> rays;
    for (size_t k = 0; k < count; ++k) {
        const Vec3d origin = normalized(test::randomPoint(test::cube(1), 1, k)) * 3.0;
        rays.push_back({origin, normalized(test::randomPoint(target, 2, k) - origin)});
    }
    return rays;
}

std::vector<RayHit> hitsOf(const Surface& surface, const std::vector<Ray>& rays) {
    std::vector<RayHit> hits(rays.size());
    surface.intersect(rays, kResolution, hits);
    return hits;
}

/// Returns the maximum error of the hits on a ball about the origin, over the rays that pass its silhouette by more
/// than `edge`.
double errorOnBall(const Surface& surface, double radius, double edge, double normalTolerance) {
    const auto rays = raysInwards(1000);
    const auto hits = hitsOf(surface, rays);
    double worst = 0;
    for (size_t k = 0; k < rays.size(); ++k) {
        CAPTURE(rays[k].origin, rays[k].direction);
        const double b = dot(rays[k].origin, rays[k].direction);
        const double miss = std::sqrt(std::max(0.0, dot(rays[k].origin, rays[k].origin) - b * b));
        if (std::abs(miss - radius) < edge) continue;
        REQUIRE(hits[k].found() == (miss < radius));
        if (!hits[k].found()) continue;
        const double distance = -b - std::sqrt(radius * radius - miss * miss);
        worst = std::max(worst, std::abs(hits[k].distance - distance));
        const Vec3d normal = normalized(rays[k].origin + rays[k].direction * hits[k].distance);
        CHECK(length(hits[k].normal - normal) < normalTolerance);
    }
    return worst;
}

} // namespace

TEST_CASE("Surface: rays hit a shape at the exact distance", "[render]") {
    CHECK(errorOnBall(Surface(sphereSdf(0.7)), 0.7, 0, 1e-9) < 1e-9);
    // The same shape as an isosurface, whose Lipschitz bound has to be measured.
    CHECK(errorOnBall(Surface(sphereSdf(1).distance, -0.3, test::cube(1), true), 0.7, 0, 1e-9) < 1e-9);
}

TEST_CASE("Surface: rays hit a level set with accuracy finer than its voxels", "[render]") {
    for (const double voxel : {0.05, 0.025}) {
        const auto grid =
            openvdb::tools::createLevelSetSphere<openvdb::FloatGrid>(0.7f, {0, 0, 0}, static_cast<float>(voxel), 6.0f);
        const LevelSet levelSet{.grid = grid, .mesh = nullptr};
        // The spline's value is off by h⁴ times fourth derivatives (6 / r³ at most) / 180 or so, along the ray by more
        // where it grazes: cos >= sqrt(2 edge / r). Samples are rounded to float.
        CAPTURE(voxel);
        CHECK(errorOnBall(Surface(levelSet), 0.7, 0.5 * voxel, 0.05 * voxel) < 1e-3 * voxel);
    }
    CHECK_THROWS_AS(Surface({.grid = openvdb::createLevelSet<openvdb::FloatGrid>(0.1), .mesh = nullptr}), ValueError);
}

TEST_CASE("Surface: rays find the first level crossing of a general field", "[render]") {
    const ScalarField noise = noiseField<GradientNoise<3>>({}, {.frequency = 2});
    const ScalarField other = noiseField<GradientNoise<3>>({.seed = 1}, {.frequency = 3, .octaves = 3});
    const ScalarField spheres =
        smoothMin(sphereSdf(0.3).distance, placed(sphereSdf(0.02), {.offset = {{0.4, 0.3, 0.2}}}).distance, 0);
    const ScalarField onGround =
        smoothMin(rampField({{0, 1, 0}}), placed(sphereSdf(0.02), {.offset = {{0, 0.03, 0}}}).distance, 0);
    const auto clamped = [](double most) {
        return smoothMax(smoothMin(sphereSdf(0.1).distance, constantField(most), 0), constantField(-most), 0);
    };
    struct Case {
        ScalarField field;
        double value;
        Box aim = test::cube(0.9);
    };
    // Smooth, of several octaves, linear, with kinks that are ridges or valleys, and bent only in a part of the box
    // that few random places meet.
    const auto [field, value, aim] =
        GENERATE_COPY(values<Case>({{noise, 0.1},
                                    {other, 0.05},
                                    {0.5 * noise + rampField({{1, 0, 0}}), 0.1},
                                    {rampField({{1, 0, 0}}), 0.1},
                                    {smoothMin(noise, other, 0), -0.1},
                                    {smoothMax(noise, other - noise, 0), 0.05},
                                    {spheres, 0, test::cube(0.5)},
                                    {onGround, 0, {{{-0.03, 0, -0.03}}, {{0.03, 0.06, 0.03}}}},
                                    {clamped(0.02), 0, test::cube(0.12)},
                                    {clamped(0.001), 0, test::cube(0.12)}}));
    const Surface surface(field, value, test::cube(0.8), false);
    const auto rays = raysInwards(300, aim);
    const auto hits = hitsOf(surface, rays);
    std::vector<uint8_t> occluded(rays.size());
    surface.occluded(rays, kResolution, occluded);
    size_t found = 0, thin = 0;
    for (size_t k = 0; k < rays.size(); ++k) {
        CAPTURE(rays[k].origin, rays[k].direction);
        CHECK((occluded[k] != 0) == hits[k].found());
        double before = 0, expected = std::numeric_limits<double>::infinity();
        bool within = false;
        for (double t = 0; t < 6 && std::isinf(expected); t += 0.25 * kResolution) {
            const Vec3d p = rays[k].origin + rays[k].direction * t;
            if (!test::cube(0.8).contains(p)) continue;
            const double height = field.at<0>(p).value - value;
            if (within && height * before < 0) expected = t;
            within = true;
            before = height;
        }
        if (std::isinf(expected) && !hits[k].found()) continue;
        if (!(std::abs(hits[k].distance - expected) <= kResolution)) {
            ++thin; // the ray grazes a bump: only one of the two methods may find it
            continue;
        }
        ++found;
        const auto jet = field.at<1>(rays[k].origin + rays[k].direction * hits[k].distance);
        CHECK(std::abs(jet.value - value) < 1e-9);
        CHECK(std::abs(std::abs(dot(jet.gradient, hits[k].normal)) - length(jet.gradient)) < 1e-9);
        CHECK(dot(hits[k].normal, rays[k].direction) <= 0);
    }
    CHECK(found > 90);
    CHECK(thin <= 3);
}

TEST_CASE("Surface: rays find the same with a bound of second derivatives as without", "[render]") {
    const auto octaves = GENERATE(1, 4);
    const ScalarField noise = noiseField<GradientNoise<3>>({}, {.frequency = 2, .octaves = octaves});
    const ScalarField unknown = noise * constantField(1);
    REQUIRE(noise.homogeneous());
    REQUIRE_FALSE(unknown.homogeneous());
    const auto rays = raysInwards(20000);
    const auto with = hitsOf(Surface(noise, 0.1, test::cube(0.8), false), rays);
    const auto without = hitsOf(Surface(unknown, 0.1, test::cube(0.8), false), rays);
    size_t found = 0, differ = 0;
    for (size_t k = 0; k < rays.size(); ++k) {
        found += without[k].found();
        differ += with[k].found() != without[k].found() ||
                  (with[k].found() && std::abs(with[k].distance - without[k].distance) > 1e-6);
    }
    CAPTURE(octaves);
    CHECK(found > 10000);
    CHECK(differ <= 1); // a ray that grazes the surface
}

TEST_CASE("Surface: a box cuts solids and leaves sheets open", "[render]") {
    const Sdf ground = planeSdf({{0, 1, 0}}, 0);
    const Box box = test::cube(1);
    const std::vector<Ray> rays{{{{3, -0.5, 0}}, {{-1, 0, 0}}}, {{{0, 3, 0.2}}, {{0, -1, 0}}}};
    const auto solid = hitsOf(Surface(ground, box), rays);
    CHECK(solid[0].distance == Approx(2).epsilon(1e-5)); // the box is a little wider than asked for
    CHECK(solid[0].normal == Vec3d{{1, 0, 0}});
    CHECK(solid[1].distance == Approx(3).epsilon(1e-12));
    const auto sheet = hitsOf(Surface(ground.distance, 0, box, false), rays);
    CHECK_FALSE(sheet[0].found());
    CHECK(sheet[1].normal == Vec3d{{0, 1, 0}});
    // From inside, rays hit the far wall, with a normal that faces the eye.
    const auto inside = hitsOf(Surface(sphereSdf(1)), {{{{0.5, 0, 0}}, {{1, 0, 0}}}});
    CHECK(inside[0].distance == Approx(0.5));
    CHECK(inside[0].normal[0] == Approx(-1));
}

TEST_CASE("Surface: unbounded and empty surfaces are refused", "[render]") {
    CHECK_THROWS_AS(Surface(planeSdf({{0, 1, 0}}, 0)), ValueError);
    CHECK_THROWS_AS(Surface(sphereSdf(1), Box{}), ValueError);
    CHECK_THROWS_AS(Surface(constantField(1.0), 1, test::cube(1), true), ValueError);
}

TEST_CASE("smoothed: rounds edges and keeps flat faces", "[render]") {
    const auto grid = openvdb::tools::createLevelSetCube<openvdb::FloatGrid>(2, {0, 0, 0}, 0.1f);
    const LevelSet box{.grid = grid, .mesh = nullptr};
    CHECK(smoothed(box, 0).grid == box.grid);
    const LevelSet smooth = smoothed(box, 1);
    const auto at = [](const LevelSet& s, int i, int j, int k) { return s.grid->tree().getValue({i, j, k}); };
    CHECK(at(smooth, 10, 0, 0) == Approx(at(box, 10, 0, 0)).margin(1e-3));
    CHECK(at(smooth, 10, 10, 10) > at(box, 10, 10, 10) + 0.01f);
    CHECK(at(box, 10, 10, 10) == Approx(0).margin(1e-3)); // it was not changed
}

namespace {

/// A cube of quads with corners at 0 and 1, translated by an offset.
Mesh cubeMesh(const openvdb::Vec3s& offset) {
    Mesh mesh;
    for (int k = 0; k < 8; ++k)
        mesh.points.push_back(offset + openvdb::Vec3s(static_cast<float>(k & 1), static_cast<float>(k >> 1 & 1),
                                                      static_cast<float>(k >> 2 & 1)));
    mesh.quads = {{0, 1, 3, 2}, {4, 6, 7, 5}, {0, 4, 5, 1}, {2, 3, 7, 6}, {0, 2, 6, 4}, {1, 5, 7, 3}};
    return mesh;
}

/// A ball of triangles: points on circles of latitude, with two poles.
Mesh ballMesh(uint32_t rings) {
    Mesh mesh;
    const uint32_t around = 2 * rings;
    const auto at = [&](uint32_t ring, uint32_t k) { return (ring - 1) * around + k % around; };
    const auto point = [&](double polar, double turn) {
        mesh.points.emplace_back(std::sin(polar) * std::cos(turn), std::cos(polar), std::sin(polar) * std::sin(turn));
    };
    const double pi = std::acos(-1.0);
    for (uint32_t ring = 1; ring < rings; ++ring)
        for (uint32_t k = 0; k < around; ++k) point(pi * ring / rings, 2 * pi * k / around);
    point(0, 0), point(pi, 0);
    const auto top = static_cast<uint32_t>(mesh.points.size() - 2);
    for (uint32_t k = 0; k < around; ++k) {
        mesh.triangles.push_back({top, at(1, k), at(1, k + 1)});
        mesh.triangles.push_back({top + 1, at(rings - 1, k + 1), at(rings - 1, k)});
        for (uint32_t ring = 1; ring + 1 < rings; ++ring)
            mesh.quads.push_back({at(ring, k), at(ring + 1, k), at(ring + 1, k + 1), at(ring, k + 1)});
    }
    return mesh;
}

} // namespace

TEST_CASE("Surface: rays hit the faces of a mesh with flat normals", "[render]") {
    const openvdb::Vec3s offset(GENERATE(0.0F, 4096.0F), 0, 0); // where float still has its corners
    const Surface cube(cubeMesh(offset));
    const Vec3d low{{static_cast<double>(offset[0]), 0, 0}};
    for (int axis = 0; axis < 3; ++axis)
        for (uint64_t k = 0; k < 50; ++k) {
            Vec3d from = low + test::randomPoint(test::cube(0.49), 3, k) + Vec3d{{0.5, 0.5, 0.5}}, direction{};
            from[axis] = low[axis] + 7;
            direction[axis] = -1;
            std::vector<RayHit> hit(1);
            cube.intersect(std::vector<Ray>{{from, direction}}, kResolution, hit);
            REQUIRE(hit[0].distance == Approx(6).epsilon(1e-12));
            REQUIRE(hit[0].normal[axis] == Approx(1));
        }
    std::vector<RayHit> missed(1);
    cube.intersect(std::vector<Ray>{{low + Vec3d{{2, 2, 7}}, {{0, 0, -1}}}}, kResolution, missed);
    CHECK_FALSE(missed[0].found());
    CHECK_THROWS_AS(Surface(Mesh()), ValueError);
}

TEST_CASE("Surface: a triangulated ball converges with its facets and has smooth normals", "[render]") {
    const double coarse = errorOnBall(Surface(ballMesh(24)), 1, 0.02, 0.03);
    const double fine = errorOnBall(Surface(ballMesh(96)), 1, 0.02, 0.01);
    CHECK(fine < coarse / 4);
}

TEST_CASE("Surface: rays through shared edges and vertices do not leak", "[render]") {
    const Mesh mesh = ballMesh(24);
    const Surface ball(mesh);
    std::vector<Ray> rays;
    const Vec3d eye{{0.3, 0.4, 5}};
    for (const auto& p : mesh.points)
        if (p.z() > 0.5F) { // not where rays only touch the ball
            const Vec3d corner{{static_cast<double>(p.x()), static_cast<double>(p.y()), static_cast<double>(p.z())}};
            rays.push_back({eye, normalized(corner - eye)});
        }
    const auto hits = hitsOf(ball, rays);
    REQUIRE(hits.size() > 150);
    for (const RayHit& hit : hits) REQUIRE((hit.found() && hit.distance < 5));
}

TEST_CASE("Surface: a vertex with thousands of faces has smooth normals, or those of its faces if it is sharp",
          "[render]") {
    for (const double height : {0.2, 5.0}) {
        CAPTURE(height);
        constexpr int kFaces = 5000;
        Mesh cone;
        cone.points.emplace_back(0.0f, static_cast<float>(height), 0.0f);
        for (int k = 0; k < kFaces; ++k) {
            const double angle = 2 * M_PI * k / kFaces;
            cone.points.emplace_back(static_cast<float>(std::cos(angle)), 0.0f, static_cast<float>(std::sin(angle)));
            cone.triangles.emplace_back(0u, static_cast<unsigned>((k + 1) % kFaces) + 1, static_cast<unsigned>(k) + 1);
        }
        // Near the tip, in the middle of a face: its slope is the same all around.
        const double angle = 2 * M_PI * 100.5 / kFaces, r = 1e-3;
        const Vec3d outwards{{std::cos(angle), 0, std::sin(angle)}};
        const Vec3d face = normalized(outwards * height + Vec3d{{0, 1, 0}});
        const auto hits = hitsOf(Surface(cone), {{outwards * r + Vec3d{{0, 10, 0}}, {{0, -1, 0}}}});
        REQUIRE(hits[0].found());
        const Vec3d expected = height < 1 ? Vec3d{{0, 1, 0}} : face;
        CHECK(length(hits[0].normal - expected) < 0.01);
    }
}
