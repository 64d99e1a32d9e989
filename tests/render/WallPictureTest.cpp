// SPDX-License-Identifier: Apache-2.0
#include "curlew/base/Error.h"
#include "curlew/render/WallPicture.h"
#include "support/Catch.h"
#include "support/Points.h"

using namespace curlew;

TEST_CASE("wallSurface: triangles lie near the wall at any size and position", "[render]") {
    const double size = GENERATE(1e-3, 1.0, 180.0), away = GENERATE(0.0, 1e5);
    const Vec3d center{{away, -away, 0}};
    const Sdf sdf = placed(sphereSdf(size), {.offset = center});
    const Surface surface = wallSurface(Domain::of({.sdf = sdf, .side = Side::outside, .width = 0.1 * size}));
    std::vector<Ray> rays;
    for (uint64_t k = 0; k < 200; ++k) {
        const Vec3d p = test::randomPoint(test::cube(1), 1, k);
        rays.push_back({center + p * (5 * size / length(p)), p * (-1 / length(p))});
    }
    std::vector<RayHit> hits(rays.size());
    surface.intersect(rays, 1e-3 * size, hits);
    for (const RayHit& hit : hits) REQUIRE(hit.distance == Approx(4 * size).epsilon(1e-4));
    CHECK_THROWS_AS(wallSurface({.box = test::cube(1), .wall = {}}), ValueError);
}

TEST_CASE("obstaclePicture: shows the obstacle with depth on a plain background", "[render]") {
    const Domain domain = Domain::of({.sdf = sphereSdf(1), .side = Side::outside, .width = 0.1});
    const Camera camera({{0, 0, 5}}, {{0, 0, 0}}, {{0, 1, 0}}, 40, 64, 48);
    const Image picture = obstaclePicture(domain, camera, {{0.25f, 0.5f, 0.75f}});
    REQUIRE(picture.channels == std::vector<std::string>{"R", "G", "B", "A", "Z"});
    CHECK(picture.at(32, 24, 4) == Approx(4).epsilon(1e-3));
    CHECK(picture.at(32, 24, 3) == 1);
    CHECK(picture.at(0, 0, 3) == 0);
    CHECK(picture.at(0, 0, 0) == Approx(0.25f));
    CHECK(picture.at(0, 0, 2) == Approx(0.75f));
    CHECK_FALSE(std::isfinite(picture.at(0, 0, 4)));
}
