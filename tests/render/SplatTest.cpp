// SPDX-License-Identifier: Apache-2.0
// Longer than 400 lines: luminous() and opaque() are tested side by side, with the same camera and helpers.
#include "curlew/base/Error.h"
#include "curlew/base/Parallel.h"
#include "curlew/base/Random.h"
#include "curlew/picture/Display.h"
#include "curlew/render/Splat.h"
#include "support/Catch.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

using namespace curlew;

namespace {

const Vec3d kUp{{0, 1, 0}};

/// Ten units away from the plane z = 0, where a pixel is a hundredth of a unit, x to the right and y upwards.
Camera faced(int width = 160, int height = 120) {
    const double fov = 2 * std::atan(0.5 * width * 0.01 / 10) * 180 / std::numbers::pi;
    return {{{0, 0, 10}}, {}, kUp, fov, width, height};
}

/// Positions that own their numbers.
struct Positions {
    std::vector<double> x, y, z;
    std::vector<size_t> start;

    void add(double px, double py, double pz = 0) { x.push_back(px), y.push_back(py), z.push_back(pz); }
    Splats points() const { return {.x = x, .y = y, .z = z}; }
    Splats lines() const { return {.x = x, .y = y, .z = z, .start = start}; }
};

double energyOf(const Image& image) {
    double sum = 0;
    for (const float value : image.pixels) sum += static_cast<double>(value);
    return sum / 3;
}

Positions randomWalks(size_t lines, size_t vertices) {
    Positions p;
    p.start.push_back(0);
    for (size_t k = 0; k < lines; ++k) {
        Vec3d at{{1.2 * randomUniform(1, k, 0) - 0.6, randomUniform(1, k, 1) - 0.5, randomUniform(1, k, 2) - 0.5}};
        for (size_t v = 0; v < vertices; ++v) {
            p.add(at[0], at[1], at[2]);
            for (int i = 0; i < 3; ++i)
                at[i] += 0.1 * (randomUniform(2, k * vertices + v, static_cast<uint64_t>(i)) - 0.5);
        }
        p.start.push_back(p.x.size());
    }
    return p;
}

constexpr SplatOptions kClear{.fade = 0};

} // namespace

TEST_CASE("luminous: a point has the energy of its kernel at any subpixel position", "[render]") {
    for (const double radius : {1.5, 2.5, 7.0})
        for (int k = 0; k < 25; ++k) {
            Positions p;
            p.add(0.01 * randomUniform(3, static_cast<uint64_t>(k), 0),
                  0.01 * randomUniform(3, static_cast<uint64_t>(k), 1));
            CAPTURE(radius, k);
            const auto seen = luminous(p.points(), faced(), {.pixels = radius, .fade = 0});
            // The integral of (1 - (d/r)²)² over a disc.
            CHECK(energyOf(seen.image) == Approx(std::numbers::pi * radius * radius / 3).epsilon(0.03));
            CHECK(seen.drawn == 1);
        }
}

TEST_CASE("luminous: features smaller than a pixel fade with their area", "[render]") {
    Positions p;
    p.add(0.003, 0.004);
    const double whole = energyOf(luminous(p.points(), faced(), {.radius = 0.02, .fade = 0}).image);
    const double tenth = energyOf(luminous(p.points(), faced(), {.radius = 0.002, .fade = 0}).image);
    CHECK(tenth / whole == Approx(0.01).epsilon(0.03));
    // And a line as its width.
    p.add(0.4, 0.3);
    p.start = {0, 2};
    const double line = energyOf(luminous(p.lines(), faced(), {.radius = 0.02, .fade = 0}).image);
    CHECK(energyOf(luminous(p.lines(), faced(), {.radius = 0.002, .fade = 0}).image) / line ==
          Approx(0.1).epsilon(0.03));
}

