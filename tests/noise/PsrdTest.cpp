// SPDX-License-Identifier: Apache-2.0
// Longer than 400 lines: psrdnoise has its options, dimensions and published values.
#include "curlew/base/Error.h"
#include "curlew/base/Parallel.h"
#include "curlew/noise/Psrd.h"
#include "support/FiniteDifference.h"
#include "support/Reference.h"
#include "support/Samples.h"
#include "support/Statistics.h"

#include <limits>
#include <numbers>

using namespace curlew;
using namespace curlew::test;

namespace {

using Rotation = PsrdOptions::Rotation;
using Grid = PsrdOptions::Grid;

/// The published variants: one in 2D, four in 3D.
template <int N>
std::vector<PsrdOptionsN<N>> variants() {
    if constexpr (N == 2)
        return {{}};
    else
        return {{},
                {.rotation = Rotation::fast},
                {.grid = Grid::perlin},
                {.rotation = Rotation::fast, .grid = Grid::perlin}};
}

template <int N>
bool onPerlinGrid([[maybe_unused]] const PsrdOptionsN<N>& options) {
    if constexpr (N == 3)
        return options.grid == Grid::perlin;
    else
        return false;
}

/// Returns a name of the variant for CAPTURE.
template <int N>
std::string describe(const PsrdOptionsN<N>& options) {
    std::string text = std::to_string(N) + "D";
    if constexpr (N == 3) {
        text += options.grid == Grid::perlin ? " perlin" : " axis";
        text += options.rotation == Rotation::fast ? " fast" : " standard";
    }
    return text + " period " + Catch::StringMaker<Vec<int, N>>::convert(options.period) + " seed " +
           std::to_string(options.seed);
}

/// Returns the steps from a vertex to its neighbours along the simplex coordinates.
template <int N>
std::array<Vec<double, N>, N> latticeSteps(const PsrdOptionsN<N>& options) {
    if constexpr (N == 2)
        return {Vec<double, 2>{{1, 0}}, Vec<double, 2>{{-0.5, 1}}};
    else if (onPerlinGrid(options))
        return {Vec3d{{5, -1, -1}} * (1 / 6.0), Vec3d{{-1, 5, -1}} * (1 / 6.0), Vec3d{{-1, -1, 5}} * (1 / 6.0)};
    else
        return {Vec3d{{-0.5, 0.5, 0.5}}, Vec3d{{0.5, -0.5, 0.5}}, Vec3d{{0.5, 0.5, -0.5}}};
}

/// Returns the position of simplex coordinates.
template <int N>
Vec<double, N> fromSimplex(const PsrdOptionsN<N>& options, const Vec<double, N>& u) {
    Vec<double, N> x;
    for (size_t k = 0; k < N; ++k) x += latticeSteps(options)[k] * u.c[k];
    return x;
}

/// Returns the order of the derivative in component k of a jet.
template <int N>
size_t orderOf(int k) {
    return k == 0 ? 0 : k <= N ? 1 : 2;
}

template <class J>
bool same(const J& a, const J& b) { // zeros of either sign are equal
    for (int k = 0; k < J::kSize; ++k)
        if (a.component(k) != b.component(k)) return false;
    return true;
}

/// Bounds of the components of the first three derivatives. The observed maxima among 2·10^6 points of each variant
/// were 5.26, 32.9 and 244 in 2D, and 6.00, 45.0 and 563 in 3D.
template <int N>
constexpr std::array<double, 3> kSteepest =
    N == 2 ? std::array<double, 3>{6, 40, 300} : std::array<double, 3>{7, 50, 650};

/// The accuracy in float by order of the derivative, as the header states it.
constexpr std::array<double, 3> kFloatAccuracy{1e-6, 6e-6, 1e-4};

/// Compares the noise in double and in float with a reference file of the psrdnoise families.
template <int N>
void checkAgainst(const nlohmann::json& file) {
    PsrdOptionsN<N> options;
    for (int i = 0; i < N; ++i) options.period[i] = file.at("period").at(static_cast<size_t>(i)).get<int>();
    if constexpr (N == 3) {
        options.alpha = file.at("alpha").get<double>();
        if (file.value("rotation", "") == "FASTROTATION") options.rotation = Rotation::fast;
        if (file.value("grid", "") == "PERLINGRID") options.grid = Grid::perlin;
    }
    PsrdN<N> noise(options);
    // A few hundred roundings of theta = hash · 3.88, up to 1118 radians, times the second derivatives.
    constexpr double kTolerance = 1e-11;
    std::array<WorstN<N>, 3> worst, worstFloat;
    for (const auto& row : file.at("rows")) {
        size_t column = 1; // after the id
        const auto next = [&] { return row.at(column++).template get<double>(); };
        if constexpr (N == 2)
            if (const double alpha = next(); alpha != options.alpha) {
                options.alpha = alpha;
                noise = PsrdN<N>(options);
            }
        Vec<double, N> p;
        for (double& x : p.c) x = next();
        const auto jet = noise.template at<2, double>(p);
        const auto single = noise.template at<2, float>(p);
        for (int k = 0; k < jet.kSize; ++k) {
            const double expected = next(); // the files have the order of a jet
            worst[orderOf<N>(k)].see(std::abs(jet.component(k) - expected), p);
            worstFloat[orderOf<N>(k)].see(std::abs(double(single.component(k)) - expected), p);
        }
    }
    CHECK(file.at("rows").size() >= 20);
    for (size_t order = 0; order < 3; ++order) {
        CAPTURE(order, worst[order].value, worst[order].where, worstFloat[order].value, worstFloat[order].where);
        CHECK(worst[order].value <= kTolerance);
        CHECK(worstFloat[order].value <= kFloatAccuracy[order]);
    }
}

template <int N>
std::vector<Vec<int, N>> periods() {
    if constexpr (N == 2)
        return {{{1, 1}}, {{5, 4}}, {{3, 0}}, {{0, 6}}, {{0, 7}}, {{1000, 289}}};
    else
        return {{{1, 1, 1}}, {{4, 6, 3}}, {{3, 6, 9}}, {{0, 5, 0}}, {{7, 0, 2}}, {{300, 1000, 289}}};
}

/// Returns a position whose coordinates are multiples of 2^-36. Numbers of up to 2^16 can be added to them exactly,
/// while its simplex coordinates are rounded.
template <int N>
Vec<double, N> finePoint(double half, uint64_t seed, uint64_t k) {
    Vec<double, N> p = randomPoint(cube<N>(half), seed, k);
    for (double& x : p.c) x = std::floor(x * 0x1p36) * 0x1p-36;
    return p;
}

} // namespace

