// SPDX-License-Identifier: Apache-2.0
// Longer than 400 lines: the same properties for each type of noise, option by option.
#include "curlew/base/Error.h"
#include "curlew/field/Algebra.h"
#include "curlew/field/NoiseField.h"
#include "curlew/field/Transforms.h"
#include "support/FiniteDifference.h"
#include "support/Formula.h"
#include "support/Samples.h"

#include <limits>
#include <numbers>
#include <tuple>

using namespace curlew;
using namespace curlew::test;

TEST_CASE("noiseField: the default field equals psrdnoise", "[field]") {
    const PsrdOptions options{.period = {{0, 5, 0}}, .alpha = 0.7, .seed = 3};
    const ScalarField field = noiseField<Psrd3>(options);
    const Psrd3 noise(options);
    for (const Vec3d& p : randomPoints(cube(10), 300, 1)) {
        CAPTURE(p);
        REQUIRE(difference(field.at<2>(p), noise.at<2, double>(p)) == 0);
        REQUIRE(difference(field.at<1, float>(p), noise.at<1, float>(p)) == 0);
    }
    CHECK(field.range().maxAbs() == Psrd3::kBound);
}

TEST_CASE("noiseField: octaves sum scaled copies of the noise", "[field]") {
    const bool normalize = GENERATE(true, false);
    const double gain = GENERATE(0.5, -0.7, 1.0, 0.0);
    CAPTURE(normalize, gain);
    const OctaveOptions o{
        .frequency = 1.7, .octaves = 4, .lacunarity = 2.1, .gain = gain, .amplitude = 3, .normalize = normalize};
    const ScalarField field = noiseField<Psrd3>({.alpha = 0.2, .seed = 5}, o);
    std::vector<Psrd3> noises; // octave k is rotated by 2^k alpha
    for (int k = 0; k < o.octaves; ++k) noises.emplace_back(PsrdOptions{.alpha = 0.2 * (1 << k), .seed = 5});
    double total = 0, amplitude = 1;
    for (int k = 0; k < o.octaves; ++k, amplitude *= gain) total += std::abs(amplitude);
    for (const Vec3d& p : randomPoints(cube(3), 200, 2)) {
        Jet<double, 3, 2> sum;
        double a = o.amplitude / (normalize ? total : 1), frequency = o.frequency;
        for (int k = 0; k < o.octaves; ++k, a *= gain, frequency *= o.lacunarity) {
            const auto n = noises[static_cast<size_t>(k)].at<2, double>(p * frequency);
            sum.value += a * n.value;
            sum.gradient += n.gradient * (a * frequency);
            for (size_t h = 0; h < 6; ++h) sum.hessian.c[h] += a * frequency * frequency * n.hessian.c[h];
        }
        const auto jet = field.at<2>(p);
        CAPTURE(p);
        // The field multiplies frequencies; this test uses powers. This differs by a rounding of positions below 50,
        // times the derivatives of the highest octave: amplitude 3, frequency below 16, psrd derivatives below 6, 45
        // and 600.
        const double rounding = 50 * 4 * 0x1p-53 * 3 * 4;
        REQUIRE(difference(jet, sum, 0, 1) < rounding * 6);
        REQUIRE(difference(jet, sum, 1, 4) < rounding * 45 * 16);
        REQUIRE(difference(jet, sum, 4, 10) < rounding * 600 * 16 * 16);
    }
    CHECK(field.range().maxAbs() == Approx(Psrd3::kBound * 3 * (normalize ? 1 : total)));
}

TEST_CASE("noiseField: each octave rotates octaveAlpha times as far as the previous one", "[field]") {
    const double ratio = GENERATE(2.0, 1.0, 3.0, -1.5, 0.0);
    CAPTURE(ratio);
    const double alpha = 0.4;
    const auto octaves = [&](int count) {
        return noiseField<Psrd2>({.alpha = alpha},
                                 {.octaves = count, .lacunarity = 2.5, .normalize = false, .octaveAlpha = ratio});
    };
    for (int k = 0; k < 3; ++k) {
        const Psrd2 noise({.alpha = alpha * std::pow(ratio, k)});
        for (const auto& p : randomPoints(cube<2>(3), 50, 6)) {
            const double added = octaves(k + 1).at<0>(p).value - (k > 0 ? octaves(k).at<0>(p).value : 0);
            // Tolerance: roundings of sums of values below 2.
            CHECK(std::abs(added - std::pow(0.5, k) * noise.at<0, double>(p * std::pow(2.5, k)).value) < 1e-14);
        }
    }
}

