// SPDX-License-Identifier: Apache-2.0
#include "PoissonDisk.h"
#include "RadialDistribution.h"
#include "Sobol.h"
#include "Tables.h"
#include "curlew/base/AtomicFile.h"
#include "curlew/field/NoiseField.h"
#include "curlew/track/Jitter.h"

#include <fmt/format.h>

#include <ctime>
#include <limits>
#include <utility>

namespace curlew::paper {

namespace {

/// A row of Table 1 as published, and the parameters with which we reproduce it.
struct Row {
    int pointsPerAxis;
    int sets, sobolSets; ///< Number of sets over which we average.
    int sobolPower;      ///< 2^sobolPower is the number of points closest to 10^n.
    double diskEdge;     ///< Edge of the cube that we fill with Poisson disks; less than 1 saves time.
    Spacing curl, random, disk, sobol;
};

constexpr double kU = 0.1; // ICN's u: the spacing of the lattice for n = 3, 4, 5
// Length of the step, times d̄, in unit cubes. ICN does not state it; this one number fits all five dimensions.
constexpr double kStep = 0.0085;
constexpr double kBinWidth = 0.005;
constexpr size_t kBins = 60;
constexpr size_t kMaxQueries = 600000; // for larger sets, the median is that of a sample

/// Measurements of one kind of point set: means over several sets.
struct Measured {
    std::string_view name;
    Spacing published{};
    double tolerance = 0; ///< Claimed relative tolerance of the median.
    Spacing mean{};
    double deviation = 0; ///< Standard deviation of the medians of single sets.
    double seconds = 0;   ///< Processor time to make one set.
    size_t points = 0;
    int sets = 0;
    std::vector<double> rdf{}; ///< Radial distribution function of the first set.
};

/// Makes and measures sets of points that fill a cube with this edge.
template <int N, class Make>
void measure(Measured& found, int sets, double edge, const Make& make) {
    found.sets = sets;
    double squares = 0;
    for (int set = 0; set < sets; ++set) {
        const std::clock_t begin = std::clock();
        const Positions<N> points = make(static_cast<uint32_t>(set + 1));
        found.seconds += static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC / sets;
        const NeighboursN<N> neighbours(points);
        const Spacing spacing = spacingOf(neighbours, points.size(), kMaxQueries);
        found.points = points.size();
        found.mean.median += spacing.median / sets;
        found.mean.minimum += spacing.minimum / sets;
        squares += spacing.median * spacing.median / sets;
        if (set == 0) found.rdf = radialDistribution(neighbours, points.size(), edge, kBinWidth, kBins, 4000);
    }
    found.deviation = std::sqrt(std::max(0.0, squares - found.mean.median * found.mean.median));
}

/// A lattice with the given number of points along each axis, and the spacing of the published lattice, whose end
/// points are at 0.05 and 0.95.
template <int N>
struct Lattice {
    double spacing;
    DomainN<N> domain; ///< Filled by the lattice's cells.

