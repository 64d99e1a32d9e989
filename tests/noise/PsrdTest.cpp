#include "curlew/base/Error.h"
#include "curlew/base/Parallel.h"
#include "curlew/noise/Psrd.h"
#include "support/FiniteDifference.h"
#include "support/Reference.h"

#include <bit>
#include <cstring>
#include <limits>
#include <numbers>

using namespace curlew;
using namespace curlew::test;

namespace {

using J2 = Jet<double, 3, 2>;

bool sameBits(const J2& a, const J2& b) {
    for (int k = 0; k < J2::kSize; ++k)
        // Zeros of either sign are equal.
        if (a.component(k) != b.component(k)) return false;
    return true;
}

/// What a file of the psrdnoise3 family says, against the noise in double and in float.
void checkAgainst(const nlohmann::json& file) {
    PsrdOptions options{.alpha = file.at("alpha").get<double>()};
    for (int i = 0; i < 3; ++i) options.period[i] = file.at("period").at(static_cast<size_t>(i)).get<int>();
    const Psrd3 noise(options);
    // Float: 1e-4, 5e-4 and 3e-3, as measured for the original in single precision (reference/README.md). Double: a few
    // hundred roundings of theta = hash · 3.88, up to 1118 radians, times the size of the second derivatives.
    const std::array<double, 3> toleranceFloat{1e-4, 5e-4, 3e-3};
    constexpr double kTolerance = 1e-11;
    std::array<Worst, 3> worst, worstFloat;
    for (const auto& row : file.at("rows")) {
        const auto number = [&](size_t k) { return row.at(k).get<double>(); };
        const Vec3d p{{number(1), number(2), number(3)}};
        const J2 jet = noise.at<2, double>(p);
        const auto single = noise.at<2, float>(p);
        for (int k = 0; k < J2::kSize; ++k) {
            const double expected = number(4 + static_cast<size_t>(k)); // the files have the order of a jet
            const size_t order = k == 0 ? 0 : k < 4 ? 1 : 2;
            worst[order].see(std::abs(jet.component(k) - expected), p);
            worstFloat[order].see(std::abs(double(single.component(k)) - expected), p);
        }
    }
    CHECK(file.at("rows").size() >= 20);
    for (size_t order = 0; order < 3; ++order) {
        CAPTURE(order, worst[order].value, worst[order].where, worstFloat[order].value, worstFloat[order].where);
        CHECK(worst[order].value <= kTolerance);
        CHECK(worstFloat[order].value <= toleranceFloat[order]);
    }
}

/// A position from simplex coordinates: the inverse of u = (y + z, x + z, x + y).
Vec3d fromSimplex(const Vec3d& u) {
    return {{0.5 * (u[1] + u[2] - u[0]), 0.5 * (u[0] + u[2] - u[1]), 0.5 * (u[0] + u[1] - u[2])}};
}

} // namespace

TEST_CASE("psrdnoise agrees with the project's own reference values", "[noise]") {
    checkAgainst(ownData("psrdnoise3_p0-0-0_a0.json"));
    checkAgainst(ownData("psrdnoise3_p4-6-3_a0.7.json"));
}

TEST_CASE("psrdnoise agrees with the shared reference values", "[noise]") {
    const std::string period = GENERATE("0-0-0", "4-6-3", "0-5-0"), alpha = GENERATE("0", "0.7", "2.5");
    CAPTURE(period, alpha);
    if (const auto file = reference("psrdnoise3_axisgrid_rot_p" + period + "_a" + alpha + ".json")) checkAgainst(*file);
}

TEST_CASE("psrdnoise tiles exactly", "[noise]") {
    struct Case {
        Vec<int, 3> period;
        uint64_t seed;
    };
    const auto c = GENERATE(Case{{{1, 1, 1}}, 0}, Case{{{4, 6, 3}}, 0}, Case{{{4, 6, 3}}, 77}, Case{{{0, 5, 0}}, 0},
                            Case{{{7, 0, 2}}, 5}, Case{{{300, 1000, 289}}, 9});
    CAPTURE(c.period, c.seed);
    const Psrd3 noise({.period = c.period, .alpha = 0.7, .seed = c.seed});
    const Psrd3 plain({.alpha = 0.7, .seed = c.seed});
    int plainDiffers = 0;
    for (uint64_t k = 0; k < 2000; ++k) {
        const Vec3d p = dyadic(randomPoint(cube(20), 1, k));
        const J2 jet = noise.at<2, double>(p);
        plainDiffers += !sameBits(jet, plain.at<2, double>(p));
        for (int axis = 0; axis < 3; ++axis)
            for (const int times : {1, -1, 3}) {
                const Vec3d q = p + unit(axis) * double(times * c.period[axis]);
                CAPTURE(p, q);
                if (!sameBits(jet, noise.at<2, double>(q))) FAIL("does not tile");
            }
    }
    CHECK(plainDiffers > 1000); // so it is the period that does it
}

