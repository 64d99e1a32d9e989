// SPDX-License-Identifier: Apache-2.0
// Longer than 400 lines: seven dimensions, each with its own reference values.
#include "curlew/base/Error.h"
#include "curlew/noise/SimplexNoise.h"
#include "support/FiniteDifference.h"
#include "support/Reference.h"
#include "support/Samples.h"
#include "support/Statistics.h"

#include <limits>

using namespace curlew;
using namespace curlew::test;

namespace {

constexpr SimplexKernel kSmooth = SimplexKernel::smooth, kCorners = SimplexKernel::corners,
                        kPublished = SimplexKernel::published, kContinuous = SimplexKernel::publishedContinuous;

// Bounds of the components of the first, second and third derivatives. The observed maxima among 6·10^5 points, for all
// N and both powers, are 6.7, 53 and 524.
constexpr double kFirst = 10, kSecond = 70, kThird = 700;

/// The accuracy in float that the header states: value, gradient, Hessian.
constexpr std::array<double, 3> kFloat{2e-6, 1e-5, 1e-4};

/// Returns the order of the derivative in component k of a jet.
size_t orderOf(int k, int dimensions) { return k == 0 ? 0 : k <= dimensions ? 1 : 2; }

/// Returns the position of skewed coordinates, in which the vertices of the lattice are the integer points.
template <int N>
Vec<double, N> fromSkewed(const Vec<double, N>& y) {
    double sum = 0;
    for (const double c : y.c) sum += c;
    Vec<double, N> x = y;
    for (double& c : x.c) c -= sum * (1 - 1 / std::sqrt(N + 1.0)) / N;
    return x;
}
template <int N>
Vec<double, N> toSkewed(const Vec<double, N>& x) {
    double sum = 0;
    for (const double c : x.c) sum += c;
    Vec<double, N> y = x;
    for (double& c : y.c) c += sum * (std::sqrt(N + 1.0) - 1) / N;
    return y;
}
template <int N>
Vec<double, N> floorOf(Vec<double, N> y) {
    for (double& c : y.c) c = std::floor(c);
    return y;
}

/// Returns all vertices within √r2 <= √(3/4) of a position, in skewed coordinates. Any two of the N+1 homogeneous
/// coordinates of the difference, of which the last is 0, differ by at most √(2 r2) < 1.23. So the vertices are at -1 …
/// 2 from the cell.
template <int N>
std::vector<Vec<double, N>> verticesWithin(const Vec<double, N>& x, double r2) {
    const Vec<double, N> cell = floorOf(toSkewed(x));
    std::vector<Vec<double, N>> vertices;
    for (int code = 0; code < 1 << (2 * N); ++code) {
        Vec<double, N> c = cell;
        for (int i = 0; i < N; ++i) c[i] += (code >> (2 * i)) % 4 - 1;
        const Vec<double, N> d = x - fromSkewed(c);
        if (dot(d, d) < r2) vertices.push_back(c);
    }
    return vertices;
}

double squaredRadius(SimplexKernel kernel, int dimensions) { return kernel == kSmooth && dimensions > 5 ? 0.75 : 0.5; }

/// Returns the factor of the kernel's sum with unit gradients. At a vertex, only its own gradient contributes.
template <int N>
double factorOf(int power, SimplexKernel kernel) {
    const SimplexNoise<N> noise({.power = power, .kernel = kernel});
    return length(noise.template at<1, double>({}).gradient) / std::pow(squaredRadius(kernel, N), power);
}

/// Returns the gradient of a vertex by the table and formula of the reference file.
template <int N>
Vec<double, N> publishedGradient(const nlohmann::json& file, const Vec<double, N>& c) {
    const auto& table = file.at("gradients");
    auto index = file.at("seed_hash").get<int64_t>();
    for (int i = 0; i < N; ++i) index += static_cast<int64_t>(c[i]) * (int64_t{1} << (5 * i % 16));
    const uint64_t hash = simplexHash(static_cast<uint64_t>(index));
    Vec<double, N> g;
    for (size_t i = 0; i < N; ++i) g.c[i] = table.at(hash % table.size()).at(i).template get<double>();
    return g;
}

template <int N>
void checkAgainst(const nlohmann::json& file) {
    const std::array<SimplexNoise<N>, 2> noises{SimplexNoise<N>({.kernel = kPublished}),
                                                SimplexNoise<N>({.kernel = kContinuous})};
    std::array<std::array<WorstN<N>, 2>, 2> worst, worstFloat;
    for (const auto& row : file.at("rows")) {
        const auto number = [&](size_t k) { return row.at(k).template get<double>(); };
        Vec<double, N> x;
        for (size_t i = 0; i < N; ++i) x.c[i] = number(1 + i);
        for (size_t kernel = 0; kernel < 2; ++kernel) {
            const auto jet = noises[kernel].template at<1, double>(x);
            const auto single = noises[kernel].template at<1, float>(x);
            for (int k = 0; k <= N; ++k) {
                const double expected = number(1 + N + kernel * (N + 1) + static_cast<size_t>(k));
                const size_t order = orderOf(k, N);
                worst[kernel][order].see(std::abs(jet.component(k) - expected), x);
                worstFloat[kernel][order].see(std::abs(double(single.component(k)) - expected), x);
            }
        }
    }
    CHECK(file.at("rows").size() >= 20);
    for (size_t kernel = 0; kernel < 2; ++kernel)
        for (size_t order = 0; order < 2; ++order) {
            const auto& w = worst[kernel][order];
            const auto& f = worstFloat[kernel][order];
            CAPTURE(kernel, order, w.value, w.where, f.value, f.where);
            // A few roundings of coordinates of up to 30, times the next derivative.
            CHECK(w.value <= 1e-12);
            CHECK(f.value <= kFloat[order]);
        }
}

/// Checks that each vertex has the published gradient, using the gradient of the noise there.
template <int N>
void checkGradients(const nlohmann::json& file) {
    const SimplexNoise<N> noise({.kernel = kContinuous});
    WorstN<N> worst;
    for (uint64_t k = 0; k < 5000; ++k) {
        const Vec<double, N> c = floorOf(randomPoint(cube<N>(k < 2500 ? 10 : 1e6), 21, k));
        const Vec<double, N> g = publishedGradient(file, c) * (file.at("value_scaler").get<double>() / 16);
        worst.see(length(noise.template at<1, double>(fromSkewed(c)).gradient - g), c);
    }
    CAPTURE(worst.value, worst.where);
    // Roundings of coordinates of up to 10^6, times the second derivatives.
    CHECK(worst.value < 1e6 * 0x1p-52 * kSecond * 10);
}

/// Checks that the noise is the sum over all vertices within its radius.
template <int N>
void checkSum(const nlohmann::json& file, const SimplexOptions& options) {
    CAPTURE(options.power, static_cast<int>(options.kernel));
    const SimplexNoise<N> noise(options);
    const double r2 = squaredRadius(options.kernel, N);
    const double scale = factorOf<N>(options.power, options.kernel) / std::sqrt(N - 1.0);
    WorstN<N> worst;
    for (const Vec<double, N>& x : randomPoints(cube<N>(50), 200, 22)) {
        Jet<double, N, 2> sum;
        for (const Vec<double, N>& c : verticesWithin(x, r2)) {
            // The contribution as a formula on jets.
            const Vec<double, N> g = publishedGradient(file, c), vertex = fromSkewed(c);
            Jet<double, N, 2> w(r2), ramp;
            for (int i = 0; i < N; ++i) {
                const auto d = Jet<double, N, 2>::variable(x[i] - vertex[i], i);
                w -= d * d;
                ramp += d * g[i];
            }
            sum += (options.power == 4 ? w : Jet<double, N, 2>(1)) * w * w * w * ramp;
        }
        worst.see(difference(noise.template at<2, double>(x), sum * scale), x);
    }
    CAPTURE(worst.value, worst.where);
    CHECK(worst.value < 1e-11); // roundings of coordinates of up to 150, times kThird
}

} // namespace