TEST_CASE("noiseField: a full rotation of the first octave closes the loop if octaveAlpha is an integer", "[field]") {
    const double full = 2 * std::numbers::pi;
    const auto turned = [&](double alpha, double ratio) {
        return noiseField<Psrd3>({.alpha = alpha}, {.octaves = 5, .lacunarity = 1.9, .octaveAlpha = ratio});
    };
    double open = 0;
    for (const Vec3d& p : randomPoints(cube(3), 100, 7)) {
        for (const double ratio : {2.0, 3.0, -2.0}) {
            CAPTURE(p, ratio);
            // 2 pi has an error of 2.4e-16, which is 81 times as large in the last octave, whose gradients have length
            // 5.
            REQUIRE(std::abs(turned(full, ratio).at<0>(p).value - turned(0, ratio).at<0>(p).value) < 1e-12);
        }
        open = std::max(open, std::abs(turned(full, 1.5).at<0>(p).value - turned(0, 1.5).at<0>(p).value));
    }
    CHECK(open > 0.1);
}

TEST_CASE("noiseField: derivatives agree with central differences and values stay in range", "[field]") {
    const ScalarField field = noiseField<Psrd3>({.seed = 9}, {.frequency = 0.8, .octaves = 3, .gain = 0.6});
    // Third derivatives of psrd (below 600) times frequency³, weighted by the amplitudes: 600 · 0.8³ · (1 + 0.6 · 8 +
    // 0.36 · 64) / 1.96.
    requireDerivatives(field, randomPoints(cube(10), 1000, 3), 0x1p-10, 600 * 0.512 * (1 + 4.8 + 23.04) / 1.96);
    Worst worst;
    for (const Vec3d& p : randomPoints(cube(100), samples(100000), 4)) worst.see(std::abs(field.at<0>(p).value), p);
    CHECK(worst.value <= field.range().maxAbs());
}

TEST_CASE("noiseField: all octaves tile together", "[field]") {
    const double lacunarity = GENERATE(2.0, 3.0);
    const ScalarField field = noiseField<Psrd3>({.period = {{4, 6, 3}}, .alpha = 0.5, .seed = 7},
                                                {.frequency = 2, .octaves = 4, .lacunarity = lacunarity});
    for (uint64_t k = 0; k < 500; ++k) {
        const Vec3d p = dyadic(randomPoint(cube(5), 5, k));
        CAPTURE(p, lacunarity);
        // In world units, the period is that of the lattice divided by the frequency.
        for (const Vec3d& shift : {Vec3d{{2, 0, 0}}, Vec3d{{0, 3, 0}}, Vec3d{{0, 0, 1.5}}, Vec3d{{-4, 6, -1.5}}})
            REQUIRE(difference(field.at<2>(p), field.at<2>(p + shift)) == 0);
    }
}