TEST_CASE("luminous and opaque: faded points give less light and smaller discs", "[render]") {
    Positions p;
    p.add(0.003, 0.004);
    Splats whole = p.points(), dim = whole, none = whole;
    const std::vector<float> halfSeen{0.5F}, unseen{0};
    dim.fade = halfSeen, none.fade = unseen;
    const SplatOptions options{.pixels = 5, .fade = 0};
    const double energy = energyOf(luminous(whole, faced(), options).image);
    CHECK(energyOf(luminous(dim, faced(), options).image) == Approx(0.5 * energy).epsilon(1e-6));
    CHECK(luminous(none, faced(), options).drawn == 0);
    CHECK(energyOf(luminous(none, faced(), options).image) == 0);
    const double covered = opaque(whole, faced(), options).covered;
    CHECK(opaque(dim, faced(), options).covered == Approx(covered / 4).epsilon(0.05)); // of the area
    CHECK(opaque(none, faced(), options).drawn == 0);
    p.add(1, 1);
    Splats wrong = p.points();
    wrong.fade = halfSeen;
    CHECK_THROWS_AS(luminous(wrong, faced(), options), ValueError);
}

TEST_CASE("luminous: the energy of a line depends on its length and not on direction or subdivision", "[render]") {
    for (int k = 0; k < 20; ++k) {
        const double angle = 0.05 + 0.3 * k, length = 0.7;
        const double dx = length * std::cos(angle), dy = length * std::sin(angle);
        Positions whole, parts;
        whole.add(-dx / 2, -dy / 2), whole.add(dx / 2, dy / 2);
        whole.start = {0, 2};
        for (int part = 0; part <= 37; ++part) parts.add(dx * (part / 37.0 - 0.5), dy * (part / 37.0 - 0.5));
        parts.start = {0, 38};
        CAPTURE(angle);
        const Image one = luminous(whole.lines(), faced(), kClear).image;
        // The line's profile is (1 - (h/r)²)^2.5, whose integral is 5 pi / 16 of the radius.
        CHECK(energyOf(one) == Approx(length * 100 * 1.5 * 5 * std::numbers::pi / 16).epsilon(0.02));
        const Image many = luminous(parts.lines(), faced(), kClear).image;
        for (size_t i = 0; i < one.pixels.size(); ++i)
            REQUIRE(std::abs(many.pixels[i] - one.pixels[i]) < 2e-4f); // no seams; float pixel positions
    }
}

TEST_CASE("luminous: a line is 1 in the middle and closed lines get their last edge", "[render]") {
    Positions p;
    p.add(-0.3, 0.005), p.add(0.3, 0.005), p.add(0.3, 0.205), p.add(-0.3, 0.205);
    p.start = {0, 4};
    Splats square = p.lines();
    const Image open = luminous(square, faced(), kClear).image;
    square.closed = {1};
    const Image closed = luminous(square, faced(), kClear).image;
    CHECK(open.at(80, 59) == Approx(1).epsilon(1e-4)); // the middle of that pixel is at y = 0.005
    CHECK(open.at(50, 49) < 1e-6f);
    CHECK(closed.at(50, 49) > 0.7f);
    CHECK(energyOf(closed) / energyOf(open) == Approx(1.6 / 1.4).epsilon(0.01));
}

TEST_CASE("luminous: light adds up and surfaces hide what is behind them", "[render]") {
    Positions p;
    p.add(0.105, 0.105), p.add(0.105, 0.105), p.add(0.105, 0.105, -1);
    std::vector<float> depth(size_t{160} * 120, 10.5f);
    const Image all = luminous(p.points(), faced(), kClear).image;
    const Image near = luminous(p.points(), faced(), kClear, depth).image;
    CHECK(near.at(90, 49) == Approx(2).epsilon(1e-4));
    CHECK(energyOf(all) / energyOf(near) == Approx(1.5).epsilon(0.02));
    const Image balls = opaque(p.points(), faced(), {.pixels = 4, .fade = 0}, depth).image;
    CHECK(balls.at(90, 49, 3) == 1);
    CHECK(balls.at(90, 49, 4) == Approx(10 - 0.04).epsilon(1e-3)); // the front of the ball
}