TEMPLATE_TEST_CASE_SIG("SimplexNoise: agrees with published values and sums over all vertices in reach", "[noise]",
                       ((int N), N), 2, 3, 4, 5, 6, 7) {
    const auto file = reference("macomber_simplex" + std::to_string(N) + ".json");
    checkAgainst<N>(file);
    checkGradients<N>(file);
    for (const int power : {3, 4})
        for (const SimplexKernel kernel : {kSmooth, kCorners}) checkSum<N>(file, {power, kernel});
}

TEMPLATE_TEST_CASE_SIG("SimplexNoise: up to five dimensions differs from the published one by a constant factor",
                       "[noise]", ((int N), N), 2, 3, 4, 5) {
    const SimplexNoise<N> smooth, corners({.kernel = kCorners}), published({.kernel = kContinuous});
    const double scaler = std::pow(N - 1.0, -3.5) * 100 + 13; // simplex.py, without the length of the gradients
    const double ratio = factorOf<N>(4, kSmooth) / scaler;
    WorstN<N> worst;
    for (const Vec<double, N>& x : randomPoints(cube<N>(50), 5000, 1)) {
        const auto jet = smooth.template at<2, double>(x);
        worst.see(difference(jet, published.template at<2, double>(x) * ratio), x);
        if (difference(jet, corners.template at<2, double>(x)) != 0) FAIL("not the same");
    }
    CAPTURE(ratio, worst.value, worst.where);
    CHECK(worst.value < 100 * 0x1p-52 * kSecond); // rounding of the ratio and of the products with it
}

