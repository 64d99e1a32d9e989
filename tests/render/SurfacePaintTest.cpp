// SPDX-License-Identifier: Apache-2.0
#include "curlew/base/Error.h"
#include "curlew/field/Algebra.h"
#include "curlew/flow/Flows.h"
#include "curlew/picture/ColorMap.h"
#include "curlew/render/SurfacePaint.h"
#include "curlew/render/SurfaceTexture.h"
#include "curlew/render/ThinFilm.h"
#include "support/Catch.h"

#include <algorithm>
#include <numbers>

using namespace curlew;

namespace {

const Sdf kBall = sphereSdf(1);

const SurfaceView& ball() {
    static const SurfaceView view = viewSurface(Surface(kBall), Camera({{0, 0, 4}}, {}, {{0, 1, 0}}, 35, 64, 48), 1);
    return view;
}

/// Turns about the y axis: f = y, g = the distance.
Flow turning() { return Flow(rampField(Vec3d{{0, 1, 0}}), kBall.distance); }

} // namespace

TEST_CASE("paintedColors: a plain surface has one colour for all hits", "[render]") {
    const PaintedColors painted = paintedColors(ball(), {.color = {{0.1f, 0.2f, 0.3f}}});
    CHECK(painted.colors == std::vector<Vec3f>{{{0.1f, 0.2f, 0.3f}}});
    CHECK_FALSE(painted.carried);
}

TEST_CASE("paintedColors: textures are evaluated at each hit", "[render]") {
    const auto positions = positionsOf(ball());
    const auto at = [&](Texture texture, size_t k) {
        return paintedColors(ball(), {.texture = texture, .edge = 0.3, .box = kBall.bounds}).colors.at(k);
    };
    const SurfacePaint usual;
    for (size_t k = 0; k < positions.size(); k += positions.size() / 5) {
        CHECK(at(Texture::checker, k) == checkerAt(positions[k], 0.3, usual.color, usual.second));
        CHECK(at(Texture::waves, k) == wavesAt(positions[k], 0.3));
        CHECK(at(Texture::latitude, k) == latitudeAt(positions[k], {}));
        CHECK(at(Texture::terrain, k) == terrainAt((positions[k][1] + 1) / 2));
    }
}

TEST_CASE("paintedColors: a film of zero thickness reflects nothing", "[render]") {
    const auto colors = paintedColors(ball(), {.texture = Texture::film, .film = {1, 1}, .box = kBall.bounds}).colors;
    for (size_t k = 0; k < colors.size(); ++k)
        if (ball().hits[k].normal[2] > 0.3f) // seen along itself, any film is a mirror
            for (const float part : colors[k].c) REQUIRE(part < 0.1f);
    const auto thick = paintedColors(ball(), {.texture = Texture::film, .box = kBall.bounds}).colors;
    CHECK(std::any_of(thick.begin(), thick.end(), [](const Vec3f& c) { return c[0] > 0.1f; }));
}

TEST_CASE("paintedColors: a source is mapped by the automatic scale", "[render]") {
    const auto source = fieldSource(rampField(Vec3d{{1, 0, 0}}), "value");
    const auto colors = paintedColors(ball(), {.source = source}).colors;
    REQUIRE(colors.size() == ball().hits.size());
    // Negative at the left, positive at the right.
    for (size_t k = 0; k < colors.size(); ++k) {
        const double x = ball().hits[k].position[0];
        if (std::abs(x) > 0.1) REQUIRE((x > 0) == (colors[k][0] > colors[k][2]));
    }
}

TEST_CASE("paintedColors: a texture carried by a rotating flow is rotated", "[render]") {
    SurfacePaint paint{.texture = Texture::waves, .edge = 0.3, .flow = turning(), .carry = {.time = 0, .steps = 40}};
    const auto still = paintedColors(ball(), paint);
    CHECK_FALSE(still.carried);
    CHECK(still.colors == paintedColors(ball(), {.texture = Texture::waves, .edge = 0.3}).colors);
    // The gradients of f and g are perpendicular where y = 0: a point there turns by one radian a second, as do others,
    // on smaller circles. There are twelve waves per turn, so a twelfth of a turn changes nothing.
    paint.carry.time = -std::numbers::pi / 6;
    const auto turned = paintedColors(ball(), paint);
    REQUIRE(turned.carried);
    CHECK(turned.carried->notConverged == 0);
    size_t same = 0;
    for (size_t k = 0; k < still.colors.size(); ++k) same += turned.colors[k] == still.colors[k];
    CHECK(static_cast<double>(same) > 0.98 * static_cast<double>(still.colors.size())); // but for the stripes' edges
    paint.carry.time = -std::numbers::pi / 12;
    size_t other = 0;
    const auto between = paintedColors(ball(), paint);
    for (size_t k = 0; k < still.colors.size(); ++k) other += between.colors[k] != still.colors[k];
    CHECK(other > still.colors.size() / 100);
}

TEST_CASE("paintedColors: streaks modulate the colour and require a flow", "[render]") {
    const SurfacePaint paint{.texture = Texture::lic, .color = {{0.5f, 0.5f, 0.5f}}, .seed = 3, .flow = turning()};
    const auto colors = paintedColors(ball(), paint).colors;
    const auto streaks = surfaceLic(ball(), turning(), {.seed = 3});
    REQUIRE(colors.size() == streaks.size());
    for (size_t k = 0; k < colors.size(); ++k) REQUIRE(colors[k][1] == Approx(0.5f * (0.3f + 0.9f * streaks[k])));
    CHECK_THROWS_AS(paintedColors(ball(), {.texture = Texture::lic}), ValueError);
    CHECK_THROWS_AS(paintedColors(ball(), {.carry = {.time = 1}}), ValueError);
}

TEST_CASE("paintedColors: a horizontal surface is in the middle of its box", "[render]") {
    const Box flat{{{-1, 0, -1}}, {{1, 0, 1}}};
    const auto of = [&](Texture texture, const Box& box) {
        return paintedColors(ball(), {.texture = texture, .box = box}).colors;
    };
    for (const Vec3f& color : of(Texture::terrain, flat)) REQUIRE(color == terrainAt(0.5));
    for (const Vec3f& color : of(Texture::film, flat))
        for (const float part : color.c) REQUIRE((part >= 0 && part <= 1.1f));
}