TEST_CASE("luminous and opaque: short edges look like edges that are drawn one by one", "[render]") {
    using Vertex = std::pair<Vec3d, float>; // with its value
    const auto check = [](const std::vector<Vertex>& vertices, bool closed) {
        Positions curve, edges;
        std::vector<float> values, twice;
        edges.start = {0};
        for (size_t k = 0; k < vertices.size(); ++k) {
            const auto& [a, value] = vertices[k];
            curve.add(a[0], a[1], a[2]);
            values.push_back(value);
            if (k + 1 == vertices.size() && !closed) break;
            const auto& [b, next] = vertices[(k + 1) % vertices.size()];
            edges.add(a[0], a[1], a[2]), edges.add(b[0], b[1], b[2]);
            edges.start.push_back(edges.x.size());
            twice.push_back(value), twice.push_back(next);
        }
        curve.start = {0, curve.x.size()};
        Splats joined = curve.lines(), single = edges.lines();
        joined.closed = {static_cast<uint8_t>(closed ? 1 : 0)};
        joined.values = values, single.values = twice;
        // The rms difference, relative to the rms, of all channels but depth.
        const auto difference = [](const Image& a, const Image& b, size_t channels) {
            double squares = 0, all = 0;
            for (size_t k = 0; k < a.pixels.size(); ++k) {
                if (k % channels == 4) continue;
                const auto x = static_cast<double>(a.pixels[k]), y = static_cast<double>(b.pixels[k]);
                squares += (x - y) * (x - y), all += y * y;
            }
            return std::sqrt(squares / all);
        };
        // The loop below differs by 0.03 as light and 0.05 as a tube, and by 0.13 and 0.12 if edges may be a third of a
        // pixel off; the line by 0.39 and 0.16 if values do not count.
        const auto light = luminous(joined, faced(), {}), one = luminous(single, faced(), {});
        CHECK(light.drawn == edges.start.size() - 1);
        CHECK(one.drawn == light.drawn);
        CHECK(energyOf(light.image) == Approx(energyOf(one.image)).epsilon(0.005));
        CHECK(difference(light.image, one.image, 3) < 0.05);
        const auto tube = opaque(joined, faced(), {.radius = 0.02}), tubes = opaque(single, faced(), {.radius = 0.02});
        CHECK(tube.covered == Approx(tubes.covered).epsilon(0.004));
        CHECK(difference(tube.image, tubes.image, 5) < 0.07);
    };
    // Much shorter than a pixel: a closed curve that winds in depth, too, and turns sharply.
    std::vector<Vertex> loop;
    for (int k = 0; k < 1301; ++k) {
        const double t = 2 * std::numbers::pi * k / 1301, r = 0.4 + 0.05 * std::abs(std::sin(13 * t));
        loop.push_back({Vec3d{{r * std::cos(t), r * std::sin(t), 0.3 * std::sin(4 * t)}},
                        0.5F + 0.4F * static_cast<float>(std::sin(3 * t))});
    }
    check(loop, true);
    // Half a pixel: a straight line on which only the values change, with a period of 10 pixels.
    std::vector<Vertex> line;
    for (int k = 0; k < 301; ++k)
        line.push_back({Vec3d{{0.005 * k - 0.75, 0.1, 0}}, 0.5F + 0.5F * std::sin(0.3F * static_cast<float>(k))});
    check(line, false);
}