TEMPLATE_TEST_CASE_SIG("SimplexNoise: the normalization is the maximum over all vertex gradients", "[noise]",
                       ((int N), N), 2, 3, 4, 5, 6, 7) {
    const int power = GENERATE(3, 4);
    const SimplexKernel kernel = GENERATE(kSmooth, kCorners);
    CAPTURE(power, static_cast<int>(kernel));
    const double factor = factorOf<N>(power, kernel), r2 = squaredRadius(kernel, N);
    const auto sum = [&](const Vec<double, N>& x) {
        double s = 0;
        for (const Vec<double, N>& c : verticesWithin(x, r2)) {
            const double d2 = dot(x - fromSkewed(c), x - fromSkewed(c));
            s += std::pow(r2 - d2, power) * std::sqrt(d2);
        }
        return s;
    };
    double most = 0;
    // Along a shortest edge, along the line to the centre of a triangle, and at random positions in the cell.
    for (int k = 0; k <= 400; ++k) {
        Vec<double, N> y;
        y[0] = k * (0.5 / 400);
        most = std::max(most, sum(fromSkewed(y)));
        if (N > 2) continue;
        y[0] = k * (2.0 / 3 / 400);
        y[1] = y[0] / 2;
        most = std::max(most, sum(fromSkewed(y)));
    }
    for (uint64_t k = 0; k < 200; ++k) most = std::max(most, sum(fromSkewed(randomPoint(cube<N>(0.5), 2, k))));
    CAPTURE(factor, factor * most);
    CHECK(factor * most <= 1 + 1e-12); // roundings of factorOf
    CHECK(factor * most > 1 - 1e-5);   // the steps of the search
    if (kernel == kSmooth) CHECK(SimplexNoise<N>({power}).maxAbs() == 1);
}