TEST_CASE("psrdnoise: agrees with the published 2D shader", "[noise]") {
    const std::string period = GENERATE("0-0", "5-4", "3-0", "0-6");
    CAPTURE(period);
    checkAgainst<2>(reference("psrdnoise2_p" + period + ".json"));
}

TEST_CASE("psrdnoise: agrees with the published 3D shader", "[noise]") {
    const std::string grid = GENERATE("axisgrid", "perlingrid"), rotation = GENERATE("rot", "fastrot"),
                      period = GENERATE("0-0-0", "4-6-3", "0-5-0", "3-6-9"), alpha = GENERATE("0", "0.7", "2.5");
    if (grid == "axisgrid" && period == "3-6-9") return; // this file does not exist
    CAPTURE(grid, rotation, period, alpha);
    checkAgainst<3>(reference("psrdnoise3_" + grid + "_" + rotation + "_p" + period + "_a" + alpha + ".json"));
}

TEMPLATE_TEST_CASE_SIG("psrdnoise: tiles exactly with its tiling period and with no fraction of it", "[noise]",
                       ((int N), N), 2, 3) {
    auto options = GENERATE(from_range(variants<N>()));
    options.seed = GENERATE(uint64_t{0}, uint64_t{77});
    options.alpha = 0.7;
    const PsrdN<N> plain(options);
    options.period = GENERATE(from_range(periods<N>()));
    CAPTURE(describe(options));
    const PsrdN<N> noise(options);
    const Vec<int64_t, N> tiling = noise.tilingPeriod();
    constexpr int kCount = 700;
    int plainDiffers = 0;
    std::array<std::array<int, 6>, N> partDiffers{};
    for (uint64_t k = 0; k < kCount; ++k) {
        const auto p = finePoint<N>(20, 1, k);
        const auto jet = noise.template at<2, double>(p);
        plainDiffers += !same(jet, plain.template at<2, double>(p));
        for (int axis = 0; axis < N; ++axis) {
            const auto along = [&](int64_t distance) {
                return noise.template at<2, double>(p + unit<N>(axis) * double(distance));
            };
            for (const int times : {1, -1, 3}) {
                CAPTURE(p, axis, times);
                if (!same(jet, along(times * tiling[axis]))) FAIL("does not tile");
            }
            for (const int part : {2, 3, 5})
                if (tiling[axis] % part == 0)
                    partDiffers[static_cast<size_t>(axis)][static_cast<size_t>(part)] +=
                        difference(jet, along(tiling[axis] / part)) > 1e-6;
        }
    }
    CHECK(plainDiffers > kCount / 2); // the period makes the difference
    for (int axis = 0; axis < N; ++axis)
        for (const int part : {2, 3, 5}) {
            CAPTURE(axis, part);
            if (tiling[axis] > 0 && tiling[axis] % part == 0)
                CHECK(partDiffers[static_cast<size_t>(axis)][static_cast<size_t>(part)] > kCount / 2);
        }
}