TEST_CASE("noiseField: invalid octave options are errors that name the value", "[field]") {
    const auto make = [](const OctaveOptions& o, const PsrdOptions& n = {}) { return noiseField<Psrd3>(n, o); };
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    for (const double bad : {0.0, -1.0, kInfinity, std::nan("")}) {
        CAPTURE(bad);
        CHECK_THROWS_AS(make({.frequency = bad}), ValueError);
        CHECK_THROWS_AS(make({.octaves = 2, .lacunarity = bad}), ValueError);
    }
    for (const double bad : {kInfinity, std::nan("")}) {
        CHECK_THROWS_AS(make({.gain = bad}), ValueError);
        CHECK_THROWS_AS(make({.amplitude = bad}), ValueError);
        CHECK_THROWS_AS(make({.octaves = 2, .octaveAlpha = bad}), ValueError);
    }
    CHECK_THROWS_AS(make({.octaves = 0}), ValueError);
    CHECK_THROWS_WITH(make({.octaves = 33}), Catch::ContainsSubstring("33"));
    CHECK_THROWS_WITH(make({.octaves = 2, .lacunarity = 2.5}, {.period = {{4, 4, 4}}}),
                      Catch::ContainsSubstring("2.5"));
    CHECK_NOTHROW(make({.octaves = 1, .lacunarity = 2.5}, {.period = {{4, 4, 4}}}));
    CHECK_THROWS_AS(make({.octaves = 32}, {.period = {{4, 4, 4}}}), ValueError); // the last period would be 2^33
    CHECK_NOTHROW(make({.octaves = 32}));
}

namespace {

template <class Noise>
constexpr int kN = Noise::kDimension;

using AllNoises = std::tuple<Psrd2, Psrd3, ValueNoise<1>, ValueNoise<2>, ValueNoise<3>, PerlinNoise<1>, PerlinNoise<2>,
                             PerlinNoise<3>, GradientNoise<2>, GradientNoise<3>, SimplexNoise<2>, SimplexNoise<3>,
                             SimplexNoise<4>, SimplexNoise<5>, SimplexNoise<6>, SimplexNoise<7>, SineNoise<1>,
                             SineNoise<2>, SineNoise<3>, SineNoise<4>, SineNoise<5>, SineNoise<6>, SineNoise<7>>;

template <class Noise>
Interval rangeOf(const Noise& noise) {
    if constexpr (requires { noise.range(); })
        return noise.range();
    else
        return Interval::within(noise.maxAbs());
}

/// |n|, rounded at zero.
template <class J>
J rounded(const J& n, double fold) {
    return sqrt(n * n + J(fold * fold)) - J(fold);
}

/// Octaves with billow (turbulence) and gradient advection as published: each position is moved by the sum of the
/// previous octaves' gradients, in units of the lattice.
template <class Noise>
double advectedValue(const typename Noise::Options& noise, const OctaveOptions& o, const Vec<double, kN<Noise>>& p) {
    double sum = 0, total = 0, weight = 1, frequency = o.frequency;
    Vec<double, kN<Noise>> gradients;
    for (int k = 0; k < o.octaves; ++k, weight *= o.gain, frequency *= o.lacunarity) {
        auto octave = noise;
        if constexpr (requires { octave.period; })
            for (int& period : octave.period.c) period = static_cast<int>(period * std::pow(o.lacunarity, k));
        const auto n = Noise(octave).template at<1, double>(p * frequency + gradients * o.warp);
        sum += weight * (o.billow > 0 ? std::sqrt(n.value * n.value + o.billow * o.billow) - o.billow : n.value);
        total += std::abs(weight);
        gradients += n.gradient * weight;
    }
    return sum * o.amplitude / (o.normalize ? total : 1);
}

template <class Noise>
typename Noise::Options seeded(uint64_t seed) {
    typename Noise::Options options;
    options.seed = seed;
    return options;
}

} // namespace

TEMPLATE_LIST_TEST_CASE("noiseField: default options give the noise itself bit for bit", "[field]", AllNoises) {
    constexpr int N = kN<TestType>;
    const uint64_t seed = GENERATE(0, 3);
    const auto field = noiseField<TestType>(seeded<TestType>(seed));
    const TestType noise(seeded<TestType>(seed));
    WorstN<N> worst;
    for (const auto& p : randomPoints(cube<N>(20), 200, 10)) {
        worst.see(difference(field.template at<0>(p), noise.template at<0, double>(p)), p);
        worst.see(difference(field.template at<2>(p), noise.template at<2, double>(p)), p);
        worst.see(difference(field.template at<3>(p), noise.template at<3, double>(p)), p);
        worst.see(difference(field.template at<1, float>(p), noise.template at<1, float>(p)), p);
    }
    CAPTURE(worst.where);
    CHECK(worst.value == 0);
    CHECK(field.range() == rangeOf(noise));
}