TEMPLATE_TEST_CASE_SIG("SimplexNoise: values stay within the bound and come close to it", "[noise]", ((int N), N), 2, 3,
                       4, 5, 6, 7) {
    struct Case {
        SimplexOptions options;
        double reached; // in the worst dimension
    };
    const auto c = GENERATE(Case{{}, 0.65}, Case{{.power = 3, .seed = 1}, 0.5}, Case{{.kernel = kCorners}, 0.85},
                            Case{{.kernel = kPublished}, 0.5}, Case{{.kernel = kContinuous, .seed = 2}, 0.8});
    const SimplexNoise<N> noise(c.options);
    WorstN<N> most, mostFloat;
    for (uint64_t k = 0; k < samples(300000); ++k) {
        const Vec<double, N> x = randomPoint(cube<N>(1000), 3, k);
        most.see(std::abs(noise.template at<0, double>(x).value), x);
        if (k < samples(50000)) mostFloat.see(std::abs(double(noise.template at<0, float>(x).value)), x);
    }
    CAPTURE(c.options.power, static_cast<int>(c.options.kernel), most.value, most.where, noise.maxAbs());
    CHECK(most.value <= noise.maxAbs());
    if (!kSanitized) CHECK(most.value > c.reached * noise.maxAbs()); // that takes all samples
    CHECK(mostFloat.value <= noise.maxAbs() + kFloat[0]);
}

TEMPLATE_TEST_CASE_SIG("SimplexNoise: value and derivatives are continuous across simplex faces", "[noise]",
                       ((int N), N), 2, 3, 4, 5, 6, 7) {
    const SimplexOptions options = GENERATE(SimplexOptions{}, SimplexOptions{.power = 3},
                                            SimplexOptions{.kernel = kCorners}, SimplexOptions{.kernel = kContinuous});
    CAPTURE(options.power, static_cast<int>(options.kernel));
    const SimplexNoise<N> noise(options);
    constexpr double kStep = 0x1p-40;
    std::array<WorstN<N>, 3> jump;
    for (uint64_t k = 0; k < 3000; ++k) {
        Vec<double, N> y = randomPoint(cube<N>(50), 4, k);
        // Faces are where a skewed coordinate is whole, or where two have the same fractional part.
        const int i = static_cast<int>(k % N), j = (i + 1) % N;
        y[i] = k / N % 2 ? std::floor(y[i]) : std::floor(y[i]) + (y[j] - std::floor(y[j]));
        Vec<double, N> low = y, high = y;
        low[i] -= kStep;
        high[i] += kStep;
        const auto a = noise.template at<2, double>(fromSkewed(low)),
                   b = noise.template at<2, double>(fromSkewed(high));
        jump[0].see(difference(a, b, 0, 1), y);
        jump[1].see(difference(a, b, 1, 1 + N), y);
        jump[2].see(difference(a, b, 1 + N, a.kSize), y);
    }
    // 2 kStep times the next derivative, in a direction with up to N components.
    CAPTURE(jump[0].value, jump[1].value, jump[2].value, jump[2].where);
    CHECK(jump[0].value < 2 * kStep * kFirst * std::sqrt(N));
    CHECK(jump[1].value < 2 * kStep * kSecond * std::sqrt(N));
    CHECK(jump[2].value < 2 * kStep * kThird * std::sqrt(N));
}

TEMPLATE_TEST_CASE_SIG("SimplexNoise: the published kernel is discontinuous from three dimensions on", "[noise]",
                       ((int N), N), 2, 3, 7) {
    const SimplexNoise<N> noise({.kernel = kPublished});
    double jump = 0;
    for (uint64_t k = 0; k < 3000; ++k) {
        Vec<double, N> low = randomPoint(cube<N>(50), 5, k), high = low;
        low[0] = std::floor(low[0]) - 1e-9;
        high[0] = low[0] + 2e-9;
        jump = std::max(jump, std::abs(noise.template at<0, double>(fromSkewed(low)).value -
                                       noise.template at<0, double>(fromSkewed(high)).value));
    }
    CAPTURE(jump);
    CHECK((N == 2 ? jump < 2e-9 * kFirst * 2 : jump > 0.01));
}

TEMPLATE_TEST_CASE_SIG("SimplexNoise: gradient and Hessian agree with central differences", "[noise]", ((int N), N), 2,
                       3, 4, 5, 6, 7) {
    const SimplexOptions options =
        GENERATE(SimplexOptions{}, SimplexOptions{.power = 3, .seed = 3}, SimplexOptions{.kernel = kCorners, .seed = 4},
                 SimplexOptions{.kernel = kContinuous});
    CAPTURE(options.power, static_cast<int>(options.kernel));
    requireDerivatives(SimplexNoise<N>(options), randomPoints(cube<N>(30), 1000, 6), 0x1p-9, kThird);
}