TEST_CASE("psrdnoise: the tiling period is the common multiple of period and lattice", "[noise]") {
    CHECK(Psrd2({.period = {{5, 5}}}).tilingPeriod() == Vec<int64_t, 2>{{5, 10}});
    CHECK(Psrd2({.period = {{0, 6}}}).tilingPeriod() == Vec<int64_t, 2>{{0, 6}});
    CHECK(Psrd3({.period = {{4, 0, 3}}}).tilingPeriod() == Vec<int64_t, 3>{{4, 0, 3}});
    CHECK(Psrd3({.period = {{4, 0, 3}}, .grid = Grid::perlin}).tilingPeriod() == Vec<int64_t, 3>{{12, 0, 3}});
    constexpr int kMax = std::numeric_limits<int>::max();
    CHECK(Psrd3({.period = {{kMax, 0, 0}}, .grid = Grid::perlin}).tilingPeriod()[0] == int64_t{3} * kMax);
}

TEMPLATE_TEST_CASE_SIG("psrdnoise: a period changes nothing inside the first tile away from its margin", "[noise]",
                       ((int N), N), 2, 3) {
    // Vertices within [0, period) keep their places: the corners of a simplex are within a distance of 1 from the
    // point.
    auto options = GENERATE(from_range(variants<N>()));
    const PsrdN<N> plain(options);
    BoxN<N> box;
    for (int axis = 0; axis < N; ++axis) {
        options.period[axis] = 8 + axis;
        box.lower[axis] = 1;
        box.upper[axis] = 7 + axis;
    }
    CAPTURE(describe(options));
    const PsrdN<N> tiled(options);
    for (const auto& p : randomPoints(box, 2000, 2)) {
        CAPTURE(p);
        if (!same(tiled.template at<2, double>(p), plain.template at<2, double>(p))) FAIL("not the same");
    }
}