TEMPLATE_TEST_CASE("noiseField: the range holds and is that of the summed octaves", "[field]", Psrd2, Psrd3,
                   ValueNoise<1>, ValueNoise<2>, ValueNoise<3>, PerlinNoise<1>, PerlinNoise<2>, PerlinNoise<3>,
                   GradientNoise<2>, GradientNoise<3>, SimplexNoise<2>, SimplexNoise<4>, SimplexNoise<7>, SineNoise<1>,
                   SineNoise<5>) {
    constexpr int N = kN<TestType>;
    const auto o = GENERATE(
        OctaveOptions{.amplitude = -2}, OctaveOptions{.octaves = 3, .gain = -0.5},
        OctaveOptions{.octaves = 3, .gain = 0.7, .normalize = false}, OctaveOptions{.octaves = 2, .amplitude = 0},
        OctaveOptions{.octaves = 2, .billow = 0.2}, OctaveOptions{.octaves = 2, .amplitude = -3, .billow = 1e-3},
        OctaveOptions{.octaves = 3, .gain = -0.7, .billow = 0.1}, OctaveOptions{.octaves = 3, .warp = 0.1});
    const auto field = noiseField<TestType>({}, o);
    const Interval one = rangeOf(TestType());
    // Billow is between zero and the folded bound.
    const Interval octave = o.billow > 0 ? Interval{0, std::hypot(one.maxAbs(), o.billow) - o.billow} : one;
    double total = 0;
    for (int k = 0; k < o.octaves; ++k) total += std::abs(std::pow(o.gain, k));
    Interval expected{0, 0};
    for (int k = 0; k < o.octaves; ++k)
        expected = expected + (o.amplitude * std::pow(o.gain, k) / (o.normalize ? total : 1)) * octave;
    const Interval range = field.range();
    CAPTURE(o.octaves, o.gain, o.amplitude, o.billow, range.lower, range.upper);
    CHECK(std::abs(range.lower - expected.lower) <= 1e-14);
    CHECK(std::abs(range.upper - expected.upper) <= 1e-14);
    double lower = 1e300, upper = -1e300;
    for (const auto& p : randomPoints(cube<N>(20), 2000, 11)) {
        const double value = field.template at<0>(p).value;
        lower = std::min(lower, value);
        upper = std::max(upper, value);
    }
    CHECK(lower >= range.lower);
    CHECK(upper <= range.upper);
    CHECK((o.amplitude == 0 || upper - lower > 0.1 * (range.upper - range.lower)));
}

TEMPLATE_TEST_CASE("noiseField: billow (turbulence) sums rounded absolute values", "[field]", Psrd2, Psrd3,
                   ValueNoise<2>, PerlinNoise<1>, PerlinNoise<3>, GradientNoise<2>, SimplexNoise<4>, SineNoise<3>,
                   SineNoise<7>) {
    constexpr int N = kN<TestType>;
    const double fold = GENERATE(1e-3, 0.2, 5.0);
    const auto options = seeded<TestType>(4);
    // Frequencies that are powers of two give exactly the same positions.
    const OctaveOptions o{.frequency = 0.5, .octaves = 3, .lacunarity = 2, .gain = 0.5, .billow = fold};
    const auto field = noiseField<TestType>(options, o);
    const TestType noise(options);
    WorstN<N> worst;
    for (const auto& p : randomPoints(cube<N>(5), 200, 12)) {
        Jet<double, N, 3> sum;
        for (const double weight : {1.0, 0.5, 0.25}) {
            const double frequency = 0.5 / weight;
            auto dilation = Matrix<N, N>{};
            for (int i = 0; i < N; ++i) dilation[i][i] = frequency;
            sum += pullBack(rounded(noise.template at<3, double>(p * frequency), fold), dilation) * (weight / 1.75);
        }
        const auto jet = field.template at<3>(p);
        double size = 1;
        for (int k = 0; k < jet.kSize; ++k) size = std::max(size, std::abs(sum.component(k)));
        worst.see(difference(jet, sum) / size, p);
    }
    CAPTURE(fold, worst.where);
    CHECK(worst.value <= 1e-12); // a few dozen roundings of sums of squares
}