    Lattice(int published, int pointsPerAxis) : spacing((1 - kU) / (published - 1)) {
        for (int axis = 0; axis < N; ++axis) {
            domain.box.lower[axis] = 0.5 * (kU - spacing);
            domain.box.upper[axis] = domain.box.lower[axis] + spacing * pointsPerAxis;
        }
    }
    Positions<N> points() const { return latticePoints(domain, spacing); }
    double edge() const { return domain.box.size()[0]; }
};

/// ICN's flow as we interpret it: the published noise with wavelength 1, independent of the lattice, and the unscaled
/// cross product.
template <int N>
FlowN<N> publishedFlow(const DomainN<N>& domain, uint64_t seed) {
    const auto noise = [&](size_t potential) {
        return noiseField<SimplexNoise<N>>({.kernel = SimplexKernel::published, .seed = randomBits(seed, potential)});
    };
    auto potentials = [&]<size_t... K>(std::index_sequence<K...>) { return typename FlowN<N>::Potentials{noise(K)...}; }
    (std::make_index_sequence<FlowN<N>::kPotentials>());
    return FlowN<N>(std::move(potentials), domain);
}

/// Measures the five kinds of sets.
template <int N>
std::array<Measured, 5> measureRow(const Row& row, double scale) {
    const double shrink = std::pow(scale, 1.0 / N);
    const int pointsPerAxis = std::max(3, static_cast<int>(std::lround(row.pointsPerAxis * shrink)));
    const Lattice<N> lattice(row.pointsPerAxis, pointsPerAxis);
    const double step = kStep * meanNeighbourDistance(N);
    const double diskEdge = std::max(0.45, row.diskEdge * shrink); // a smaller cube has no room for neighbours
    const int power = std::max(6, static_cast<int>(std::lround(row.sobolPower + std::log2(scale))));
    const int sets = scale < 1 ? 1 : row.sets;

    std::array<Measured, 5> kinds{{{.name = "curl noise as ICN", .published = row.curl, .tolerance = 0.03},
                                   {.name = "curl noise as Curlew"},
                                   {.name = "at random", .published = row.random, .tolerance = 0.02},
                                   {.name = "Poisson disk", .published = row.disk, .tolerance = 0.02},
                                   {.name = "Sobol", .published = row.sobol, .tolerance = 0.02}}};
    measure<N>(kinds[0], sets, lattice.edge(), [&](uint64_t seed) {
        auto points = lattice.points();
        advect(publishedFlow(lattice.domain, seed), points,
               {.time = step, .steps = 1, .reprojection = {.maxSubdivisions = 0}});
        return points;
    });
    measure<N>(kinds[1], sets, lattice.edge(), [&](uint64_t seed) {
        auto points = lattice.points();
        jitter(jitterFlow(lattice.domain, lattice.spacing, {.seed = seed}), points, lattice.spacing);
        return points;
    });
    measure<N>(kinds[2], sets, lattice.edge(), [&](uint64_t seed) {
        auto points = lattice.points();
        jitterRandomly(points, kU, 1, seed);
        return points;
    });
    measure<N>(kinds[3], sets, diskEdge, [&](uint32_t seed) {
        auto points = PoissonDisk<N>(kU / diskEdge, seed).fill();
        for (auto& p : points) p *= diskEdge;
        return points;
    });
    measure<N>(kinds[4], scale < 1 ? 1 : row.sobolSets, 1, [&](uint64_t seed) { return sobolPoints<N>(power, seed); });
    return kinds;
}

/// Returns the claims that do not hold.
std::vector<std::string> broken(int n, const Row& row, const std::array<Measured, 5>& kinds, bool whole) {
    std::vector<std::string> lines;
    const double spacing = (1 - kU) / (row.pointsPerAxis - 1), rounding = 1e-12;
    for (const Measured& kind : kinds) {
        // If single sets deviate by more than the tolerance, so may the published one, which is a single set.
        const double allowed = std::max(kind.tolerance * kind.published.median, 3 * kind.deviation);
        if (whole && kind.tolerance > 0 && !(std::abs(kind.mean.median - kind.published.median) <= allowed))
            lines.push_back(fmt::format("{}D, {}: the median {:.4f} is not within {:.4f} of the published {}", n,
                                        kind.name, kind.mean.median, allowed, kind.published.median));
    }
    if (!(kinds[1].mean.median > 0.75 * spacing && kinds[1].mean.median < 0.9 * spacing))
        lines.push_back(fmt::format("{}D: Curlew's default has the median {:.4f}, not 0.75 to 0.9 spacings", n,
                                    kinds[1].mean.median));
    if (!(kinds[2].mean.minimum >= spacing - kU - rounding))
        lines.push_back(fmt::format("{}D: points at random leave their cells", n));
    if (!(kinds[3].mean.minimum >= kU - rounding))
        lines.push_back(fmt::format("{}D: Poisson disks overlap: {:.6f}", n, kinds[3].mean.minimum));
    return lines;
}

void writeRow(int n, const std::array<Measured, 5>& kinds, std::ostream& out) {
    const auto figure = [](double x) { return std::isnan(x) || x == 0 ? std::string() : fmt::format("{:.3f}", x); };
    for (const Measured& kind : kinds)
        out << fmt::format("| {} | {} | {} | {:.4f}{} | {} | {} | {} | {} | {:.2g} |\n", n, kind.name, kind.points,
                           kind.mean.median, kind.sets > 1 ? fmt::format(" ± {:.4f}", kind.deviation) : "",
                           figure(kind.published.median), figure(kind.mean.minimum), figure(kind.published.minimum),
                           kind.sets, kind.seconds);
}

void writeRdf(const std::filesystem::path& path, const std::array<Measured, 5>& kinds) {
    writeAtomically(path, [&](std::ostream& out) {
        out << "distance";
        for (const Measured& kind : kinds) out << fmt::format(",{}", kind.name);
        for (size_t k = 0; k < kBins; ++k) {
            out << fmt::format("\n{:.4f}", (static_cast<double>(k) + 0.5) * kBinWidth);
            for (const Measured& kind : kinds)
                out << (std::isnan(kind.rdf[k]) ? "," : fmt::format(",{:.5g}", kind.rdf[k]));
        }
        out << '\n';
    });
}

constexpr const char* kText = R"(## ICN Table 1 and Fig. 4: jittering in 3 to 7 dimensions

The distance from a point to its nearest neighbour: its median and its minimum over the points. "±" is the standard
deviation of the median between sets. The paper has one set of each kind.

The paper leaves some details open. We interpret them as follows:
- *The lattice* has its outermost points at 0.05 and 0.95. So its spacing is 0.1 for n = 3, 4, 5, and 0.15 and 0.18 for n = 6, 7.
  Points at random move by u = 0.1 in all dimensions. This interpretation reproduces the published figures for points at
  random (0.118 and 0.146 for n = 6 and 7). In 3D, the published 0.069 is 2.5 standard deviations above the mean of such sets.
- *Curl noise as ICN*: the published simplex noise (its kernel is discontinuous at the faces of simplices) with a wavelength of
  one unit cube, independent of the spacing, the unscaled cross product of the gradients, and one RK4 step of {} d̄ with
  reprojection. This step length fits all five dimensions. If a discontinuity of the noise takes a point off its track, the point
  stays where it is (0.5 to 2 % of the points).
- *Curl noise as Curlew* by default (`-jitter`, `curlew/track/Jitter.h`): a continuous noise with 0.3 cycles per spacing. All points
  move equally far, by 0.16 d̄ spacings. The median is 0.81 to 0.84 spacings in all dimensions, and the minimum is larger. (ICN's
  median rises to 0.98 in 7D, where its noise is weak and most points hardly move.) This flow is not divergence-free.
- *Poisson disk*: fills the cube with points, with the radius u. SciPy's sampler, which the paper uses, searches for neighbours
  only two cells of size u/√n away, so it misses some in 5D and above: its minima of 0.092, 0.084 and 0.080 are below u. Ours are
  not. In 6D and 7D, we fill only a part of the cube, with the edge lengths 0.8 and 0.6.
- *Sobol*: the published figures in 6D and 7D are those of about 10^6 and 10^7 points, not of 7^6 and 6^7 points, scrambled as
  SciPy does by default. The medians of such sets deviate by 2 to 5 %.

The curves of Fig. 4 are in icn_fig4_rdf_3d.csv to icn_fig4_rdf_7d.csv: the number of pairs of points by distance, relative to
the same number of independent points in the same cube. Curl noise is computed on all processors, so two processors take half
of the time below. The paper's times for 7D are 105 s (curl noise) and over three hours (Poisson disk).

| n | points | number | median | ICN | minimum | ICN | sets | processor seconds |
|---|---|---|---|---|---|---|---|---|
)";

} // namespace

