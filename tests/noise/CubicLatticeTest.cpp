// SPDX-License-Identifier: Apache-2.0
// Longer than 400 lines: value and Perlin noise, with each option, compared with their published forms.
#include "curlew/base/Error.h"
#include "curlew/noise/CubicLattice.h"
#include "curlew/noise/GradientNoise.h"
#include "curlew/noise/PerlinNoise.h"
#include "curlew/noise/SineNoise.h"
#include "curlew/noise/ValueNoise.h"
#include "support/FiniteDifference.h"
#include "support/Reference.h"
#include "support/Samples.h"

#include <limits>

using namespace curlew;
using namespace curlew::test;

// Properties of all noises that are built on the cubic lattice or tile with it.
namespace {

using Value1 = ValueNoise<1>;
using Value2 = ValueNoise<2>;
using Value3 = ValueNoise<3>;
using Perlin1 = PerlinNoise<1>;
using Perlin2 = PerlinNoise<2>;
using Perlin3 = PerlinNoise<3>;
using Gradient2 = GradientNoise<2>;
using Gradient3 = GradientNoise<3>;
using Sine1 = SineNoise<1>;
using Sine2 = SineNoise<2>;
using Sine3 = SineNoise<3>;
using Sine4 = SineNoise<4>;

template <class>
constexpr int kDimension = 0;
template <template <int> class Noise, int N>
constexpr int kDimension<Noise<N>> = N;

template <int N>
Vec<int, N> periods(const std::array<int, 3>& some) {
    Vec<int, N> period;
    for (int axis = 0; axis < N; ++axis) period[axis] = some[static_cast<size_t>(axis) % 3];
    return period;
}

/// Rounds to multiples of 2^-40, to which whole numbers below 2^12 can be added exactly, but not other fractions.
template <int N>
Vec<double, N> manyBits(Vec<double, N> p) {
    for (double& x : p.c) x = std::floor(x * 0x1p40) * 0x1p-40;
    return p;
}

// The float errors that the headers state, and a bound of the third derivatives: 60 and 30 of fade and ramp for lattice
// noises (observed: 123), (2 pi 1.25)³ for waves.
constexpr std::array<double, 3> kFloatErrors{5e-6, 2e-5, 1e-4};
constexpr double kThirdDerivative = 500;

/// Compares with rows of a position and the jet there, from tests/data.
template <class Noise>
void checkOwn(const Noise& noise, const std::string& file, const std::string& name) {
    constexpr int N = kDimension<Noise>;
    std::array<WorstN<N>, 3> worst, worstFloat;
    const auto rows = reference(file).at(name);
    for (const auto& row : rows) {
        Vec<double, N> p;
        for (int axis = 0; axis < N; ++axis) p[axis] = row.at(static_cast<size_t>(axis));
        const auto jet = noise.template at<2, double>(p);
        const auto single = noise.template at<2, float>(p);
        for (int k = 0; k < jet.kSize; ++k) {
            const double expected = row.at(static_cast<size_t>(N + k));
            const size_t order = k == 0 ? 0 : k <= N ? 1 : 2;
            worst[order].see(std::abs(jet.component(k) - expected), p);
            worstFloat[order].see(std::abs(double(single.component(k)) - expected), p);
        }
    }
    CHECK(rows.size() >= 10);
    for (size_t order = 0; order < 3; ++order) {
        CAPTURE(file, name, order, worst[order].where, worstFloat[order].where);
        CHECK(worst[order].value < 3e-13); // about 10 roundings of second derivatives of up to 15
        CHECK(worstFloat[order].value < kFloatErrors[order]);
    }
}

/// Compares with published values and gradients at frequency · x.
template <class Noise>
void checkPublished(const Noise& noise, const std::string& name) {
    constexpr int N = kDimension<Noise>;
    const auto file = reference(name);
    const bool scaled = file.at("fields").at(1) == "frequency";
    const size_t first = scaled ? 2 : 1; // column of the position
    WorstN<N> worst;
    for (const auto& row : file.at("rows")) {
        const double frequency = scaled ? row.at(1).get<double>() : 1;
        const auto number = [&](int k) { return row.at(first + static_cast<size_t>(k)).template get<double>(); };
        Vec<double, N> p;
        for (int axis = 0; axis < N; ++axis) p[axis] = frequency * number(axis);
        const auto jet = noise.template at<1, double>(p);
        for (int k = 0; k < jet.kSize; ++k)
            worst.see(std::abs(jet.component(k) * (k == 0 ? 1 : frequency) - number(N + k)), p);
    }
    CAPTURE(name, worst.value, worst.where);
    CHECK(worst.value < 1e-13); // a few roundings of a gradient of up to 3, times the frequency
}

} // namespace