TEMPLATE_TEST_CASE("noiseField: derivatives of billow agree with central differences", "[field]", Psrd2, PerlinNoise<3>,
                   SimplexNoise<4>, SineNoise<1>, SineNoise<3>) {
    constexpr int N = kN<TestType>;
    const auto field = noiseField<TestType>(seeded<TestType>(4), {.frequency = 0.5, .octaves = 2, .billow = 0.2});
    const auto points = randomPoints(cube<N>(10), 500, 13);
    // Derivatives of the fold: 1, 1/0.2 and 0.86/0.2². Those of the noises: 10, 70 and 700 (psrd and simplex noise;
    // generous for the others). The second octave has half the wavelength and half the amplitude; the sum is divided by
    // 1.5.
    requireDerivatives(field, points, 0x1p-10, (700 + 3 * 5 * 10 * 70 + 22 * 1000) * (0.125 + 0.5) / 1.5);
    // The seams are those of the noises, see their tests.
    requireThirdDerivatives(field, points, 0x1p-12, 0.02);
}

TEST_CASE("noiseField: billow is C² where the noise is zero", "[field]") {
    constexpr double kFold = 1e-2, kStep = 0x1p-34;
    const ScalarField noise = noiseField<SineNoise<3>>({.seed = 1}, {.frequency = 0.25});
    const ScalarField field = noiseField<SineNoise<3>>({.seed = 1}, {.frequency = 0.25, .billow = kFold});
    const auto jumps = jumpsAcross(field, noise, cube(10), kStep, 14);
    CHECK(jumps.seen > 50);
    // Bounds of the next derivatives: of the fold 1, 1/f, 0.86/f² and 3/f³, of the waves 2, 4, 8 and 16.
    const double second = 1 / kFold, third = second / kFold, fourth = 3 * third / kFold;
    CHECK(jumps.largest[0] <= 2 * kStep * 2 + 1e-15);
    CHECK(jumps.largest[1] <= 2 * kStep * (4 + 4 * second) + 1e-13);
    CHECK(jumps.largest[2] <= 2 * kStep * (8 + 24 * second + 8 * third) + 1e-11);
    CHECK(jumps.largest[3] <= 2 * kStep * (16 + 112 * second + 96 * third + 16 * fourth) + 1e-9);
    // At a vertex n = 0: the value and gradient are 0, and the Hessian is that of n²/2f.
    const PerlinNoise<3> perlin;
    const ScalarField sharp = noiseField<PerlinNoise<3>>({}, {.billow = 1e-3});
    const Vec3d vertex{{3, -2, 7}};
    const auto n = perlin.at<2, double>(vertex);
    const auto jet = sharp.at<2>(vertex);
    REQUIRE(n.value == 0);
    CHECK(jet.value == 0);
    CHECK(jet.gradient == Vec3d{});
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) CHECK(jet.hessian(i, j) == Approx(n.gradient[i] * n.gradient[j] / 1e-3));
    // Very sharp folds in float.
    for (const double fold : {1e-9, 1e-6, 1e9}) {
        const auto single = noiseField<PerlinNoise<3>>({}, {.billow = fold}).at<1, float>(vertex);
        const auto exact = noiseField<PerlinNoise<3>>({}, {.billow = fold}).at<3>(vertex);
        CAPTURE(fold);
        for (int k = 0; k < single.kSize; ++k) CHECK(std::isfinite(single.component(k)));
        for (int k = 0; k < exact.kSize; ++k) CHECK(std::isfinite(exact.component(k)));
    }
}