TEMPLATE_TEST_CASE_SIG("psrdnoise: repeats far away with the period of its hash", "[noise]", ((int N), N), 2, 3) {
    // The hash uses simplex coordinates modulo 289. The noise therefore repeats after 289 steps along each of them, and
    // along the axes after 289 times the period of the lattice.
    auto options = GENERATE(from_range(variants<N>()));
    options.seed = GENERATE(uint64_t{0}, uint64_t{11});
    options.alpha = 0.3;
    CAPTURE(describe(options));
    const PsrdN<N> noise(options);
    std::vector<Vec<double, N>> translations;
    for (int axis = 0; axis < N; ++axis) {
        const double own = onPerlinGrid(options) ? 3 : N == 2 && axis == 1 ? 2 : 1;
        translations.push_back(unit<N>(axis) * (289 * own));
        translations.push_back(unit<N>(axis) * (-289 * own * 3461)); // a million away
        // On Perlin's grid, these steps are not dyadic fractions.
        if (!onPerlinGrid(options)) {
            translations.push_back(latticeSteps(options)[static_cast<size_t>(axis)] * 289.0);
            translations.push_back(latticeSteps(options)[static_cast<size_t>(axis)] * (289.0 * 7001));
        }
    }
    for (const auto& t : translations) {
        int halfDiffers = 0;
        for (uint64_t k = 0; k < 1000; ++k) {
            const auto p = dyadic(randomPoint(cube<N>(20), 3, k));
            CAPTURE(t, p);
            const auto jet = noise.template at<2, double>(p);
            if (!same(jet, noise.template at<2, double>(p + t))) FAIL("not the same");
            // Also in float, since the lattice cell is subtracted in double.
            if (!same(noise.template at<2, float>(p), noise.template at<2, float>(p + t)))
                FAIL("not the same in float");
            halfDiffers += difference(jet, noise.template at<2, double>(p + t * 0.5)) > 1e-6;
        }
        CHECK(halfDiffers > 900);
    }
}

TEST_CASE("psrdnoise: hashes are exact although shaders round a product before its nearest integer", "[noise]") {
    const auto reduced = [](float k) {
        const volatile float product = k * (1.0f / 289);
        return k - 289 * std::nearbyint(product);
    };
    float greatest = 0;
    int wrong = 0;
    for (const float quadratic : {-34.0f, -17.0f, 17.0f, 34.0f})
        for (int linear = -144; linear <= 144; ++linear)
            for (int h = -449; h <= 449; ++h) {
                const auto x = static_cast<float>(h), k = (quadratic * x + static_cast<float>(linear)) * x;
                greatest = std::max(greatest, std::abs(k));
                wrong += std::abs(reduced(k)) > 144;
            }
    CHECK(wrong == 0);
    CHECK(greatest < 6.92e6f);
}

TEMPLATE_TEST_CASE_SIG("psrdnoise: float is as accurate far away as near the origin", "[noise]", ((int N), N), 2, 3) {
    auto options = GENERATE(from_range(variants<N>()));
    options.alpha = 1;
    options.seed = 4;
    const double far = GENERATE(0.0, 1e6, 1e9);
    CAPTURE(describe(options), far);
    const PsrdN<N> noise(options);
    std::array<WorstN<N>, 3> worst;
    for (auto p : randomPoints(cube<N>(50), samples(20000), 4)) {
        for (int axis = 0; axis < N; ++axis) p[axis] += far * (axis == 0 ? 1 : axis == 1 ? -1 : 0.5);
        const auto jet = noise.template at<2, double>(p);
        const auto single = noise.template at<2, float>(p);
        for (int k = 0; k < jet.kSize; ++k)
            worst[orderOf<N>(k)].see(std::abs(double(single.component(k)) - jet.component(k)), p);
    }
    for (size_t order = 0; order < 3; ++order) {
        CAPTURE(order, worst[order].value, worst[order].where);
        CHECK(worst[order].value < kFloatAccuracy[order]);
    }
}