TEST_CASE("lattice noise: agrees with exact evaluation", "[noise]") {
    checkOwn(Value1(), "value_noise.json", "1");
    checkOwn(Value2(), "value_noise.json", "2");
    checkOwn(Value3(), "value_noise.json", "3");
    checkOwn(Perlin1(), "perlin_noise.json", "1");
    checkOwn(Perlin2(), "perlin_noise.json", "2");
    checkOwn(Perlin3(), "perlin_noise.json", "3");
    checkOwn(Perlin3({.gradients = PerlinGradients::reference}), "perlin_noise.json", "reference3");
    checkOwn(Gradient2(), "gradient_noise.json", "2");
    checkOwn(Gradient3(), "gradient_noise.json", "3");
}

TEST_CASE("lattice noise: agrees with published values with and without the period of 256", "[noise]") {
    const int period = GENERATE(0, 256);
    CAPTURE(period);
    const Vec<int, 1> in1 = periods<1>({period});
    const Vec<int, 2> in2 = periods<2>({period, period});
    const Vec<int, 3> in3 = periods<3>({period, period, period});
    checkPublished(Value1({.period = in1}), "catlike_value1.json");
    checkPublished(Value2({.period = in2}), "catlike_value2.json");
    checkPublished(Value3({.period = in3}), "catlike_value3.json");
    checkPublished(Perlin1({.period = in1}), "catlike_perlin1.json");
    checkPublished(Perlin2({.period = in2}), "catlike_perlin2.json");
    checkPublished(Perlin3({.period = in3}), "catlike_perlin3.json");
    checkPublished(Perlin3({.period = in3, .gradients = PerlinGradients::reference}),
                   "perlin_improved_reference3.json");
}

TEMPLATE_TEST_CASE("lattice noise: a period of 256 changes nothing in the published noises", "[noise]", Value1, Value2,
                   Value3, Perlin1, Perlin2, Perlin3) {
    constexpr int N = kDimension<TestType>;
    const TestType plain, tiled({.period = periods<N>({256, 256, 256})});
    WorstN<N> worst;
    for (const auto& p : randomPoints(cube<N>(1000), 2000, 12))
        worst.see(difference(plain.template at<2, double>(p), tiled.template at<2, double>(p)), p);
    CHECK(worst.value == 0);
}

TEST_CASE("floorMod: is never negative and exact", "[noise]") {
    for (const double p : {1.0, 3.0, 256.0, 300.0, 2147483647.0, 0x1p32})
        for (const double multiple : {0.0, 1.0, -1.0, 7.0, -12345.0, 524287.0})
            for (const double rest : {0.0, 1.0, p - 1}) {
                if (rest >= p) continue;
                CAPTURE(p, multiple, rest);
                CHECK(floorMod(multiple * p + rest, p, 1 / p) == rest);
            }
}

TEST_CASE("CubicLattice: neighbouring cells share vertices across periods and 32-bit limits", "[noise]") {
    for (const double natural : {256.0, 0x1p32})
        for (const int period : {0, 1, 2, 7, 300, std::numeric_limits<int>::max()})
            for (const uint64_t seed : {0, 3}) {
                const double p = period > 0 ? period : natural;
                const CubicLattice<1> lattice({{period}}, natural, seed);
                for (const double start : {0.0, -3.0, 1e6, 0x1p32, p, -p, 5 * p}) {
                    CAPTURE(natural, period, seed, start);
                    for (int step = -3; step < 3; ++step) {
                        const double x = start + step;
                        const auto here = lattice.cell(Vec<double, 1>{{x}}),
                                   next = lattice.cell(Vec<double, 1>{{x + 1}});
                        CHECK(here.index[0][1] == next.index[0][0]);
                        CHECK(here.index[0][0] < p);
                        CHECK(here.fraction == next.fraction);
                        if (seed == 0) CHECK(here.index[0][0] == floorMod(x, p, 1 / p));
                    }
                }
            }
    // Just below a whole number the fraction would round to 1, so it is 0 in the next cell.
    const auto cell = CubicLattice<1>({}, 256, 0).cell(Vec<double, 1>{{-1e-30}});
    CHECK(cell.index[0][0] == 0);
    CHECK(cell.fraction[0] == 0);
}