TEST_CASE("luminous: colour and depth change along a long edge", "[render]") {
    Positions p; // from (10, 59.5) to (150, 59.5) in pixels, of depth 12 to 8; in space, the middle is at x = 66
    p.add(-0.7 * 1.2, 0.005 * 1.2, -2), p.add(0.7 * 0.8, 0.005 * 0.8, 2);
    p.start = {0, 2};
    Splats edge = p.lines();
    const std::vector<float> depth(size_t{160} * 120, 10.0f);
    const Image whole = luminous(edge, faced(), kClear).image, near = luminous(edge, faced(), kClear, depth).image;
    for (int x = 12; x < 148; ++x) {
        CHECK(whole.at(x, 59) == Approx(1).epsilon(1e-4));
        CHECK(near.at(x, 59) == Approx(x < 66 ? 0 : 1).margin(1e-4));
    }
    edge.values = {0, 1};
    edge.scale = {.map = ColorMap::gray, .lower = 0.25f, .upper = 0.75f};
    const Image shaded = luminous(edge, faced(), kClear).image;
    for (int x = 12; x < 148; ++x) {
        const double part = (x + 0.5 - 10) / 140, along = part * 12 / (8 + 4 * part); // in the picture, and in space
        const Vec3f color = colorAt(ColorMap::gray, static_cast<float>(std::clamp(2 * along - 0.5, 0.0, 1.0)));
        CHECK(shaded.at(x, 59) == Approx(linearFromDisplay(static_cast<double>(color[0]))).margin(0.03));
    }
    // An edge that ends beside the eye, 10^11 pixels from the picture, is as bright as the part of it that is seen.
    Positions endless, seen;
    endless.add(0, 0.005), endless.add(1, 0.005, 10 - 1e-8);
    seen.add(0, 0.005), seen.add(0.1, 0.005, 1);
    endless.start = seen.start = {0, 2};
    const Image ray = luminous(endless.lines(), faced(), kClear).image;
    const Image line = luminous(seen.lines(), faced(), kClear).image;
    for (int x = 82; x < 90; ++x) CHECK(ray.at(x, 59) == Approx(line.at(x, 59)).epsilon(0.01));
}

TEST_CASE("luminous and opaque: a long edge is as wide at each place as its depth there demands", "[render]") {
    constexpr double kRadius = 0.1; // ten pixels at the depth of 10
    Positions whole, parts;         // from pixel 30 at a depth of 20 to pixel 140 at a depth of 5, both in row 59
    constexpr int kParts = 300;
    for (int k = 0; k <= kParts; ++k) {
        const double t = k / double{kParts}, x = -1 * (1 - t) + 0.3 * t, y = 0.01 * (1 - t) + 0.0025 * t;
        parts.add(x, y, -10 + 15 * t);
        if (k == 0 || k == kParts) whole.add(x, y, -10 + 15 * t);
    }
    whole.start = {0, 2}, parts.start = {0, kParts + 1};
    const SplatOptions options{.radius = kRadius, .fade = 0};
    const auto sumOver = [](const Image& image, int x, int channel) {
        double sum = 0;
        for (int y = 0; y < image.height; ++y) sum += static_cast<double>(image.at(x, y, channel));
        return sum;
    };
    const Image light = luminous(whole.lines(), faced(), options).image;
    const Image pieces = luminous(parts.lines(), faced(), options).image;
    const Image tube = opaque(whole.lines(), faced(), options).image;
    const Image tubes = opaque(parts.lines(), faced(), options).image;
    for (int x = 50; x < 100; ++x) {
        CAPTURE(x);
        const double part = (x + 0.5 - 30) / 110, radius = 5 + 15 * part, widens = 15.0 / 110;
        // The integral of the light across a line of radius 1 is 5 π / 16. The light of a part has one radius, which is
        // too large or too small by up to half of the ratio of the next one's.
        CHECK(sumOver(light, x, 0) == Approx(radius * 5 * std::numbers::pi / 16).epsilon(0.05));
        CHECK(sumOver(light, x, 0) == Approx(sumOver(pieces, x, 0)).epsilon(0.05));
        CHECK(sumOver(tube, x, 3) == Approx(2 * radius / std::sqrt(1 - widens * widens)).margin(0.5));
        CHECK(sumOver(tube, x, 3) == Approx(sumOver(tubes, x, 3)).margin(0.5));
        CHECK(tube.at(x, 59, 0) == Approx(tubes.at(x, 59, 0)).margin(0.03));
        CHECK(tube.at(x, 59, 4) == Approx(tubes.at(x, 59, 4)).epsilon(0.01));
    }
}