TEMPLATE_TEST_CASE_SIG("psrdnoise: different seeds are uncorrelated", "[noise]", ((int N), N), 2, 3) {
    auto options = GENERATE(from_range(variants<N>()));
    CAPTURE(describe(options));
    constexpr size_t kCount = samples(100000);
    const auto points = randomPoints(cube<N>(500), kCount, 5);
    const auto valuesOf = [&](uint64_t seed) {
        options.seed = seed;
        const PsrdN<N> noise(options);
        std::vector<double> values;
        for (const auto& p : points) values.push_back(noise.template at<0, double>(p).value);
        return values;
    };
    const std::array<uint64_t, 5> seeds{0, 1, 2, 3, uint64_t{1} << 63};
    std::vector<std::vector<double>> values;
    for (const uint64_t seed : seeds) values.push_back(valuesOf(seed));
    CHECK(values[1] == valuesOf(1));
    for (size_t i = 0; i < seeds.size(); ++i) {
        const double square = sumOfProducts(values[i], values[i]);
        CHECK(std::sqrt(square / kCount) > 0.2); // not all zero
        for (size_t j = i + 1; j < seeds.size(); ++j) {
            const double related = correlation(values[i], values[j]);
            CAPTURE(seeds[i], seeds[j], related);
            // 4 sigma of independent samples (the box is much larger than a cell), plus the mean product of the
            // gradients over at most 289² equally likely pairs of hashes, each with variance 1/N.
            CHECK(std::abs(related) < 4 * std::sqrt(1.0 / kCount + 1.0 / (N * 289 * 289)));
        }
    }
}

TEMPLATE_TEST_CASE_SIG("psrdnoise: values stay within the bound and come close to it", "[noise]", ((int N), N), 2, 3) {
    // The field of each seed and alpha has other extremes.
    auto options = GENERATE(from_range(variants<N>()));
    CAPTURE(describe(options));
    constexpr size_t kCount = samples(1000000), kChunk = 10000;
    std::vector<double> largest((kCount + kChunk - 1) / kChunk);
    parallelFor(kCount, kChunk, [&](size_t begin, size_t end) {
        auto own = options;
        own.alpha = 0.1 * double(begin / kChunk);
        own.seed = begin / (10 * kChunk);
        const PsrdN<N> noise(own);
        for (size_t k = begin; k < end; ++k) {
            double& l = largest[begin / kChunk];
            l = std::max(l, std::abs(noise.template at<0, double>(randomPoint(cube<N>(1000), 6, k)).value));
        }
    });
    const double most = *std::max_element(largest.begin(), largest.end());
    CAPTURE(most);
    CHECK(most <= PsrdN<N>::kBound);
    CHECK(most > (kSanitized ? 0.8 : 0.95) * PsrdN<N>::kBound);
    CHECK(PsrdN<N>().maxAbs() == PsrdN<N>::kBound);
}

TEMPLATE_TEST_CASE_SIG("psrdnoise: the bound is the maximum over all vertex gradients", "[noise]", ((int N), N), 2, 3) {
    // At a point, each corner contributes at most 10.9 (0.8 - |d|²)⁴ |d| in 2D and 39.5 (0.5 - |d|²)³ |d| in 3D. The
    // maximum of the sum over the simplex is searched on a fine grid of barycentric coordinates. The published bound in
    // 3D is 39.5 · 0.026429.
    const auto options = GENERATE(from_range(variants<N>()));
    CAPTURE(describe(options));
    std::array<Vec<double, N>, N + 1> corners;
    for (size_t k = 0; k < N; ++k) corners[k + 1] = corners[k] + latticeSteps(options)[k];
    constexpr int kSteps = 60;
    double most = 0;
    for (int a = 0; a <= kSteps; ++a)
        for (int b = 0; a + b <= kSteps; ++b)
            for (int c = N == 2 ? kSteps - a - b : 0; a + b + c <= kSteps; ++c) {
                const std::array<double, 4> weights{double(a), double(b), double(c), double(kSteps - a - b - c)};
                Vec<double, N> p;
                for (size_t k = 0; k <= N; ++k) p += corners[k] * (weights[k] / kSteps);
                double sum = 0;
                for (const auto& corner : corners) {
                    const double d2 = dot(p - corner, p - corner), w = std::max((N == 2 ? 0.8 : 0.5) - d2, 0.0);
                    sum += (N == 2 ? 10.9 * w : 39.5) * w * w * w * std::sqrt(d2);
                }
                most = std::max(most, sum);
            }
    CAPTURE(most);
    CHECK(most <= PsrdN<N>::kBound);
    CHECK(most > 0.9999 * PsrdN<N>::kBound);
}