TEST_CASE("blendCorners: at a vertex only its own value and derivatives count", "[noise]") {
    const auto corner = [](size_t k) {
        return cornerRamp<2>(Vec3d{{1.0 + double(k), -2, 0.5}}, Vec3d{{0, 1, 0}}, k) + Jet<double, 3, 2>(double(k));
    };
    const auto blend = blendCorners<2>(Vec3d{{0, 1, 0}}, corner);
    CHECK(blend.value == 2);
    CHECK(blend.gradient == Vec3d{{3, -2, 0.5}});
    for (const double h : blend.hessian.c) CHECK(h == 0);
}

TEMPLATE_TEST_CASE("lattice noise: tiles exactly with its period", "[noise]", Value1, Value2, Value3, Perlin1, Perlin2,
                   Perlin3, Gradient2, Gradient3, Sine1, Sine2, Sine3, Sine4) {
    constexpr int N = kDimension<TestType>;
    const auto period = periods<N>(GENERATE(std::array<int, 3>{1, 1, 1}, std::array<int, 3>{4, 6, 3},
                                            std::array<int, 3>{5, 0, 2}, std::array<int, 3>{300, 1000, 256}));
    const uint64_t seed = GENERATE(uint64_t{0}, uint64_t{77});
    CAPTURE(period, seed);
    const TestType noise({.period = period, .seed = seed}), plain({.seed = seed});
    WorstN<N> worst;
    int plainDiffers = 0;
    for (uint64_t k = 0; k < 500; ++k) {
        const auto p = manyBits(randomPoint(cube<N>(20), 1, k));
        const auto jet = noise.template at<2, double>(p);
        const auto single = noise.template at<2, float>(p);
        plainDiffers += difference(jet, plain.template at<2, double>(p)) != 0;
        for (int axis = 0; axis < N; ++axis)
            for (const int times : {1, -1, 3}) {
                const auto q = p + unit<N>(axis) * double(times * period[axis]);
                worst.see(difference(jet, noise.template at<2, double>(q)), q);
                worst.see(difference(single, noise.template at<2, float>(q)), q);
            }
    }
    CAPTURE(worst.where);
    CHECK(worst.value == 0);
    CHECK(plainDiffers > 100); // the period makes the difference
}

TEMPLATE_TEST_CASE("lattice noise: tiles exactly far from the origin", "[noise]", Value1, Value3, Perlin2, Perlin3,
                   Gradient2, Gradient3, Sine1, Sine3) {
    constexpr int N = kDimension<TestType>;
    const auto period = periods<N>({7, 300, 3});
    const TestType noise({.period = period, .seed = 5});
    WorstN<N> worst;
    for (uint64_t k = 0; k < 500; ++k) {
        const auto p = dyadic(randomPoint(cube<N>(20), 2, k));
        const auto jet = noise.template at<2, double>(p);
        for (int axis = 0; axis < N; ++axis)
            for (const double times : {1e6, -1e9}) {
                const auto q = p + unit<N>(axis) * (times * period[axis]);
                worst.see(difference(jet, noise.template at<2, double>(q)), q);
            }
    }
    CAPTURE(worst.where);
    CHECK(worst.value == 0);
}

TEMPLATE_TEST_CASE("lattice noise: float is as accurate far away as near the origin", "[noise]", Value1, Value2, Value3,
                   Perlin1, Perlin2, Perlin3, Gradient2, Gradient3, Sine1, Sine2, Sine3, Sine4) {
    constexpr int N = kDimension<TestType>;
    const double far = GENERATE(0.0, 1e6, -1e8);
    CAPTURE(far);
    const TestType noise({.seed = 4});
    std::array<WorstN<N>, 3> worst;
    for (auto p : randomPoints(cube<N>(50), 10000, 4)) {
        for (double& x : p.c) x += far;
        const auto jet = noise.template at<2, double>(p);
        const auto single = noise.template at<2, float>(p);
        for (int k = 0; k < jet.kSize; ++k)
            worst[k == 0 ? 0 : k <= N ? 1 : 2].see(std::abs(double(single.component(k)) - jet.component(k)), p);
    }
    for (size_t order = 0; order < 3; ++order) {
        CAPTURE(order, worst[order].where);
        CHECK(worst[order].value < kFloatErrors[order]);
    }
}