TEMPLATE_TEST_CASE_SIG("SimplexNoise: the smooth kernel covers regions that the corners kernel leaves empty", "[noise]",
                       ((int N), N), 6, 7) {
    const int power = GENERATE(3, 4);
    CAPTURE(power);
    constexpr int kCount = samples(100000);
    const SimplexNoise<N> smooth({.power = power}), corners({.power = power, .kernel = kCorners});
    double least = 1e9, square = 0;
    int empty = 0;
    for (uint64_t k = 0; k < kCount; ++k) {
        const Vec<double, N> x = randomPoint(cube<N>(1000), 7, k);
        const double g = length(smooth.template at<1, double>(x).gradient);
        least = std::min(least, g);
        square += g * g;
        empty += length(corners.template at<1, double>(x).gradient) == 0;
    }
    const double rms = std::sqrt(square / kCount), fraction = double(empty) / kCount;
    CAPTURE(least, rms, fraction);
    // The observed minimum among 10^6 points with random gradients is 0.0075 of the rms gradient.
    CHECK(least > 0.003 * rms);
    // The share of space at a distance above √(1/2) from all vertices, by integration: 1.75 and 18.4 %.
    const double expected = N == 6 ? 0.0175 : 0.184;
    CHECK(std::abs(fraction - expected) < 4 * std::sqrt(expected / kCount) + 0.0005);
}

TEMPLATE_TEST_CASE_SIG("SimplexNoise: the deepest holes of the lattice have a gradient", "[noise]", ((int N), N), 6,
                       7) {
    // The points at the greatest distance from all vertices: N+1 of them are at the covering radius. In skewed
    // coordinates, k/(N+1).
    const SimplexNoise<N> noise;
    int nonzero = 0;
    for (uint64_t k = 0; k < 300; ++k) {
        Vec<double, N> y = floorOf(randomPoint(cube<N>(50), 8, k));
        for (int i = 0; i < N; ++i) y[i] += double(i + 1) / (N + 1);
        REQUIRE(verticesWithin(fromSkewed(y), N * (N + 2) / (12.0 * (N + 1)) - 1e-9).empty());
        nonzero += length(noise.template at<1, double>(fromSkewed(y)).gradient) > 1e-3;
    }
    CHECK(nonzero > 295);
}

TEMPLATE_TEST_CASE_SIG("SimplexNoise: different seeds are uncorrelated", "[noise]", ((int N), N), 2, 3, 4, 5, 6, 7) {
    constexpr size_t kCount = samples(50000);
    const std::array<uint64_t, 5> seeds{0, 1, 2, 3, uint64_t{1} << 63};
    // The box is so large that vertices hardly ever coincide modulo the period of the published hash.
    const auto points = randomPoints(cube<N>(1e5), kCount, 9);
    std::vector<std::vector<double>> values;
    for (const uint64_t seed : seeds) {
        const SimplexNoise<N> noise({.seed = seed}), again({.seed = seed});
        values.emplace_back();
        for (const auto& x : points) values.back().push_back(noise.template at<0, double>(x).value);
        CHECK(noise.template at<0, double>(points[0]).value == again.template at<0, double>(points[0]).value);
    }
    for (size_t i = 0; i < seeds.size(); ++i) {
        const double square = sumOfProducts(values[i], values[i]);
        CHECK(std::sqrt(square / kCount) > 0.08); // not all zero
        for (size_t j = i + 1; j < seeds.size(); ++j) {
            const double related = correlation(values[i], values[j]);
            CAPTURE(seeds[i], seeds[j], related);
            CHECK(std::abs(related) < 4 / std::sqrt(double(kCount))); // 4 sigma of independent samples
        }
    }
}

