// SPDX-License-Identifier: Apache-2.0
#include "PoissonDisk.h"
#include "Sobol.h"
#include "Tables.h"
#include "curlew/track/Jitter.h"

#include <fmt/format.h>

#include <cmath>
#include <numbers>
#include <string_view>

namespace curlew::paper {

namespace {

/// Returns the square of the L2 star discrepancy: the mean square, over all boxes from the origin to a corner in the
/// unit cube, of the difference between the box's volume and its share of the points (Warnock 1972).
template <int N>
double squaredDiscrepancy(const Positions<N>& points) {
    const auto count = static_cast<double>(points.size());
    double single = 0;
    for (const auto& p : points) {
        double product = 1;
        for (const double x : p.c) product *= 1 - x * x;
        single += product;
    }
    const double pairs = parallelSum(points.size(), 64, [&](size_t begin, size_t end) {
        double sum = 0;
        for (size_t i = begin; i < end; ++i)
            for (const auto& q : points) {
                double product = 1;
                for (int axis = 0; axis < N; ++axis) product *= 1 - std::max(points[i][axis], q[axis]);
                sum += product;
            }
        return sum;
    });
    return std::pow(3.0, -N) - std::pow(2.0, 1 - N) * single / count + pairs / (count * count);
}

/// Its mean for independent points, exactly.
double squaredDiscrepancyAtRandom(int n, double count) { return (std::pow(2.0, -n) - std::pow(3.0, -n)) / count; }

/// A Gaussian of this width around a point: smooth. Its integral over the unit cube is known.
template <int N>
struct Bump {
    static constexpr double kWidth = 0.25;
    Vec<double, N> centre;
    double at(const Vec<double, N>& p) const {
        const Vec<double, N> d = p - centre;
        return std::exp(-dot(d, d) / (2 * kWidth * kWidth));
    }
    double integral() const {
        double product = 1;
        const double scale = std::numbers::sqrt2 * kWidth;
        for (const double c : centre.c)
            product *= 0.5 * scale * std::sqrt(std::numbers::pi) * (std::erf((1 - c) / scale) + std::erf(c / scale));
        return product;
    }
};

/// 1 in a ball, 0 elsewhere. The ball lies in the unit cube.
template <int N>
struct Ball {
    static constexpr double kRadius = 0.3;
    Vec<double, N> centre;
    double at(const Vec<double, N>& p) const {
        const Vec<double, N> d = p - centre;
        return dot(d, d) < kRadius * kRadius ? 1 : 0;
    }
    double integral() const {
        return std::pow(std::numbers::pi, 0.5 * N) / std::tgamma(0.5 * N + 1) * std::pow(kRadius, N);
    }
};

/// The squared error of the mean over the points, averaged over integrands with random centres.
template <class Integrand, int N>
double squaredError(const Positions<N>& points, uint64_t seed) {
    constexpr int kCentres = 16;
    constexpr double kMargin = Ball<N>::kRadius;
    double sum = 0;
    for (uint64_t k = 0; k < kCentres; ++k) {
        Integrand integrand;
        for (int axis = 0; axis < N; ++axis)
            integrand.centre[axis] = kMargin + (1 - 2 * kMargin) * randomUniform(seed, k, static_cast<uint64_t>(axis));
        double mean = 0;
        for (const auto& p : points) mean += integrand.at(p);
        const double error = mean / static_cast<double>(points.size()) - integrand.integral();
        sum += error * error / kCentres;
    }
    return sum;
}

/// Root mean squares over several sets of points, times the square root of their number: for independent points they do
/// not depend on it.
struct Figures {
    double points = 0, discrepancy = 0, smooth = 0, edge = 0;
};

template <int N, class Make>
Figures measure(int sets, const Make& make) {
    Figures sum;
    for (int set = 0; set < sets; ++set) {
        const auto seed = static_cast<uint32_t>(set + 1);
        const Positions<N> points = make(seed);
        const auto count = static_cast<double>(points.size());
        sum.points += count / sets;
        sum.discrepancy += count * squaredDiscrepancy(points) / sets;
        sum.smooth += count * squaredError<Bump<N>>(points, seed) / sets;
        sum.edge += count * squaredError<Ball<N>>(points, seed) / sets;
    }
    return {sum.points, std::sqrt(sum.discrepancy), std::sqrt(sum.smooth), std::sqrt(sum.edge)};
}

template <int N>
DomainN<N> unitCube() {
    DomainN<N> domain;
    for (int axis = 0; axis < N; ++axis) {
        domain.box.lower[axis] = 0;
        domain.box.upper[axis] = 1;
    }
    return domain;
}

template <int N>
Positions<N> independent(size_t count, uint64_t seed) {
    Positions<N> points(count);
    for (size_t k = 0; k < count; ++k)
        for (int axis = 0; axis < N; ++axis) points[k][axis] = randomUniform(seed, k, static_cast<uint64_t>(axis));
    return points;
}

/// Returns the radius with which Poisson disks fill the unit cube with about `count` points.
template <int N>
double radiusFor(size_t count) {
    double radius = std::pow(0.7 / static_cast<double>(count), 1.0 / N);
    for (int k = 0; k < 4; ++k)
        radius *= std::pow(static_cast<double>(PoissonDisk<N>(radius, 99).fill().size()) / static_cast<double>(count),
                           1.0 / N);
    return radius;
}

constexpr std::array<std::string_view, 5> kNames{"independent", "jittered at random", "jittered by curl noise",
                                                 "Poisson disk", "Sobol, scrambled"};

/// Measures all kinds of points, 2^power of them, which is a lattice of `perAxis` points along each axis.
template <int N>
std::array<Figures, kNames.size()> measureAll(int perAxis, int power, int sets) {
    const DomainN<N> cube = unitCube<N>();
    const double spacing = 1.0 / perAxis, radius = radiusFor<N>(size_t{1} << power);
    const auto jittered = [&](bool random) {
        return [&cube, spacing, random](uint64_t seed) {
            return jitteredPositions(cube, {.spacing = spacing, .random = random, .flow = {.seed = seed}}).positions;
        };
    };
    return {measure<N>(sets, [&](uint64_t seed) { return independent<N>(size_t{1} << power, seed); }),
            measure<N>(sets, jittered(true)), measure<N>(sets, jittered(false)),
            measure<N>(sets, [&](uint32_t seed) { return PoissonDisk<N>(radius, seed).fill(); }),
            measure<N>(sets, [&](uint64_t seed) { return sobolPoints<N>(power, seed); })};
}

constexpr const char* kText = R"(## Sampling and integration: what ICN §6.1 leaves open

Points in the unit cube in n dimensions: independent ones; a lattice jittered at random (each point uniform in its cell) and by curl
noise (`-jitter`); Poisson disks; and Sobol's sequence, scrambled. Of each kind, {0} sets with two numbers of points. Their *L2 star
discrepancy* is the rms difference, over all boxes from the origin, between the volume and the share of the points (Warnock 1972). The
*errors* are those of the mean over the points as an estimate of an integral, rms over the sets and 16 integrands each: a Gaussian of
width 0.25 (smooth), and a ball of radius 0.3 (discontinuous), both around random centres. All figures are multiplied by √N, so that those
of independent points do not depend on N, the number of points. The power in parentheses is that of N with which the error falls.

Curl noise keeps each point near the centre of its cell, so all points of a layer of the lattice stay near its plane. Boxes have faces along
these planes, so the L2 star discrepancy is that of a lattice: worse than that of independent points in 3D and above. Integrands that are not
aligned with the lattice do not see this: for the discontinuous one, curl noise has the smallest error of all, and for the smooth one a
smaller error than random jitter in 2D and 3D. Sobol's sequence is best for smooth integrands. Poisson disks have more points near the
sides of the cube than inside, which biases their means.

| n | points | N | discrepancy · √N | smooth · √N | discontinuous · √N |
|---|---|---|---|---|---|
)";

double power(double before, double after, double pointsBefore, double pointsAfter) {
    return std::log(after / before) / std::log(pointsAfter / pointsBefore) - 0.5;
}

} // namespace