TEST_CASE("a period leaves the noise within its first tile as it is, but for the margin", "[noise]") {
    // Vertices within [0, period) are not moved: the corners of a simplex lie within 1 of the point.
    const Psrd3 tiled({.period = {{8, 9, 10}}, .seed = 3}), plain({.seed = 3});
    for (const Vec3d& p : randomPoints(Box{{{1, 1, 1}}, {{7, 8, 9}}}, 2000, 2)) {
        CAPTURE(p);
        REQUIRE(sameBits(tiled.at<2, double>(p), plain.at<2, double>(p)));
    }
}

TEST_CASE("far away the noise repeats as its hash does", "[noise]") {
    // The hash sees simplex coordinates modulo 289. 289 along the first of them is (-1, 1, 1) 144.5 in space; two or
    // three of them together give 289 along an axis.
    const uint64_t seed = GENERATE(uint64_t{0}, uint64_t{11});
    CAPTURE(seed);
    const Psrd3 noise({.alpha = 0.3, .seed = seed});
    const std::array<Vec3d, 6> translations{fromSimplex({{289, 0, 0}}),
                                            fromSimplex({{0, 289, 0}}),
                                            fromSimplex({{0, 0, 289}}),
                                            Vec3d{{289, 0, 0}},
                                            Vec3d{{0, -289 * 3461.0, 0}}, // a million away
                                            Vec3d{{144.5 * 7001, 144.5 * 7001, 144.5 * 7001}}};
    CHECK(translations[0] == Vec3d{{-144.5, 144.5, 144.5}});
    for (const Vec3d& t : translations)
        for (uint64_t k = 0; k < 1000; ++k) {
            const Vec3d p = dyadic(randomPoint(cube(20), 3, k));
            CAPTURE(t, p);
            if (!sameBits(noise.at<2, double>(p), noise.at<2, double>(p + t))) FAIL("not the same");
            // In float too: the lattice cell is taken off in double.
            if (noise.at<0, float>(p).value != noise.at<0, float>(p + t).value) FAIL("not the same in float");
        }
    // It is no smaller period: half of one is another field.
    CHECK_FALSE(sameBits(noise.at<2, double>({{0.3, 0.1, 0.2}}), noise.at<2, double>({{144.8, 0.1, 0.2}})));
}

TEST_CASE("float is as accurate a million away as near the origin", "[noise]") {
    const double far = GENERATE(0.0, 1e6, 1e9);
    CAPTURE(far);
    const Psrd3 noise({.alpha = 1, .seed = 4});
    std::array<Worst, 3> worst;
    for (Vec3d p : randomPoints(cube(50), 20000, 4)) {
        p += Vec3d{{far, -far, far / 2}};
        const J2 jet = noise.at<2, double>(p);
        const auto single = noise.at<2, float>(p);
        for (int k = 0; k < J2::kSize; ++k)
            worst[k == 0 ? 0 : k < 4 ? 1 : 2].see(std::abs(double(single.component(k)) - jet.component(k)), p);
    }
    CAPTURE(worst[0].value, worst[1].value, worst[2].value);
    // The contract of the header.
    CHECK(worst[0].value < 1e-4);
    CHECK(worst[1].value < 5e-4);
    CHECK(worst[2].value < 3e-3);
}

