// SPDX-License-Identifier: Apache-2.0
#include "curlew/base/Error.h"
#include "curlew/base/Parallel.h"
#include "curlew/field/Algebra.h"
#include "curlew/flow/Flows.h"
#include "curlew/render/SurfacePicture.h"
#include "support/Catch.h"

#include <algorithm>

using namespace curlew;

namespace {

const Sdf kTorus = torusSdf(0.8, 0.3);
const Camera kCamera({{0, 3, 4}}, {}, {{0, 1, 0}}, 35, 64, 47); // 47 rows are drawn in parts that differ in size

SurfacePicture torus(const SurfacePictureOptions& options) { return drawSurface(Surface(kTorus), kCamera, options); }

} // namespace

TEST_CASE("drawSurface: the same picture as of all hits at once", "[render]") {
    const Surface surface(kTorus);
    const SurfaceView view = viewSurface(surface, kCamera, 2);
    const SurfacePaint paint{.texture = Texture::checker, .edge = 0.3, .box = kTorus.bounds};
    const Image whole = shadeSurface(view, paintedColors(view, paint).colors, {}, &surface);
    const SurfacePicture picture = torus({.samples = 2, .paint = paint});
    CHECK(picture.image.pixels == whole.pixels);
    CHECK(picture.hits == view.hits.size());
    CHECK(picture.coverage == Approx(view.coverage()));
    CHECK_FALSE(picture.carried);
}

TEST_CASE("drawSurface: a mirror shows its far side, too", "[render]") {
    const Surface surface(kTorus);
    const SurfaceLook look{.finish = Finish::mirror};
    const SurfaceView near = viewSurface(surface, kCamera, 1), far = viewThrough(surface, near);
    const SurfacePaint paint{.color = {{0.2f, 0.3f, 0.4f}}};
    const Image behind = shadeSurface(far, {paint.color}, look);
    const SurfacePicture picture = torus({.samples = 1, .paint = paint, .look = look});
    CHECK(picture.image.pixels == shadeSurface(near, {paint.color}, look, nullptr, &behind).pixels);
    CHECK(picture.image.pixels != shadeSurface(near, {paint.color}, look).pixels);
}

TEST_CASE("drawSurface: does not depend on the number of threads", "[render]") {
    const Flow flow(rampField(Vec3d{{0, 1, 0}}), kTorus.distance);
    const auto withThreads = [&](int threads) {
        const ThreadLimit limit(threads);
        return torus({.samples = 1, .paint = {.texture = Texture::lic, .flow = flow, .carry = {.time = 0.1}}});
    };
    const SurfacePicture one = withThreads(1), four = withThreads(4);
    CHECK(one.image.pixels == four.image.pixels);
    CHECK(one.carried.value().meanIterations == four.carried.value().meanIterations);
}

TEST_CASE("drawSurface: sums up how a texture was carried", "[render]") {
    const Surface surface(kTorus);
    const SurfaceView view = viewSurface(surface, kCamera, 1);
    const SurfacePaint paint{.texture = Texture::waves,
                             .flow = Flow(rampField(Vec3d{{0, 1, 0}}), kTorus.distance),
                             .carry = {.time = -0.4, .steps = 10}};
    const AdvectResult all = paintedColors(view, paint).carried.value();
    const CarriedTexture carried = torus({.samples = 1, .paint = paint}).carried.value();
    CHECK(carried.substeps == all.substeps);
    CHECK(carried.notConverged == all.notConverged);
    CHECK(carried.retries == all.retries);
    CHECK(carried.meanIterations == Approx(all.meanIterations));
}

TEST_CASE("drawSurface: colours have one scale on a surface between the rays of the coarse grid, too", "[render]") {
    const Sdf small = sphereSdf(0.01);
    const Surface surface(small);
    const Camera camera({{0, 0, 4}}, {}, {{0, 1, 0}}, 35, 1024, 768);
    REQUIRE(visiblePoints(surface, camera).empty());
    const SurfacePaint paint{.source = fieldSource(rampField(Vec3d{{0, 1, 0}}), "value")};
    const SurfaceView view = viewSurface(surface, camera, 2);
    const Image whole = shadeSurface(view, paintedColors(view, paint).colors, {});
    const Image picture = drawSurface(surface, camera, {.samples = 2, .paint = paint, .shadows = false}).image;
    double squares = 0;
    for (size_t k = 0; k < whole.pixels.size(); ++k)
        if (k % 5 < 3) squares += std::pow(static_cast<double>(picture.pixels[k] - whole.pixels[k]), 2);
    CHECK(view.hits.size() > 60);
    CHECK(std::sqrt(squares / static_cast<double>(view.hits.size())) <
          0.1); // 0.26 if each four rows had their own scale
}

TEST_CASE("drawSurface: colours have one scale in all rows", "[render]") {
    const auto height = fieldSource(rampField(Vec3d{{0, 1, 0}}), "value");
    const Surface surface(kTorus);
    const SurfacePaint paint{.source = height};
    const SurfaceView view = viewSurface(surface, kCamera, 1);
    const Image whole = shadeSurface(view, paintedColors(view, paint).colors, {}, &surface);
    const Image picture = torus({.samples = 1, .paint = paint}).image;
    double worst = 0;
    for (size_t k = 0; k < whole.pixels.size(); ++k)
        if (k % 5 < 3) worst = std::max(worst, std::abs(static_cast<double>(picture.pixels[k] - whole.pixels[k])));
    CHECK(worst < 0.03); // the scale is that of fewer hits
    // A range that is given counts: in this one, all heights are nearly the same.
    SurfacePaint flat = paint;
    flat.range = paintRange({{{0, -100, 0}}, {{0, 100, 0}}}, view.resolution, paint);
    const std::vector<Vec3f> colors = paintedColors(view, flat).colors;
    REQUIRE(colors.size() == view.hits.size());
    for (const Vec3f& color : colors) REQUIRE(length(color - colors.front()) < 0.02F);
    CHECK_THROWS_AS(torus({.paint = {.texture = Texture::lic}}), ValueError);
    CHECK_THROWS_AS(torus({.samples = 17}), ValueError);
}