TEMPLATE_TEST_CASE("lattice noise: different seeds are uncorrelated", "[noise]", Value1, Value2, Value3, Perlin1,
                   Perlin2, Perlin3, Gradient2, Gradient3, Sine1, Sine2, Sine3, Sine4) {
    constexpr int N = kDimension<TestType>;
    constexpr size_t kCount = samples(50000);
    const auto points = randomPoints(cube<N>(500), kCount, 5);
    std::vector<std::vector<double>> values;
    const std::array<uint64_t, 5> seeds{0, 1, 2, 3, uint64_t{1} << 63};
    for (const uint64_t seed : seeds) {
        const TestType noise({.seed = seed});
        std::vector<double>& v = values.emplace_back();
        double mean = 0;
        for (const auto& p : points) mean += v.emplace_back(noise.template at<0, double>(p).value) / kCount;
        for (double& x : v) x -= mean;
    }
    const auto product = [](const std::vector<double>& a, const std::vector<double>& b) {
        double sum = 0;
        for (size_t k = 0; k < a.size(); ++k) sum += a[k] * b[k];
        return sum;
    };
    for (size_t i = 0; i < seeds.size(); ++i) {
        CHECK(std::sqrt(product(values[i], values[i]) / kCount) > 0.1); // not all zero
        for (size_t j = i + 1; j < seeds.size(); ++j) {
            const double correlation = product(values[i], values[j]) /
                                       std::sqrt(product(values[i], values[i]) * product(values[j], values[j]));
            CAPTURE(seeds[i], seeds[j], correlation);
            // 4 sigma: of the samples, and of the distinct values of the hash. It distinguishes 256 vertices in 1D, 256
            // rows of 256 in 2D and more otherwise; the blend correlates neighbours.
            CHECK(std::abs(correlation) < 4 * std::sqrt(2.0 / kCount + 2 / std::pow(256, std::min(N, 2))));
        }
    }
}

TEMPLATE_TEST_CASE("lattice noise: values stay within the bound", "[noise]", Value1, Value2, Value3, Perlin1, Perlin2,
                   Perlin3, Gradient2, Gradient3, Sine1, Sine2, Sine3, Sine4) {
    constexpr int N = kDimension<TestType>;
    double most = 0;
    for (uint64_t seed = 0; seed < 10; ++seed) { // each seed has other extremes
        const TestType noise({.seed = seed});
        for (uint64_t k = 0; k < 100000; ++k)
            most = std::max(most, std::abs(noise.template at<0, double>(randomPoint(cube<N>(1000), 6, k)).value));
    }
    const double bound = TestType().maxAbs();
    CAPTURE(most, bound);
    CHECK(bound == TestType::kBound);
    CHECK(most <= bound);
    // The tests of each noise have tighter limits. The loosest is that of gradient noise in 3D.
    CHECK(most > 0.5 * bound);
}

TEMPLATE_TEST_CASE("lattice noise: is C² across cell faces", "[noise]", Value1, Value2, Value3, Perlin1, Perlin2,
                   Perlin3, Gradient2, Gradient3, Sine1, Sine2, Sine3, Sine4) {
    constexpr int N = kDimension<TestType>;
    constexpr double kStep = 0x1p-40;
    const auto period = periods<N>(GENERATE(std::array<int, 3>{}, std::array<int, 3>{4, 6, 3}));
    const TestType noise({.period = period});
    std::array<WorstN<N>, 3> jump;
    for (uint64_t k = 0; k < 3000; ++k) {
        auto p = dyadic(randomPoint(cube<N>(50), 8, k));
        const int axis = static_cast<int>(k % N);
        p[axis] = std::floor(p[axis]);
        const auto a = noise.template at<2, double>(p - unit<N>(axis) * kStep);
        const auto b = noise.template at<2, double>(p + unit<N>(axis) * kStep);
        jump[0].see(difference(a, b, 0, 1), p);
        jump[1].see(difference(a, b, 1, N + 1), p);
        jump[2].see(difference(a, b, N + 1, a.kSize), p);
    }
    // 2 kStep times the next derivative: those of first and second order are below 8 and 65, see above. The sines have
    // a few roundings of arguments of up to 2 pi 1.25 · 50.
    CAPTURE(jump[0].where, jump[1].where, jump[2].where);
    CHECK(jump[0].value < 2 * kStep * 8);
    CHECK(jump[1].value < 2 * kStep * 65);
    CHECK(jump[2].value < 2 * kStep * kThirdDerivative);
}

TEMPLATE_TEST_CASE("lattice noise: gradient and Hessian agree with central differences", "[noise]", Value1, Value2,
                   Value3, Perlin1, Perlin2, Perlin3, Gradient2, Gradient3, Sine1, Sine2, Sine3, Sine4) {
    constexpr int N = kDimension<TestType>;
    const uint64_t seed = GENERATE(uint64_t{0}, uint64_t{3});
    CAPTURE(seed);
    const TestType noise(
        {.period = periods<N>(seed == 0 ? std::array<int, 3>{} : std::array<int, 3>{40, 60, 30}), .seed = seed});
    requireDerivatives(noise, randomPoints(cube<N>(30), 2000, 9), 0x1p-9, kThirdDerivative);
}