TEMPLATE_TEST_CASE_SIG("SimplexNoise: different seeds share no vertices", "[noise]", ((int N), N), 2, 3, 4, 5, 6, 7) {
    // Where seed 0 has a vertex it is 0 up to rounding; the other seeds are not.
    const SimplexNoise<N> published;
    double zero = 0, least = 1e9;
    for (uint64_t seed = 1; seed <= 50; ++seed) {
        const SimplexNoise<N> noise({.seed = seed});
        double most = 0;
        for (uint64_t k = 0; k < 50; ++k) {
            const Vec<double, N> x = fromSkewed(floorOf(randomPoint(cube<N>(50), 10, k)));
            zero = std::max(zero, std::abs(published.template at<0, double>(x).value));
            most = std::max(most, std::abs(noise.template at<0, double>(x).value));
        }
        least = std::min(least, most);
    }
    CAPTURE(zero, least);
    CHECK(zero < 1e-12);
    CHECK(least > 1e-6);
}

TEMPLATE_TEST_CASE_SIG("SimplexNoise: repeats with the published hash and stays accurate far away", "[noise]",
                       ((int N), N), 2, 3, 4, 5, 6, 7) {
    // The program computes the index of a vertex c as Σ c_i 2^(5i mod 16) and uses 24 bits of it.
    Vec<double, N> step;
    step[N < 5 ? 0 : 4 % N] = N < 5 ? 32 : 2;
    step[1] = -1;
    const double times = GENERATE(1.0, -3.0, 1e5);
    CAPTURE(times);
    const SimplexNoise<N> noise, seeded({.seed = 11});
    std::array<WorstN<N>, 3> worst;
    int same = 0;
    for (const Vec<double, N>& x : randomPoints(cube<N>(20), 3000, 11)) {
        const Vec<double, N> far = x + fromSkewed(step * times);
        const auto jet = noise.template at<2, double>(x), moved = noise.template at<2, double>(far);
        for (int k = 0; k < jet.kSize; ++k)
            worst[orderOf(k, N)].see(std::abs(jet.component(k) - moved.component(k)), x);
        same += std::abs(seeded.template at<0, double>(x).value - seeded.template at<0, double>(far).value) < 1e-9;
    }
    // Roundings of coordinates of this size, times the next derivative.
    const double rounding = 0x1p-52 * (100 + length(step) * std::abs(times)) * 2 * N;
    CAPTURE(rounding, worst[0].value, worst[1].value, worst[2].value);
    CHECK(worst[0].value < rounding * kFirst);
    CHECK(worst[1].value < rounding * kSecond);
    CHECK(worst[2].value < rounding * kThird);
    CHECK(same < 150); // where all vertices nearby have the same few gradients by chance
}

TEMPLATE_TEST_CASE_SIG("SimplexNoise: float is as accurate far away as near the origin", "[noise]", ((int N), N), 2, 3,
                       4, 5, 6, 7) {
    const double far = GENERATE(0.0, 1e6, 1e9);
    const SimplexOptions options =
        GENERATE(SimplexOptions{}, SimplexOptions{.power = 3, .seed = 5}, SimplexOptions{.kernel = kPublished});
    CAPTURE(far, options.power, static_cast<int>(options.kernel));
    const SimplexNoise<N> noise(options);
    std::array<WorstN<N>, 3> worst;
    for (Vec<double, N> x : randomPoints(cube<N>(50), 5000, 13)) {
        for (int i = 0; i < N; ++i) x[i] += i % 2 ? -far : far / (i + 1);
        const auto jet = noise.template at<2, double>(x);
        const auto single = noise.template at<2, float>(x);
        for (int k = 0; k < jet.kSize; ++k)
            worst[orderOf(k, N)].see(std::abs(jet.component(k) - double(single.component(k))), x);
    }
    CAPTURE(worst[0].value, worst[1].value, worst[2].value);
    for (size_t order = 0; order < 3; ++order) CHECK(worst[order].value < kFloat[order]);
}