TEMPLATE_TEST_CASE_SIG("psrdnoise: is zero at its vertices", "[noise]", ((int N), N), 2, 3) {
    auto options = GENERATE(from_range(variants<N>()));
    options.alpha = 0.4;
    CAPTURE(describe(options));
    const PsrdN<N> noise(options);
    // There only the vertex's own gradient g contributes: |∇n| is the height of the kernel. |g| = 1 up to the eight
    // published digits of its constants.
    const double steepness = N == 2 ? 10.9 * 0.8 * 0.8 * 0.8 * 0.8 : 39.5 / 8;
    // Vertices of Perlin's grid are rounded, at coordinates of up to 100.
    const double tolerance = onPerlinGrid(options) ? 8 * 100 * 0x1p-52 : 0;
    WorstN<N> value, slope;
    for (uint64_t k = 0; k < 1000; ++k) {
        auto u = randomPoint(cube<N>(50), 7, k);
        for (double& x : u.c) x = std::floor(x);
        const auto jet = noise.template at<1, double>(fromSimplex(options, u));
        value.see(std::abs(jet.value), u);
        slope.see(std::abs(length(jet.gradient) - steepness), u);
    }
    CAPTURE(value.value, value.where, slope.value, slope.where);
    CHECK(value.value <= tolerance);
    CHECK(slope.value < 1e-8);
}

TEMPLATE_TEST_CASE_SIG("psrdnoise: each seed shifts the lattice to different vertices", "[noise]", ((int N), N), 2, 3) {
    // If all seeds had the same lattice, all would be zero at the vertices of seed 0, and their flow would be fastest
    // there.
    auto options = GENERATE(from_range(variants<N>()));
    for (const uint64_t seed : {1, 2, 3}) {
        options.seed = seed;
        const PsrdN<N> noise(options);
        double squares = 0;
        for (uint64_t k = 0; k < 1000; ++k) {
            auto u = randomPoint(cube<N>(50), 7, k);
            for (double& x : u.c) x = std::floor(x);
            const double value = noise.template at<0, double>(fromSimplex(options, u)).value;
            squares += value * value;
        }
        CAPTURE(describe(options), squares);
        CHECK(squares > 1000 * 0.01); // an rms of 0.1; the noise itself has 0.38 and more
    }
}

TEMPLATE_TEST_CASE_SIG("psrdnoise: NaN and infinite and huge positions are safe", "[noise]", ((int N), N), 2, 3) {
    constexpr double kInfinity = std::numeric_limits<double>::infinity(), kMax = std::numeric_limits<double>::max();
    auto options = GENERATE(from_range(variants<N>()));
    options.alpha = 0.7;
    options.seed = 2;
    const std::array<int, 3> period =
        GENERATE(std::array<int, 3>{}, std::array<int, 3>{4, 6, 3}, std::array<int, 3>{1 << 30, 1, 0});
    for (size_t axis = 0; axis < N; ++axis) options.period.c[axis] = period[axis];
    CAPTURE(describe(options));
    const PsrdN<N> noise(options);
    const std::array<double, 14> values{0,     -0.0,   std::nan(""), kInfinity, -kInfinity, kMax,   -kMax,
                                        1e300, -1e300, 1e18,         -1e15,     0x1p53,     1e-320, 0.25};
    double sum = 0;
    WorstN<N> worst;
    for (size_t k = 0; k < 14 * 14 * (N == 2 ? 1 : 14); ++k) {
        Vec<double, N> p;
        bool sane = true;
        for (size_t axis = 0, index = k; axis < N; ++axis, index /= 14) {
            p.c[axis] = values[index % 14];
            sane &= std::abs(p.c[axis]) < 0x1p50;
        }
        const auto jet = noise.template at<2, double>(p);
        const auto single = noise.template at<2, float>(p);
        for (int c = 0; c < jet.kSize; ++c) sum += jet.component(c) + double(single.component(c));
        // Where lattice cells are well defined, the value is within the bound.
        if (sane) worst.see(std::abs(jet.value), p);
    }
    CHECK(!(sum == 1)); // uses the sum
    CAPTURE(worst.where);
    CHECK(worst.value <= PsrdN<N>::kBound);
}