TEMPLATE_LIST_TEST_CASE("noiseField: domain warp moves each octave by the gradients of earlier octaves", "[field]",
                        AllNoises) {
    constexpr int N = kN<TestType>;
    const auto o = GENERATE(OctaveOptions{.octaves = 3, .warp = 0.1}, OctaveOptions{.frequency = 1.5,
                                                                                    .octaves = 2,
                                                                                    .gain = -0.6,
                                                                                    .amplitude = 2,
                                                                                    .normalize = false,
                                                                                    .billow = 0.1,
                                                                                    .warp = -0.15});
    const auto options = seeded<TestType>(5);
    const auto field = noiseField<TestType>(options, o);
    WorstN<N> worst, moved;
    for (const auto& p : randomPoints(cube<N>(5), 50, 15)) {
        const auto jet = field.template at<2>(p);
        worst.see(std::abs(jet.value - advectedValue<TestType>(options, o, p)), p);
        worst.see(std::abs(field.template at<0>(p).value - jet.value), p);
        // The result in float is the rounded double.
        const auto single = field.template at<1, float>(p);
        for (int k = 0; k < single.kSize; ++k)
            worst.see(std::abs(double(single.component(k)) - double(float(jet.component(k)))), p);
        auto plain = o;
        plain.warp = 0;
        moved.see(std::abs(noiseField<TestType>(options, plain).template at<0>(p).value - jet.value), p);
    }
    CAPTURE(worst.where);
    CHECK(worst.value <= 1e-13); // roundings of positions of 30, times slopes of at most 10
    CHECK(moved.value > 1e-3);
}

TEMPLATE_TEST_CASE("noiseField: a zero warp or a single octave changes nothing", "[field]", Psrd2, Psrd3, ValueNoise<2>,
                   PerlinNoise<3>, SimplexNoise<5>, SineNoise<4>) {
    constexpr int N = kN<TestType>;
    const auto options = seeded<TestType>(6);
    const auto plain = noiseField<TestType>(options, {.octaves = 3}), one = noiseField<TestType>(options);
    const auto zero = noiseField<TestType>(options, {.octaves = 3, .warp = 0});
    const auto single = noiseField<TestType>(options, {.octaves = 1, .warp = 0.5});
    const auto little = noiseField<TestType>(options, {.octaves = 3, .warp = 1e-12});
    WorstN<N> worst, near;
    for (const auto& p : randomPoints(cube<N>(5), 100, 16)) {
        worst.see(difference(zero.template at<3>(p), plain.template at<3>(p)), p);
        worst.see(difference(single.template at<3>(p), one.template at<3>(p)), p);
        near.see(difference(little.template at<1>(p), plain.template at<1>(p)), p);
    }
    CHECK(worst.value == 0);
    CHECK(near.value <= 1e-8); // 1e-12 times slopes and second derivatives of at most 10 · 70, at frequency 4
}

TEMPLATE_TEST_CASE("noiseField: warped octaves have derivatives that agree with central differences", "[field]", Psrd2,
                   Psrd3, ValueNoise<3>, PerlinNoise<2>, GradientNoise<3>, SimplexNoise<4>, SineNoise<1>, SineNoise<3>,
                   SineNoise<5>) {
    constexpr int N = kN<TestType>;
    const double fold = GENERATE(0.0, 0.3);
    const auto field = noiseField<TestType>(
        seeded<TestType>(7), {.frequency = 0.25, .octaves = 2, .lacunarity = 2, .billow = fold, .warp = 0.05});
    // Observed third derivatives are at most 220. The Hessian jumps by up to 1 = 500 h at seams of a noise that is only
    // C².
    requireDerivatives(field, randomPoints(cube<N>(20), 300, 17), 0x1p-9, 1000);
}