TEST_CASE("seeds give fields that have nothing to do with each other", "[noise]") {
    constexpr size_t kCount = 100000;
    const auto points = randomPoints(cube(500), kCount, 5);
    const auto valuesOf = [&](uint64_t seed) {
        const Psrd3 noise({.seed = seed});
        std::vector<double> values;
        for (const Vec3d& p : points) values.push_back(noise.at<0, double>(p).value);
        return values;
    };
    const std::array<uint64_t, 5> seeds{0, 1, 2, 3, uint64_t{1} << 63};
    std::vector<std::vector<double>> values;
    for (const uint64_t seed : seeds) values.push_back(valuesOf(seed));
    CHECK(values[1] == valuesOf(1));
    const auto sumOfProducts = [](const std::vector<double>& a, const std::vector<double>& b) {
        double sum = 0;
        for (size_t k = 0; k < a.size(); ++k) sum += a[k] * b[k];
        return sum;
    };
    for (size_t i = 0; i < seeds.size(); ++i) {
        const double square = sumOfProducts(values[i], values[i]);
        CHECK(std::sqrt(square / kCount) > 0.2); // a field, not zeros
        for (size_t j = i + 1; j < seeds.size(); ++j) {
            const double correlation =
                sumOfProducts(values[i], values[j]) / std::sqrt(square * sumOfProducts(values[j], values[j]));
            CAPTURE(seeds[i], seeds[j], correlation);
            // 4 sigma of independent samples (the box is much larger than a cell), and of the mean product of the
            // gradients over at most 289² equally likely pairs of hashes, each of variance 1/3.
            CHECK(std::abs(correlation) < 4 * std::sqrt(1.0 / kCount + 1.0 / (3 * 289 * 289)));
        }
    }
}

TEST_CASE("psrdnoise stays within its bound and comes near it", "[noise]") {
    // The field of each seed and each alpha has other extremes.
    constexpr size_t kCount = 1000000;
    std::vector<double> largest(kCount / 10000);
    parallelFor(kCount, 10000, [&](size_t begin, size_t end) {
        const Psrd3 noise({.alpha = 0.1 * double(begin / 10000), .seed = begin / 100000});
        for (size_t k = begin; k < end; ++k) {
            double& l = largest[begin / 10000];
            l = std::max(l, std::abs(noise.at<0, double>(randomPoint(cube(1000), 6, k)).value));
        }
    });
    const double most = *std::max_element(largest.begin(), largest.end());
    CAPTURE(most);
    CHECK(most <= Psrd3::kBound);
    CHECK(most > 0.9);
    CHECK(Psrd3().bound() == Psrd3::kBound);
}

TEST_CASE("the bound is that of four gradients at their worst", "[noise]") {
    // At a point every corner contributes at most 39.5 w³ |d|. The maximum of the sum over the simplex is sought on a
    // fine grid of barycentric coordinates; the published bound is 39.5 · 0.026429.
    const std::array<Vec3d, 4> corners{fromSimplex({{0, 0, 0}}), fromSimplex({{1, 0, 0}}), fromSimplex({{1, 1, 0}}),
                                       fromSimplex({{1, 1, 1}})};
    constexpr int kSteps = 60;
    double most = 0;
    for (int a = 0; a <= kSteps; ++a)
        for (int b = 0; a + b <= kSteps; ++b)
            for (int c = 0; a + b + c <= kSteps; ++c) {
                const Vec3d p = (corners[0] * double(a) + corners[1] * double(b) + corners[2] * double(c) +
                                 corners[3] * double(kSteps - a - b - c)) *
                                (1.0 / kSteps);
                double sum = 0;
                for (const Vec3d& corner : corners) {
                    const double d2 = dot(p - corner, p - corner), w = std::max(0.5 - d2, 0.0);
                    sum += w * w * w * std::sqrt(d2);
                }
                most = std::max(most, 39.5 * sum);
            }
    CAPTURE(most);
    CHECK(most <= Psrd3::kBound);
    CHECK(most > 0.99 * Psrd3::kBound);
}

TEST_CASE("psrdnoise is zero at the vertices of its lattice", "[noise]") {
    const Psrd3 noise({.alpha = 0.4, .seed = 8});
    for (uint64_t k = 0; k < 1000; ++k) {
        Vec3d u = randomPoint(cube(50), 7, k);
        for (double& x : u.c) x = std::floor(x);
        CAPTURE(u);
        REQUIRE(noise.at<0, double>(fromSimplex(u)).value == 0);
        // There only the vertex's own gradient g counts: |∇n| = 39.5 w³ |g| with w = 1/2, |g| = 1.
        REQUIRE(std::abs(length(noise.at<1, double>(fromSimplex(u)).gradient) - 39.5 / 8) < 1e-8);
    }
}