TEMPLATE_TEST_CASE_SIG("psrdnoise: is C² across simplex faces", "[noise]", ((int N), N), 2, 3) {
    auto options = GENERATE(from_range(variants<N>()));
    options.alpha = 1.2;
    // With seed 0, the lattice is where fromSimplex puts it.
    CAPTURE(describe(options));
    const PsrdN<N> noise(options);
    constexpr double kStep = 0x1p-40;
    std::array<WorstN<N>, 3> jump;
    for (uint64_t k = 0; k < 3000; ++k) {
        auto u = dyadic(randomPoint(cube<N>(50), 8, k));
        // Faces are where a simplex coordinate is whole, or where two have the same fractional part.
        const int i = static_cast<int>(k / 2 % N), j = (i + 1) % N;
        u[i] = k % 2 ? std::floor(u[i]) : std::floor(u[i]) + (u[j] - std::floor(u[j]));
        auto low = u, high = u;
        low[i] -= kStep;
        high[i] += kStep;
        const auto a = noise.template at<2, double>(fromSimplex(options, low)),
                   b = noise.template at<2, double>(fromSimplex(options, high));
        for (int c = 0; c < a.kSize; ++c) jump[orderOf<N>(c)].see(std::abs(a.component(c) - b.component(c)), u);
    }
    // A distance of at most 2.3 kStep, possibly oblique, times the next derivative.
    for (size_t order = 0; order < 3; ++order) {
        CAPTURE(order, jump[order].value, jump[order].where);
        CHECK(jump[order].value < 2.3 * kStep * kSteepest<N>[order] * 2);
    }
}

TEMPLATE_TEST_CASE_SIG("psrdnoise: gradient and Hessian agree with central differences", "[noise]", ((int N), N), 2,
                       3) {
    auto options = GENERATE(from_range(variants<N>()));
    const bool plain = GENERATE(true, false);
    if (!plain) {
        for (int axis = 0; axis < N; ++axis) options.period[axis] = 4 + axis;
        options.alpha = 0.7;
        options.seed = 3;
    }
    CAPTURE(describe(options));
    requireDerivatives(PsrdN<N>(options), randomPoints(cube<N>(30), 2000, 9), 0x1p-9, kSteepest<N>[2]);
}

TEMPLATE_TEST_CASE_SIG("psrdnoise: rotating gradients by a full turn changes nothing and by half a turn the sign",
                       "[noise]", ((int N), N), 2, 3) {
    auto options = GENERATE(from_range(variants<N>()));
    options.seed = 1;
    const double alpha = GENERATE(0.0, 0.7, -3.1);
    CAPTURE(describe(options), alpha);
    const auto turned = [&](double by) {
        options.alpha = alpha + by;
        return PsrdN<N>(options);
    };
    constexpr double kPi = std::numbers::pi;
    const PsrdN<N> noise = turned(0), full = turned(2 * kPi), half = turned(kPi);
    WorstN<N> worst, worstHalf;
    for (const auto& p : randomPoints(cube<N>(30), samples(5000), 10)) {
        const auto jet = noise.template at<2, double>(p);
        worst.see(difference(jet, full.template at<2, double>(p)), p);
        worstHalf.see(difference(-jet, half.template at<2, double>(p)), p);
    }
    // The angle including the hash is below 64. Its rounding is multiplied by the second derivatives.
    const double tolerance = 64 * 0x1p-52 * kSteepest<N>[1] * 2;
    CHECK(worst.value < tolerance);
    CHECK(worstHalf.value < tolerance);
}