TEST_CASE("noiseField: warped octaves tile with the period", "[field]") {
    constexpr OctaveOptions o{.frequency = 0.5, .octaves = 4, .lacunarity = 2, .warp = 0.1};
    SECTION("psrdnoise in 2D with an odd period along y") {
        const double lacunarity = GENERATE(2.0, 3.0);
        auto octaves = o;
        octaves.lacunarity = lacunarity;
        const PsrdOptionsN<2> options{.period = {{4, 5}}, .alpha = 0.3};
        const auto field = noiseField<Psrd2>(options, octaves);
        const Vec<int64_t, 2> tile = Psrd2(options).tilingPeriod();
        REQUIRE(tile == Vec<int64_t, 2>{{4, 10}}); // as published: twice the odd period
        WorstN<2> worst, part;
        for (uint64_t k = 0; k < 300; ++k) {
            const auto p = dyadic(randomPoint(cube<2>(20), 18, k));
            const auto jet = field.at<2>(p);
            // In world units, the tile is divided by the frequency.
            worst.see(difference(field.at<2>(p + Vec<double, 2>{{8, 0}}), jet), p);
            worst.see(difference(field.at<2>(p + Vec<double, 2>{{-16, 20}}), jet), p);
            part.see(difference(field.at<2>(p + Vec<double, 2>{{0, 10}}), jet), p);
        }
        CHECK(worst.value == 0);
        CHECK(part.value > 0.1);
    }
    SECTION("psrdnoise in 3D on the Perlin grid") {
        const auto field =
            noiseField<Psrd3>({.period = {{4, 0, 3}}, .alpha = 0.3, .grid = PsrdOptions::Grid::perlin}, o);
        Worst worst;
        for (uint64_t k = 0; k < 300; ++k) {
            const Vec3d p = dyadic(randomPoint(cube(20), 19, k));
            worst.see(difference(field.at<2>(p + Vec3d{{24, 0, 0}}), field.at<2>(p)), p);
            worst.see(difference(field.at<2>(p + Vec3d{{0, 0, -6}}), field.at<2>(p)), p);
        }
        CHECK(worst.value == 0);
    }
    SECTION("lattice noises and sines") {
        const auto value = noiseField<ValueNoise<2>>({.period = {{3, 4}}, .seed = 2}, o);
        const auto perlin = noiseField<PerlinNoise<2>>({.period = {{3, 4}}, .seed = 2}, o);
        const auto sines = noiseField<SineNoise<2>>({.period = {{3, 4}}, .seed = 2}, o);
        WorstN<2> worst;
        for (uint64_t k = 0; k < 300; ++k) {
            const auto p = dyadic(randomPoint(cube<2>(20), 20, k));
            for (const auto& field : {value, perlin, sines}) {
                worst.see(difference(field.at<2>(p + Vec<double, 2>{{6, 0}}), field.at<2>(p)), p);
                worst.see(difference(field.at<2>(p + Vec<double, 2>{{-12, 8}}), field.at<2>(p)), p);
            }
        }
        CHECK(worst.value == 0);
    }
}

TEST_CASE("noiseField: warped octaves are C² across tile boundaries", "[field]") {
    constexpr OctaveOptions o{.frequency = 0.5, .octaves = 3, .lacunarity = 2, .warp = 0.1};
    const auto psrd = noiseField<Psrd2>({.period = {{4, 5}}, .alpha = 0.3}, o);
    const auto perlin = noiseField<PerlinNoise<2>>({.period = {{4, 5}}}, o);
    constexpr double kStep = 0x1p-34;
    WorstN<2> value, gradient, hessian;
    for (uint64_t k = 0; k < 200; ++k)
        for (const bool smooth : {true, false})
            for (int axis = 0; axis < 2; ++axis) {
                const auto& field = smooth ? psrd : perlin;
                auto p = randomPoint(cube<2>(20), 21, k);
                p[axis] = axis == 0 ? 8 : 20;
                const auto a = field.at<2>(p - unit<2>(axis) * kStep), b = field.at<2>(p + unit<2>(axis) * kStep);
                value.see(difference(a, b, 0, 1), p);
                gradient.see(difference(a, b, 1, 3), p);
                // The Hessian of advected Perlin noise jumps at the faces of all cells, see below.
                if (smooth) hessian.see(difference(a, b, 3, 6), p);
            }
    // 2 kStep times the next derivatives, of which the observed maxima are 5, 120 and 4100.
    CHECK(value.value <= 2 * kStep * 10);
    CHECK(gradient.value <= 2 * kStep * 500);
    CHECK(hessian.value <= 2 * kStep * 20000);
}