TEST_CASE("luminous: an edge narrower than a pixel gets fainter with its depth at each place", "[render]") {
    Positions whole, parts; // from a depth of 30 to 1
    constexpr int kParts = 400;
    for (int k = 0; k <= kParts; ++k) {
        const double t = k / double{kParts};
        parts.add(0.4 - 0.36 * t, 0.005, -20 + 29 * t);
        if (k == 0 || k == kParts) whole.add(0.4 - 0.36 * t, 0.005, -20 + 29 * t);
    }
    whole.start = {0, 2}, parts.start = {0, kParts + 1};
    const SplatOptions options{.radius = 0.002, .fade = 0};
    const double energy = energyOf(luminous(whole.lines(), faced(), options).image);
    CHECK(energy == Approx(energyOf(luminous(parts.lines(), faced(), options).image)).epsilon(0.02));
}

TEST_CASE("luminous and opaque: of an edge that reaches behind the camera, the part in front is drawn", "[render]") {
    // The camera is at z = 10. The second and the last corner are not in front of it, so each edge ends there.
    Positions whole, cut;
    const std::array<Vec3d, 4> corners{{{{0.5, 0.3, 0}}, {{-0.2, -0.4, 12}}, {{-0.6, 0.2, -20}}, {{0.3, 0.1, 10}}}};
    for (const Vec3d& p : corners) whole.add(p[0], p[1], p[2]);
    whole.start = {0, 4}, cut.start = {0};
    const auto addCut = [&](const Vec3d& front, const Vec3d& behind) {
        constexpr double kBefore = 1e-3; // of the camera
        const Vec3d end = front + (behind - front) * ((10 - kBefore - front[2]) / (behind[2] - front[2]));
        cut.add(front[0], front[1], front[2]), cut.add(end[0], end[1], end[2]);
        cut.start.push_back(cut.x.size());
    };
    addCut(corners[0], corners[1]), addCut(corners[2], corners[1]), addCut(corners[2], corners[3]);
    const SplatOptions options{.radius = 0.02, .fade = 0};
    for (const bool light : {true, false}) {
        const SplatImage one =
            light ? luminous(whole.lines(), faced(), options) : opaque(whole.lines(), faced(), options);
        const SplatImage three =
            light ? luminous(cut.lines(), faced(), options) : opaque(cut.lines(), faced(), options);
        CHECK(one.drawn == 3);
        CHECK(one.covered > 0.02);
        CHECK(one.covered == Approx(three.covered).epsilon(0.01));
    }
}

TEST_CASE("opaque: an edge looks the same from either end, also if it is seen end-on or begins beside the eye",
          "[render]") {
    const auto [from, to] = GENERATE(table<Vec3d, Vec3d>({{{{0, 0, 4.5}}, {{0, 0, 5}}},
                                                          {{{0, 0, -5}}, {{0, 0, 5}}},
                                                          {{{0.3, 0.2, -5}}, {{0.1, 0.1, 5}}},
                                                          {{{0.3, 0, 0}}, {{1e-7, 0, 10 - 1e-6}}}}));
    const auto cover = [](const Vec3d& a, const Vec3d& b) {
        Positions p;
        p.add(a[0], a[1], a[2]), p.add(b[0], b[1], b[2]);
        p.start = {0, 2};
        const Image image = opaque(p.lines(), faced(), {.radius = 0.1, .fade = 0}).image;
        double sum = 0;
        for (size_t k = 3; k < image.pixels.size(); k += 5) sum += static_cast<double>(image.pixels[k]);
        return sum;
    };
    CHECK(cover(from, to) > 100);
    CHECK(cover(to, from) == Approx(cover(from, to)).epsilon(1e-3)); // samples at the outline, by rounding
}

TEST_CASE("luminous: an edge that recedes along a side of tiles is drawn once in each", "[render]") {
    // Its near end is wider than its middle, and so may be in tiles that the edge itself does not reach.
    for (const double end : {0.0, 0.3, 1.0})
        for (const bool upright : {false, true}) {
            Positions p;
            upright ? p.add(0, -0.04, 9) : p.add(-0.04, 0, 9);
            upright ? p.add(0, end, 8) : p.add(end, 0, 8);
            p.start = {0, 2};
            const Image image = luminous(p.lines(), faced(240, 240), {.radius = 0.028, .fade = 0}).image;
            CAPTURE(end, upright);
            CHECK(energyOf(image) > 1);
            const auto [least, most] = std::minmax_element(image.pixels.begin(), image.pixels.end());
            CHECK(*least >= 0);
            CHECK(*most < 1.05F); // 1 on a line of even width; 2 if it is drawn twice
        }
}