TEST_CASE("psrdnoise: the two grids and two rotations give four different noises", "[noise]") {
    const double alpha = GENERATE(0.0, 0.7); // fast rotation by zero differs from the default noise
    std::vector<Psrd3> noises;
    for (PsrdOptions options : variants<3>()) {
        options.alpha = alpha;
        noises.emplace_back(options);
    }
    for (size_t i = 0; i < noises.size(); ++i)
        for (size_t j = 0; j < i; ++j) {
            double square = 0;
            const auto points = randomPoints(cube(30), 1000, 11);
            for (const Vec3d& p : points)
                square += std::pow(noises[i].at<0, double>(p).value - noises[j].at<0, double>(p).value, 2);
            CAPTURE(alpha, i, j);
            // Independent noises with an rms of 0.38 would differ by 0.54.
            CHECK(std::sqrt(square / double(points.size())) > 0.4);
        }
}

TEST_CASE("psrdnoise: a negative period or non-finite alpha is rejected by its value", "[noise]") {
    CHECK_THROWS_AS(Psrd3({.period = {{0, -2, 0}}}), ValueError);
    CHECK_THROWS_WITH(Psrd3({.period = {{0, -2, 0}}}), Catch::ContainsSubstring("-2 along y"));
    CHECK_THROWS_WITH(Psrd2({.period = {{-3, 0}}}), Catch::ContainsSubstring("-3 along x"));
    for (const double bad : {std::numeric_limits<double>::infinity(), std::nan("")}) {
        CHECK_THROWS_AS(Psrd2({.alpha = bad}), ValueError);
        CHECK_THROWS_WITH(Psrd3({.alpha = bad}), Catch::ContainsSubstring("alpha"));
    }
}

TEMPLATE_TEST_CASE_SIG("psrdnoise: third derivatives agree with central differences of the Hessian", "[noise]",
                       ((int N), N), 2, 3) {
    auto options = GENERATE(from_range(variants<N>()));
    const bool plain = GENERATE(true, false);
    if (!plain) {
        for (int axis = 0; axis < N; ++axis) options.period[axis] = 4 + axis;
        options.alpha = 0.7;
        options.seed = 3;
    }
    CAPTURE(describe(options));
    const PsrdN<N> noise(options);
    const auto points = randomPoints(cube<N>(30), 500, 10);
    // Where a corner comes into reach, third derivatives have a kink (2D) or jump (3D). In 3D these are spheres of area
    // 2 pi around two vertices per unit of volume. Stencils of width 2 h along three axes intersect them with a
    // probability of 12 pi h = 0.9 %. In 2D there are fewer.
    requireThirdDerivatives(noise, points, 0x1p-12, 0.02);
    for (const auto& p : points) {
        CAPTURE(p);
        REQUIRE(difference(truncated<2>(noise.template at<3, double>(p)), noise.template at<2, double>(p)) == 0);
    }
}

TEST_CASE("psrdnoise: is C³ in 2D", "[noise]") {
    // If the third derivatives jumped, the error of the differences would remain for any step. The fourth ones jump
    // where a corner comes into reach: w⁴ by 4! (2 r)⁴, times the scale 10.9, with r² = 0.8 and a ramp of at most r.
    const double jump = 10.9 * 24 * std::pow(2 * std::sqrt(0.8), 4) * std::sqrt(0.8);
    constexpr double kStep = 0x1p-14;
    double worst = 0;
    for (const double error : thirdDerivativeErrors(Psrd2(), randomPoints(cube<2>(5), samples(20000), 11), kStep))
        worst = std::max(worst, error);
    CHECK(worst <= jump * kStep);
}