TEMPLATE_TEST_CASE("noiseField: warped octaves are C² if the noise is C³", "[field]", Psrd2, SimplexNoise<3>,
                   SineNoise<2>) {
    // If the Hessian jumped, the error of the differences would remain for any step.
    constexpr int N = kN<TestType>;
    const auto field = noiseField<TestType>({}, {.frequency = 0.5, .octaves = 3, .warp = 0.1});
    constexpr double kStep = 0x1p-14;
    const auto errors = derivativeErrors(field, randomPoints(cube<N>(5), 5000, 23), kStep);
    CHECK(errors.worstHessian() <= 20000 * kStep); // the third derivatives, as above
}

TEST_CASE("noiseField: a warped field cannot displace another and says why", "[field]") {
    const auto field = noiseField<Psrd2>({}, {.octaves = 2, .warp = 0.1});
    CHECK_THROWS_AS(field.at<3>({{1, 2}}), ValueError);
    CHECK_THROWS_WITH(displaced(waves<2>(1), field, 0.1), Catch::ContainsSubstring("third derivatives"));
    CHECK_NOTHROW(displaced(field, waves<2>(1), 0.1).at<2>({{1, 2}}));
    CHECK_NOTHROW(displaced(waves<2>(1), noiseField<Psrd2>({}, {.octaves = 1, .warp = 0.1}), 0.1));
}

TEMPLATE_TEST_CASE("noiseField: third derivatives of octaves agree with central differences", "[field]", Psrd2,
                   ValueNoise<1>, PerlinNoise<2>, SimplexNoise<3>, SineNoise<4>) {
    constexpr int N = kN<TestType>;
    const auto field =
        noiseField<TestType>(seeded<TestType>(8), {.frequency = 0.7, .octaves = 3, .lacunarity = 1.9, .gain = -0.5});
    // About one in a hundred stencils straddles a seam of one of the octaves.
    requireThirdDerivatives(field, randomPoints(cube<N>(20), 300, 22), 0x1p-12, 0.03);
}

TEST_CASE("noiseField: invalid billow and warp and overflowing octaves are errors", "[field]") {
    const auto make = [](const OctaveOptions& o) { return noiseField<PerlinNoise<2>>({}, o); };
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    for (const double bad : {-0.1, 1e-10, 1e10, kInfinity, std::nan("")}) {
        CAPTURE(bad);
        CHECK_THROWS_AS(make({.billow = bad}), ValueError);
    }
    CHECK_THROWS_WITH(make({.billow = -0.5}), Catch::ContainsSubstring("-0.5"));
    for (const double bad : {kInfinity, -kInfinity, std::nan("")}) {
        CAPTURE(bad);
        CHECK_THROWS_AS(make({.octaves = 2, .warp = bad}), ValueError);
        CHECK_THROWS_AS(make({.warp = bad}), ValueError);
    }
    // Powers overflow.
    CHECK_THROWS_AS(make({.octaves = 3, .lacunarity = 1e200}), ValueError);
    CHECK_THROWS_AS(make({.frequency = 1e308, .octaves = 2}), ValueError);
    CHECK_THROWS_AS(make({.octaves = 3, .gain = 1e200}), ValueError);
    CHECK_THROWS_AS(make({.octaves = 3, .gain = 1e200, .normalize = false}), ValueError);
    CHECK_THROWS_WITH(make({.octaves = 3, .lacunarity = 1e200}), Catch::ContainsSubstring("octave 3"));
    // Values that the noises themselves refuse.
    CHECK_THROWS_AS(noiseField<PerlinNoise<2>>({.period = {{-3, 0}}}), ValueError);
    CHECK_THROWS_AS(noiseField<SineNoise<2>>({.waves = 0}), ValueError);
    CHECK_THROWS_AS(noiseField<SimplexNoise<3>>({.power = 5}), ValueError);
    CHECK_THROWS_AS(noiseField<SineNoise<5>>({.period = {{4, 0, 0, 0, 3}}}, {.octaves = 2, .lacunarity = 1.5}),
                    ValueError);
    CHECK_NOTHROW(noiseField<SimplexNoise<3>>({}, {.octaves = 2, .lacunarity = 1.5})); // no period
}
