#include "curlew/base/Error.h"
#include "curlew/field/NoiseField.h"
#include "support/FiniteDifference.h"

#include <limits>

using namespace curlew;
using namespace curlew::test;

TEST_CASE("the default noise field is psrdnoise itself", "[field]") {
    const PsrdOptions options{.period = {{0, 5, 0}}, .alpha = 0.7, .seed = 3};
    const ScalarField field = noiseField<Psrd3>(options);
    const Psrd3 noise(options);
    for (const Vec3d& p : randomPoints(cube(10), 300, 1)) {
        CAPTURE(p);
        REQUIRE(difference(field.at<2>(p), noise.at<2, double>(p)) == 0);
        REQUIRE(difference(field.at<2, float>(p), noise.at<2, float>(p)) == 0);
    }
    CHECK(field.range().bound() == Psrd3::kBound);
}

TEST_CASE("octaves are the sum of single noises", "[field]") {
    const bool normalize = GENERATE(true, false);
    const double gain = GENERATE(0.5, -0.7, 1.0, 0.0);
    CAPTURE(normalize, gain);
    const OctaveOptions o{
        .frequency = 1.7, .octaves = 4, .lacunarity = 2.1, .gain = gain, .amplitude = 3, .normalize = normalize};
    const ScalarField field = noiseField<Psrd3>({.alpha = 0.2, .seed = 5}, o);
    const Psrd3 noise({.alpha = 0.2, .seed = 5});
    double total = 0, amplitude = 1;
    for (int k = 0; k < o.octaves; ++k, amplitude *= gain) total += std::abs(amplitude);
    for (const Vec3d& p : randomPoints(cube(3), 200, 2)) {
        Jet<double, 3, 2> sum;
        double a = o.amplitude / (normalize ? total : 1), frequency = o.frequency;
        for (int k = 0; k < o.octaves; ++k, a *= gain, frequency *= o.lacunarity) {
            const auto n = noise.at<2, double>(p * frequency);
            sum.value += a * n.value;
            sum.gradient += n.gradient * (a * frequency);
            for (size_t h = 0; h < 6; ++h) sum.hessian.c[h] += a * frequency * frequency * n.hessian.c[h];
        }
        const auto jet = field.at<2>(p);
        CAPTURE(p);
        // The frequencies are products here and powers there: a rounding of positions below 50, times the derivatives
        // of the highest octave: amplitude 3, frequency below 16, psrd derivatives below 6, 45 and 600.
        const double rounding = 50 * 4 * 0x1p-53 * 3 * 4;
        REQUIRE(difference(jet, sum, 0, 1) < rounding * 6);
        REQUIRE(difference(jet, sum, 1, 4) < rounding * 45 * 16);
        REQUIRE(difference(jet, sum, 4, 10) < rounding * 600 * 16 * 16);
    }
    CHECK(field.range().bound() == Approx(Psrd3::kBound * 3 * (normalize ? 1 : total)));
}

TEST_CASE("a noise field has the derivatives of its value and keeps its bound", "[field]") {
    const ScalarField field = noiseField<Psrd3>({.seed = 9}, {.frequency = 0.8, .octaves = 3, .gain = 0.6});
    // The third derivative of psrd (below 600) times frequency³, weighted with the amplitudes: 600 · 0.8³ ·
    // (1 + 0.6 · 8 + 0.36 · 64) / 1.96.
    requireDerivatives(field, randomPoints(cube(10), 1000, 3), 0x1p-10, 600 * 0.512 * (1 + 4.8 + 23.04) / 1.96);
    Worst worst;
    for (const Vec3d& p : randomPoints(cube(100), 100000, 4)) worst.see(std::abs(field.at<0>(p).value), p);
    CHECK(worst.value <= field.range().bound());
}

TEST_CASE("all octaves of a noise field tile together", "[field]") {
    const double lacunarity = GENERATE(2.0, 3.0);
    const ScalarField field = noiseField<Psrd3>({.period = {{4, 6, 3}}, .alpha = 0.5, .seed = 7},
                                                {.frequency = 2, .octaves = 4, .lacunarity = lacunarity});
    for (uint64_t k = 0; k < 500; ++k) {
        const Vec3d p = dyadic(randomPoint(cube(5), 5, k));
        CAPTURE(p, lacunarity);
        // In world units the period is that of the lattice over the frequency.
        for (const Vec3d& shift : {Vec3d{{2, 0, 0}}, Vec3d{{0, 3, 0}}, Vec3d{{0, 0, 1.5}}, Vec3d{{-4, 6, -1.5}}})
            REQUIRE(difference(field.at<2>(p), field.at<2>(p + shift)) == 0);
    }
}

TEST_CASE("unusable octaves are errors that name the value", "[field]") {
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
    }
    CHECK_THROWS_AS(make({.octaves = 0}), ValueError);
    CHECK_THROWS_WITH(make({.octaves = 33}), Catch::Contains("33"));
    CHECK_THROWS_WITH(make({.octaves = 2, .lacunarity = 2.5}, {.period = {{4, 4, 4}}}), Catch::Contains("2.5"));
    CHECK_NOTHROW(make({.octaves = 1, .lacunarity = 2.5}, {.period = {{4, 4, 4}}}));
    CHECK_THROWS_AS(make({.octaves = 32}, {.period = {{4, 4, 4}}}), ValueError); // the last period: 2^33
    CHECK_NOTHROW(make({.octaves = 32}));
}