TEMPLATE_TEST_CASE_SIG("SimplexNoise: NaN and infinite and huge positions are safe", "[noise]", ((int N), N), 2, 3, 7) {
    constexpr double kInfinity = std::numeric_limits<double>::infinity(), kMax = std::numeric_limits<double>::max();
    const std::array<double, 14> values{0,     -0.0,   std::nan(""), kInfinity, -kInfinity, kMax,   -kMax,
                                        1e300, -1e300, 1e18,         -1e15,     0x1p53,     1e-320, 0.25};
    const SimplexKernel kernel = GENERATE(kSmooth, kPublished);
    const SimplexNoise<N> noise({.kernel = kernel, .seed = 2});
    int wrong = 0;
    for (uint64_t k = 0; k < samples(20000); ++k) {
        Vec<double, N> x;
        double size = 0;
        for (int i = 0; i < N; ++i) {
            x[i] = values[randomBits(12, k, static_cast<uint64_t>(i)) % (k % 2 ? values.size() : 2)];
            if (i == static_cast<int>(k % N)) x[i] = values[k / N % values.size()];
            size = std::max(size, std::isnan(x[i]) ? kInfinity : std::abs(x[i]));
        }
        const auto jet = noise.template at<2, double>(x);
        const auto single = noise.template at<2, float>(x);
        // Infinite positions give NaN; elsewhere the value is within the bound.
        if (size == kInfinity)
            wrong += !std::isnan(jet.value) || !std::isnan(single.value) || !std::isnan(jet.hessian.c[0]);
        else if (size < 1e300)
            wrong += !(std::abs(jet.value) <= noise.maxAbs()) || !(std::abs(double(single.value)) <= noise.maxAbs());
    }
    CHECK(wrong == 0);
}

TEST_CASE("SimplexNoise: unsupported powers are rejected by value", "[noise]") {
    CHECK_THROWS_AS(SimplexNoise<3>({.power = 2}), ValueError);
    CHECK_THROWS_AS(SimplexNoise<7>({.power = 5}), ValueError);
    CHECK_THROWS_AS(SimplexNoise<4>({.power = 3, .kernel = kPublished}), ValueError);
    CHECK_THROWS_WITH(SimplexNoise<4>({.power = 3, .kernel = kContinuous}), Catch::ContainsSubstring("power 3"));
}

TEMPLATE_TEST_CASE_SIG("SimplexNoise: third derivatives agree with central differences of the Hessian", "[noise]",
                       ((int N), N), 2, 3, 4, 6) {
    const SimplexOptions options =
        GENERATE(SimplexOptions{}, SimplexOptions{.power = 3}, SimplexOptions{.power = 3, .seed = 3});
    CAPTURE(N, options.power, options.seed);
    const SimplexNoise<N> noise(options);
    const auto points = randomPoints(cube<N>(10), 300, 11);
    // Where a vertex comes into reach, the third derivatives have a kink (power 4) or a jump. With this step, a few
    // stencils in a thousand straddle such a sphere, in 6D a few in a hundred.
    requireThirdDerivatives(noise, points, 0x1p-12, N == 6 ? 0.08 : 0.02);
    for (const auto& p : points) {
        CAPTURE(p);
        REQUIRE(difference(truncated<2>(noise.template at<3, double>(p)), noise.template at<2, double>(p)) == 0);
    }
}

TEMPLATE_TEST_CASE_SIG("SimplexNoise: power 4 is C³", "[noise]", ((int N), N), 2, 3, 4) {
    // If the third derivatives jumped, the error of the differences would remain for any step. The fourth ones jump
    // where a vertex comes into reach: w⁴ by 4! (2 r)⁴ with r² = 1/2, times a ramp of at most r and the scale, below
    // 109.
    constexpr double kJump = 109 * 24 * 4 * 0.71, kStep = 0x1p-14;
    double worst = 0;
    for (const double error :
         thirdDerivativeErrors(SimplexNoise<N>(), randomPoints(cube<N>(5), samples(N == 4 ? 3000 : 10000), 12), kStep))
        worst = std::max(worst, error);
    CHECK(worst <= kJump * kStep);
}