std::vector<std::string> jitterTable(const TableRun& run, std::ostream& out) {
    out << fmt::format(kText, kStep);
    std::vector<std::string> lines;
    const auto add = [&](auto dimension, const Row& row) {
        constexpr int kN = decltype(dimension)::value;
        const auto kinds = measureRow<kN>(row, run.scale);
        writeRow(kN, kinds, out);
        out.flush();
        writeRdf(run.folder / fmt::format("icn_fig4_rdf_{}d.csv", kN), kinds);
        for (auto& line : broken(kN, row, kinds, run.scale == 1)) lines.push_back(std::move(line));
    };
    add(std::integral_constant<int, 3>(),
        {10, 64, 64, 10, 1, {0.083, 0.044}, {0.069, 0.015}, {0.104, 0.100}, {0.071, 0.031}});
    add(std::integral_constant<int, 4>(),
        {10, 16, 32, 13, 1, {0.081, 0.034}, {0.069, 0.010}, {0.104, 0.100}, {0.074, 0.030}});
    add(std::integral_constant<int, 5>(),
        {10, 3, 4, 17, 1, {0.083, 0.023}, {0.073, 0.011}, {0.103, 0.092}, {0.071, 0.019}});
    add(std::integral_constant<int, 6>(),
        {7, 1, 4, 20, 0.8, {0.136, 0.039}, {0.118, 0.057}, {0.103, 0.084}, {0.078, 0.025}});
    add(std::integral_constant<int, 7>(),
        {6, 1, 2, 23, 0.6, {0.176, 0.071}, {0.146, 0.087}, {0.102, 0.080}, {0.081, 0.030}});
    return lines;
}

} // namespace curlew::paper