TEST_CASE("luminous: a short edge across the end of the scale has the colour of its values", "[render]") {
    Positions p; // from pixel 77 to 83
    p.add(-0.03, 0.005), p.add(0.03, 0.005);
    p.start = {0, 2};
    Splats edge = p.lines();
    edge.values = {0.8F, 1.2F};
    edge.scale = {.map = ColorMap::gray, .lower = 0, .upper = 1};
    const Image image = luminous(edge, faced(), kClear).image;
    edge.values = {1, 1};
    const Image white = luminous(edge, faced(), kClear).image;
    CHECK(image.at(80, 59) / white.at(80, 59) == Approx(1).margin(0.03)); // on a straight line: 0.8
}

TEST_CASE("opaque: a tube that recedes has its depth, and no seams between its edges", "[render]") {
    constexpr double kRadius = 0.1; // ten pixels
    Positions whole, parts;
    constexpr int kParts = 8;
    for (int k = 0; k <= kParts; ++k) {
        const double at = k / double{kParts} - 0.5;
        parts.add(at, 0.005, at);
        if (k == 0 || k == kParts) whole.add(at, 0.005, at);
    }
    whole.start = {0, 2}, parts.start = {0, kParts + 1};
    const SplatOptions options{.pixels = 100 * kRadius, .fade = 0};
    // The margins: a pixel is 0.01 wide, Z is the nearest of its samples, and the perspective changes depths by 5 %.
    const Image one = opaque(whole.lines(), faced(), options).image;
    const Image many = opaque(parts.lines(), faced(), options).image;
    for (int y = 50; y < 70; ++y)
        for (int x = 50; x < 110; ++x) {
            CAPTURE(x, y);
            CHECK(many.at(x, y, 0) == Approx(one.at(x, y, 0)).margin(0.02));
        }
    // The axis at x = t has the depth 10 - t. What is visible of a tube at 45 degrees is nearer by √2 times its radius.
    for (int x = 60; x < 100; ++x) {
        const double axis = 10 - (x + 0.5 - 80) * 0.01;
        CHECK(one.at(x, 59, 4) == Approx(axis - std::numbers::sqrt2 * kRadius).margin(0.02));
    }
}

TEST_CASE("opaque: discs have the correct area and nearer ones hide farther ones", "[render]") {
    Positions p;
    p.add(0, 0, 0), p.add(0.1, 0, 1), p.add(-5, 0, 0), p.add(0, 0, 11);
    Splats splats = p.points();
    splats.values = {0, 1, 0, 0};
    splats.scale = {.map = ColorMap::gray, .lower = 0, .upper = 1};
    const auto seen = opaque(splats, faced(), {.radius = 0.2, .fade = 0});
    CHECK(seen.drawn == 2); // one is beside the picture, one behind the camera
    CHECK(seen.image.at(80, 60, 0) > 0.3f);
    CHECK(seen.image.at(80, 60, 4) < 9);
    CHECK(seen.image.at(61, 60, 0) == 0); // the black one
    CHECK(seen.image.at(61, 60, 3) == 1);
    CHECK(std::isinf(seen.image.at(2, 2, 4)));
    CHECK(seen.image.at(2, 2, 3) == 0);
    Positions alone;
    alone.add(0.0012, 0.0034);
    const auto disc = opaque(alone.points(), faced(), {.radius = 0.3, .fade = 0});
    CHECK(disc.covered * 160 * 120 == Approx(std::numbers::pi * 900).epsilon(0.003));
}

TEST_CASE("luminous: distant points are dimmer by fade", "[render]") {
    Positions p;
    p.add(-0.205, 0.005, 1), p.add(0.205 * 1.1, 0.005 * 1.1, -1);
    const Image light = luminous(p.points(), faced(), {.fade = 0.75}).image;
    const auto peak = [&](int from, int to) {
        float most = 0;
        for (int x = from; x < to; ++x)
            for (int y = 0; y < 120; ++y) most = std::max(most, light.at(x, y));
        return most;
    };
    CHECK(peak(80, 160) / peak(0, 80) == Approx(0.25).margin(0.03));
}