TEMPLATE_TEST_CASE("lattice noise: NaN and infinite and huge positions are safe", "[noise]", Value1, Value3, Perlin1,
                   Perlin3, Gradient2, Gradient3, Sine1, Sine3) {
    constexpr int N = kDimension<TestType>;
    constexpr double kInfinity = std::numeric_limits<double>::infinity(), kMax = std::numeric_limits<double>::max();
    const auto period = periods<N>(GENERATE(std::array<int, 3>{}, std::array<int, 3>{4, 6, 3},
                                            std::array<int, 3>{std::numeric_limits<int>::max(), 0, 1}));
    const TestType noise({.period = period, .seed = 2});
    const std::array<double, 14> values{0,     -0.0,   std::nan(""), kInfinity, -kInfinity, kMax,   -kMax,
                                        1e300, -1e300, 1e18,         -1e15,     0x1p53,     1e-320, 0.25};
    const size_t count = values.size() * (N > 1 ? values.size() : 1) * (N > 2 ? values.size() : 1);
    double sum = 0;
    WorstN<N> worst;
    for (size_t k = 0; k < count; ++k) {
        Vec<double, N> p;
        bool sane = true;
        for (size_t axis = 0, rest = k; axis < N; ++axis, rest /= values.size()) {
            p[static_cast<int>(axis)] = values[rest % values.size()];
            sane &= std::abs(p[static_cast<int>(axis)]) < 0x1p50;
        }
        const auto jet = noise.template at<2, double>(p);
        const auto single = noise.template at<2, float>(p);
        for (int c = 0; c < jet.kSize; ++c) sum += jet.component(c) + double(single.component(c));
        if (sane) worst.see(std::abs(jet.value), p); // only where lattice cells are well defined
    }
    CHECK(!(sum == 1)); // uses the sum
    CAPTURE(worst.where);
    CHECK(worst.value <= noise.maxAbs());
}

TEMPLATE_TEST_CASE("lattice noise: a negative period is rejected by its value", "[noise]", Value1, Value2, Value3,
                   Perlin1, Perlin2, Perlin3, Gradient2, Gradient3, Sine1, Sine2, Sine3, Sine4) {
    const auto period = periods<kDimension<TestType>>({-2, 0, 4});
    CHECK_THROWS_AS(TestType({.period = period}), ValueError);
    CHECK_THROWS_WITH(TestType({.period = period}), Catch::ContainsSubstring("-2"));
}

TEMPLATE_TEST_CASE("lattice noise: different seeds share no vertices", "[noise]", Perlin1, Perlin2, Perlin3, Gradient2,
                   Gradient3) {
    // Gradient noise is zero at its own vertices, and almost never at those of another seed.
    constexpr int N = kDimension<TestType>;
    const TestType published, other({.seed = 1});
    WorstN<N> worst;
    int zeros = 0;
    for (auto p : randomPoints(cube<N>(1000), 1000, 11)) {
        for (double& x : p.c) x = std::floor(x);
        worst.see(std::abs(published.template at<0, double>(p).value), p);
        zeros += std::abs(other.template at<0, double>(p).value) < 1e-6;
    }
    CHECK(worst.value == 0);
    CHECK(zeros < 10);
}

TEMPLATE_TEST_CASE("lattice noise: third derivatives agree with central differences of the Hessian", "[noise]", Value1,
                   Value2, Value3, Perlin1, Perlin2, Perlin3, Gradient2, Gradient3, Sine1, Sine2, Sine3, Sine4) {
    constexpr int N = kDimension<TestType>;
    const uint64_t seed = GENERATE(uint64_t{0}, uint64_t{3});
    CAPTURE(seed);
    const TestType noise(
        {.period = periods<N>(seed == 0 ? std::array<int, 3>{} : std::array<int, 3>{40, 60, 30}), .seed = seed});
    const auto points = randomPoints(cube<N>(30), 500, 10);
    // Third derivatives of fades jump at the faces of cells, at distance 1. A stencil of width 2 h straddles a face of
    // one of the N axes with probability 2 N h, below 1.2 %. Waves have no seams.
    const bool waves = std::is_same_v<TestType, SineNoise<N>>;
    requireThirdDerivatives(noise, points, 0x1p-9, waves ? 0 : 0.03);
    for (const auto& p : points) {
        CAPTURE(p);
        REQUIRE(difference(truncated<2>(noise.template at<3, double>(p)), noise.template at<2, double>(p)) == 0);
    }
}