TEST_CASE("positions that are no numbers, or beyond all lattices, do no harm", "[noise]") {
    constexpr double kInfinity = std::numeric_limits<double>::infinity(), kMax = std::numeric_limits<double>::max();
    const Vec<int, 3> period = GENERATE(Vec<int, 3>{}, Vec<int, 3>{{4, 6, 3}}, Vec<int, 3>{{1 << 30, 0, 1}});
    const Psrd3 noise({.period = period, .alpha = 0.7, .seed = 2});
    const std::array<double, 14> values{0,     -0.0,   std::nan(""), kInfinity, -kInfinity, kMax,   -kMax,
                                        1e300, -1e300, 1e18,         -1e15,     0x1p53,     1e-320, 0.25};
    double sum = 0;
    for (const double x : values)
        for (const double y : values)
            for (const double z : values) {
                const Vec3d p{{x, y, z}};
                const J2 jet = noise.at<2, double>(p);
                const auto single = noise.at<2, float>(p);
                for (int k = 0; k < J2::kSize; ++k) sum += jet.component(k) + double(single.component(k));
                // Where the lattice cell still has a meaning the value is within the bound.
                if (std::abs(x) < 0x1p50 && std::abs(y) < 0x1p50 && std::abs(z) < 0x1p50) {
                    CAPTURE(p);
                    REQUIRE(std::abs(jet.value) <= Psrd3::kBound);
                }
            }
    CHECK(!(sum == 1)); // used
}

TEST_CASE("psrdnoise is C² across the faces of its simplices", "[noise]") {
    const Psrd3 noise({.alpha = 1.2, .seed = 6});
    constexpr double kStep = 0x1p-40;
    std::array<Worst, 3> jump;
    for (uint64_t k = 0; k < 3000; ++k) {
        Vec3d u = dyadic(randomPoint(cube(50), 8, k));
        // Faces lie where a simplex coordinate is whole, or two have the same fractional part.
        const int i = static_cast<int>(k % 3), j = (i + 1) % 3;
        u[i] = k % 2 ? std::floor(u[i]) : std::floor(u[i]) + (u[j] - std::floor(u[j]));
        Vec3d low = u, high = u;
        low[i] -= kStep;
        high[i] += kStep;
        const J2 a = noise.at<2, double>(fromSimplex(low)), b = noise.at<2, double>(fromSimplex(high));
        jump[0].see(difference(a, b, 0, 1), u);
        jump[1].see(difference(a, b, 1, 4), u);
        jump[2].see(difference(a, b, 4, 10), u);
    }
    // 2 kStep times the next derivative: those of order one to three are below 6, 45 and 600 (seen among 2·10^6 points:
    // 5.97, 36.8 and 551).
    CAPTURE(jump[0].value, jump[1].value, jump[2].value, jump[2].where);
    CHECK(jump[0].value < 2 * kStep * 6 * 2);
    CHECK(jump[1].value < 2 * kStep * 45 * 2);
    CHECK(jump[2].value < 2 * kStep * 600 * 2);
}

TEST_CASE("gradient and Hessian of psrdnoise are those of its value", "[noise]") {
    const PsrdOptions options = GENERATE(PsrdOptions{}, PsrdOptions{.period = {{4, 6, 3}}, .alpha = 0.7, .seed = 3});
    // Third derivatives stay below 600, see above.
    requireDerivatives(ScalarField(Psrd3(options)), randomPoints(cube(30), 2000, 9), 0x1p-9, 600);
}

TEST_CASE("a full turn of the gradients changes nothing, half a turn changes the sign", "[noise]") {
    const double alpha = GENERATE(0.0, 0.7, -3.1);
    CAPTURE(alpha);
    constexpr double kPi = std::numbers::pi;
    const Psrd3 noise({.alpha = alpha, .seed = 1}), full({.alpha = alpha + 2 * kPi, .seed = 1}),
        half({.alpha = alpha + kPi, .seed = 1});
    Worst worst, worstHalf;
    for (const Vec3d& p : randomPoints(cube(30), 5000, 10)) {
        const J2 jet = noise.at<2, double>(p);
        worst.see(difference(jet, full.at<2, double>(p)), p);
        worstHalf.see(difference(-jet, half.at<2, double>(p)), p);
    }
    // alpha + 2 pi is off by a rounding of 8, times second derivatives below 45 in size.
    CHECK(worst.value < 45 * 8 * 0x1p-52 * 4);
    CHECK(worstHalf.value < 45 * 8 * 0x1p-52 * 4);
}

TEST_CASE("psrdnoise rejects a negative period and says which", "[noise]") {
    CHECK_THROWS_AS(Psrd3({.period = {{0, -2, 0}}}), ValueError);
    CHECK_THROWS_WITH(Psrd3({.period = {{0, -2, 0}}}), Catch::Contains("-2"));
}