TEST_CASE("luminous and opaque: do not depend on the number of threads", "[render]") {
    const Positions walks = randomWalks(300, 40);
    const auto draw = [&](int threads) {
        const ThreadLimit limit(threads);
        return std::pair(luminous(walks.lines(), faced(333, 222), {}).image.pixels,
                         opaque(walks.points(), faced(333, 222), {.radius = 0.03}).image.pixels);
    };
    const auto one = draw(1), four = draw(4);
    CHECK(one.first == four.first);
    CHECK(one.second == four.second);
}

TEST_CASE("luminous and opaque: invalid input is refused and non-finite points are skipped", "[render]") {
    Positions p;
    p.add(0, 0);
    Splats splats = p.points();
    CHECK_THROWS_AS(luminous(splats, faced(), {.pixels = 0}), ValueError);
    CHECK_THROWS_AS(luminous(splats, faced(), {.radius = -1}), ValueError);
    CHECK_THROWS_AS(luminous(splats, faced(), {.fade = 2}), ValueError);
    CHECK_THROWS_AS(luminous(splats, faced(), {}, std::vector<float>(3)), ValueError);
    splats.values = {1, 2};
    CHECK_THROWS_AS(opaque(splats, faced(), {}), ValueError);
    splats.values = {1};
    splats.scale = {.lower = 1, .upper = 1};
    CHECK_THROWS_AS(opaque(splats, faced(), {}), ValueError);
    CHECK(luminous({}, faced(), {}).covered == 0);
    CHECK_THROWS_AS(Splats{}.bounds(), ValueError);
    Positions strange;
    constexpr double nan = std::numeric_limits<double>::quiet_NaN(), far = std::numeric_limits<double>::infinity();
    strange.add(nan, 0), strange.add(0, far), strange.add(0.1, 0.1), strange.add(0, 0, 10);
    const auto seen = luminous(strange.points(), faced(), kClear);
    CHECK(seen.drawn == 1);
    CHECK(std::isfinite(energyOf(seen.image)));
    CHECK(strange.points().bounds().upper[0] == 0.1);
}

TEST_CASE("framing: fits all splats except outliers", "[render]") {
    const auto fill = [](double stray) {
        Positions p;
        for (uint64_t k = 0; k < 3000; ++k)
            p.add(randomUniform(3, k, 0), randomUniform(3, k, 1), randomUniform(3, k, 2));
        p.add(stray, 0.5, 0.5);
        p.add(std::numeric_limits<double>::quiet_NaN(), 0, 0);
        return p;
    };
    const Positions near = fill(0.5), far = fill(1000);
    const Camera camera = framing(near.points(), {}), same = framing(far.points(), {});
    CHECK(length(camera.eye() - same.eye()) < 1e-9);
    size_t seen = 0;
    for (size_t k = 0; k < 3000; ++k) {
        const auto at = camera.project({{near.x[k], near.y[k], near.z[k]}});
        seen += at.depth > 0 && at.x >= 0 && at.x <= camera.width() && at.y >= 0 && at.y <= camera.height();
    }
    CHECK(seen == 3000);

    Positions one;
    one.add(1, 2, 3);
    CHECK(framing(one.points(), {}).project({{1, 2, 3}}).x == Approx(480)); // around its padded box
    CHECK_THROWS_AS(framing(Positions().points(), {}), ValueError);
    // Several in one place are framed like one, and of few none is an outlier.
    Positions together, few;
    for (int k = 0; k < 3; ++k) together.add(1, 2, 3);
    CHECK(framing(together.points(), {}).project({{1, 2, 3}}).x == Approx(480));
    for (const double x : {0.0, 0.0, 0.0, 50.0}) few.add(x, 0, 0);
    const auto at = framing(few.points(), {}).project({{50, 0, 0}});
    CHECK((at.x > 0 && at.x < 960));
}