std::vector<std::string> samplingTable(const TableRun& run, std::ostream& out) {
    const int sets = run.scale < 1 ? 4 : 32;
    out << fmt::format(kText, sets);
    std::vector<std::string> broken;
    const auto add = [&](auto dimension, int few, int fewPower, int many, int manyPower) {
        constexpr int kN = decltype(dimension)::value;
        const auto less = measureAll<kN>(few, fewPower, sets), more = measureAll<kN>(many, manyPower, sets);
        for (size_t kind = 0; kind < kNames.size(); ++kind) {
            const Figures &a = less[kind], &b = more[kind];
            const auto figures = [&](double Figures::*figure) {
                return fmt::format("{:.3f} → {:.3f} ({:.2f})", a.*figure, b.*figure,
                                   power(a.*figure, b.*figure, a.points, b.points));
            };
            out << fmt::format("| {} | {} | {:.0f} → {:.0f} | {} | {} | {} |\n", kN, kNames[kind], a.points, b.points,
                               figures(&Figures::discrepancy), figures(&Figures::smooth), figures(&Figures::edge));
        }
        const auto claim = [&](bool holds, std::string what) {
            if (!holds) broken.push_back(fmt::format("{}D: {}", kN, what));
        };
        // The mean of the squared discrepancy is known; its deviation over the sets is below a third of it.
        const double expected = std::sqrt(squaredDiscrepancyAtRandom(kN, 1));
        claim(std::abs(more[0].discrepancy / expected - 1) < (run.scale < 1 ? 0.5 : 0.25),
              fmt::format("the discrepancy of independent points is {:.3f}, expected {:.3f}", more[0].discrepancy,
                          expected));
        for (const size_t kind : {size_t{1}, size_t{4}})
            claim(more[kind].discrepancy < 0.7 * more[0].discrepancy,
                  fmt::format("points {} have no smaller discrepancy than independent ones", kNames[kind]));
        for (const size_t kind : {size_t{0}, size_t{1}, size_t{3}, size_t{4}})
            claim(more[2].edge < 1.1 * more[kind].edge,
                  fmt::format("curl noise has a larger error of the ball than points {}", kNames[kind]));
    };
    add(std::integral_constant<int, 2>(), 16, 8, 64, 12);
    add(std::integral_constant<int, 3>(), 4, 6, 16, 12);
    add(std::integral_constant<int, 4>(), 4, 8, 8, 12);
    return broken;
}

} // namespace curlew::paper
