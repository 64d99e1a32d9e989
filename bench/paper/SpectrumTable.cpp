// SPDX-License-Identifier: Apache-2.0
#include "Tables.h"
#include "curlew/base/AtomicFile.h"
#include "curlew/field/NoiseField.h"
#include "curlew/flow/Flows.h"
#include "curlew/picture/Plot.h"
#include "curlew/vdb/Spectrum.h"
#include "curlew/vdb/VelocityGrid.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string_view>

namespace curlew::paper {

namespace {

constexpr double kKolmogorov = -5.0 / 3;
constexpr std::array<double, 4> kGains{0.35, 0.397, 0.45, 0.5};
constexpr Box kCells{{{-2, -2, -2}}, {{2, 2, 2}}}; ///< Contains four cells of the lowest octave along each axis.

/// A kind of flow with five octaves and a given gain.
struct Kind {
    std::string_view name, key;
    /// Wave numbers between which the slope is measured: three octaves of the noise, starting with its second.
    /// Classical curl noise peaks an octave lower.
    double from, to;
    Flow (*make)(double gain);
    double stated; ///< The gain that the documentation states for Kolmogorov's slope; 0: none.
};

template <class Noise>
ScalarField octaves(uint64_t seed, double gain) {
    return noiseField<Noise>({.seed = seed}, {.octaves = 5, .gain = gain});
}

Flow classical(double gain) {
    return curlFlow(std::array{octaves<Psrd3>(0, gain), octaves<Psrd3>(1, gain), octaves<Psrd3>(2, gain)},
                    {.box = kCells, .wall = {}});
}

template <class Noise>
Flow ofTwo(double gain) {
    return Flow(octaves<Noise>(0, gain), octaves<Noise>(1, gain), {.box = kCells, .wall = {}});
}

constexpr std::array<Kind, 3> kKinds{{{"`-curl`, psrd", "curl", 1, 12, classical, 0.397},
                                      {"`-dfvn`, psrd", "dfvn", 2, 16, ofTwo<Psrd3>, 0.37},
                                      {"`-dfvn`, simplex", "dfvn_simplex", 2, 16, ofTwo<SimplexNoise<3>>, 0.37}}};

EnergySpectrum spectrumOf(const Kind& kind, double gain, int dim) {
    return energySpectrum(*velocityGrid(withSpeed(kind.make(gain), 1), {.dim = dim}));
}

/// Returns the gain at which the slope is Kolmogorov's, by linear interpolation between the two neighbouring gains; NaN
/// if no two enclose it.
double gainFor(const std::array<double, kGains.size()>& slopes) {
    for (size_t k = 0; k + 1 < kGains.size(); ++k)
        if (slopes[k] <= kKolmogorov && slopes[k + 1] > kKolmogorov)
            return kGains[k] + (kGains[k + 1] - kGains[k]) * (kKolmogorov - slopes[k]) / (slopes[k + 1] - slopes[k]);
    return std::nan("");
}

/// Plots the energy against the wave number for each gain, and the power law.
void plot(const Kind& kind, const std::array<EnergySpectrum, kGains.size()>& spectra,
          const std::filesystem::path& folder) {
    PlotData data{.xName = "wave number, cycles per world unit", .curves = {}};
    const EnergySpectrum& first = spectra.front();
    const std::vector<double> law = powerLaw(spectra[1], kKolmogorov, kind.from, kind.to);
    for (const double gain : kGains) data.curves.push_back({.name = fmt::format("gain {}", gain), .y = {}});
    data.curves.push_back({.name = "k^(-5/3)", .y = {}});
    for (size_t s = 1; s < first.energy.size() && first.waveNumber(s) <= first.nyquist; ++s) {
        data.x.push_back(first.waveNumber(s));
        for (size_t k = 0; k < spectra.size(); ++k) data.curves[k].y.push_back(spectra[k].energy[s]);
        data.curves.back().y.push_back(law[s]);
    }
    const std::string svg = plotSvg(data, {.title = "five octaves: " + std::string(kind.name),
                                           .yLabel = "energy per wave number",
                                           .logX = true,
                                           .logY = true});
    writeAtomically(folder / fmt::format("spectrum_{}.svg", kind.key), [&](std::ostream& out) { out << svg; });
}

} // namespace

std::vector<std::string> spectrumTable(const TableRun& run, std::ostream& out) {
    const int dim = std::max(64, static_cast<int>(std::lround(160 * std::cbrt(run.scale))));
    out << fmt::format(
        "## Kolmogorov's slope by gain\n\nThe slope of the energy spectrum E(k) of five octaves with lacunarity 2, in "
        "{}³ voxels in a box of 4 cells, fitted over three octaves of wave numbers with equal weight for each octave. "
        "Kolmogorov's slope is −5/3. The second to last column is the gain that gives it, by linear interpolation. The "
        "last column is the gain that the documentation states.\n\n|  |",
        dim);
    for (const double gain : kGains) out << fmt::format(" {} |", gain);
    out << " gain for −5/3 | documented |\n|---|---|---|---|---|---|---|\n";
    std::vector<std::string> broken;
    for (const Kind& kind : kKinds) {
        std::array<EnergySpectrum, kGains.size()> spectra;
        std::array<double, kGains.size()> slopes;
        out << fmt::format("| {} |", kind.name);
        for (size_t k = 0; k < kGains.size(); ++k) {
            spectra[k] = spectrumOf(kind, kGains[k], dim);
            slopes[k] = powerLawSlope(spectra[k], kind.from, std::min(kind.to, spectra[k].nyquist));
            out << fmt::format(" {:.2f} |", slopes[k]);
        }
        const double gain = gainFor(slopes);
        out << fmt::format(" {:.3f} | {} |\n", gain, kind.stated);
        if (run.scale == 1 && !(std::abs(gain - kind.stated) <= 0.01))
            broken.push_back(fmt::format("{}: a gain of {:.3f} gives -5/3, not {}", kind.name, gain, kind.stated));
        if (!std::is_sorted(slopes.begin(), slopes.end()))
            broken.push_back(fmt::format("{}: a larger gain does not give a flatter spectrum", kind.name));
        plot(kind, spectra, run.folder);
    }
    return broken;
}

} // namespace curlew::paper
