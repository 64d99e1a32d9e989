// SPDX-License-Identifier: Apache-2.0
#include "Actions.h"
#include "curlew/app/registry/Bind.h"
#include "curlew/base/AtomicFile.h"
#include "curlew/picture/Plot.h"
#include "curlew/vdb/ScalarGrids.h"
#include "curlew/vdb/Spectrum.h"

#include <limits>
#include <optional>

namespace curlew::app {

namespace {

using namespace options;

constexpr double kKolmogorov = -5.0 / 3;

const Binding<SpectrumOptions>& spectrumBinding() {
    static const auto binding = Binding<SpectrumOptions>().add(
        choice("window", kSpectrumWindowNames,
               "hann: fade the velocity out towards the ends of the box; none: for a velocity that tiles"),
        [](auto& o) -> auto& { return o.window; });
    return binding;
}

/// Returns the range for measuring the slope: fit= if given, otherwise from the peak to half the Nyquist wave number,
/// extended to at least an octave if the Nyquist wave number allows.
Interval fitOf(const Arguments& a, const EnergySpectrum& spectrum) {
    if (a.given("fit")) return a.interval("fit");
    const double peak = peakWaveNumber(spectrum);
    return {peak, std::max(0.5 * spectrum.nyquist, std::min(spectrum.nyquist, 2 * peak))};
}

/// Returns the slope in a range. If nobody has asked for that range, and it has too few shells with energy, as in a
/// thin box, warns and returns nothing. Throws ValueError if nothing but the mean velocity has energy.
std::optional<double> slopeOf(Context& c, const Arguments& a, const EnergySpectrum& spectrum, const Interval& fit) {
    const bool uniform = shellsIn(spectrum, 0, std::numeric_limits<double>::infinity()) == 0;
    if (a.given("fit") || uniform || shellsIn(spectrum, fit.lower, fit.upper) >= kShellsForSlope)
        return powerLawSlope(spectrum, fit.lower, fit.upper);
    c.warn(fmt::format(
        "no slope, because fewer than two shells with energy are between the wave numbers {:.4g} and {:.4g}; "
        "a shell is {:.4g} wide, one cycle over the shortest side of the box, so use a thicker box or "
        "smaller voxels",
        fit.lower, fit.upper, spectrum.shellWidth));
    return std::nullopt;
}

/// Returns the plot of all shells up to the Nyquist wave number, without the mean velocity; with Kolmogorov's law if
/// the slope is known.
PlotData plotOf(const EnergySpectrum& spectrum, const Interval& fit, bool withLaw) {
    PlotData data{.xName = "wave number, cycles per world unit", .curves = {{.name = "E(k)"}}};
    std::vector<double> law;
    if (withLaw) {
        law = powerLaw(spectrum, kKolmogorov, fit.lower, fit.upper);
        data.curves.push_back({.name = "k^(-5/3)"});
    }
    for (size_t s = 1; s < spectrum.energy.size() && spectrum.waveNumber(s) <= spectrum.nyquist; ++s) {
        data.x.push_back(spectrum.waveNumber(s));
        data.curves[0].y.push_back(spectrum.energy[s]);
        if (withLaw) data.curves[1].y.push_back(law[s]);
    }
    return data;
}

void spectrum(Context& c, const Arguments& a) {
    const auto grid = vectorsOf(c.grid("velocity").grid);
    if (!grid) throw ValueError("needs a grid of float or double vectors");
    const SpectrumOptions options = spectrumBinding().read(a);
    const EnergySpectrum found = energySpectrum(*grid, options, c.follow("spectrum"));
    const Interval fit = fitOf(a, found);
    const std::optional<double> slope = slopeOf(c, a, found, fit);
    Json waveNumbers = Json::array();
    for (size_t s = 0; s < found.energy.size(); ++s) waveNumbers.push_back(found.waveNumber(s));
    c.report(a.text("name")) = {{"kinetic_energy", found.kineticEnergy},
                                {"slope", slope ? Json(*slope) : Json()},
                                {"fit_from", fit.lower},
                                {"fit_to", fit.upper},
                                {"peak", peakWaveNumber(found)},
                                {"nyquist", found.nyquist},
                                {"shell_width", found.shellWidth},
                                {"samples", {found.samples[0], found.samples[1], found.samples[2]}},
                                {"wave_numbers", waveNumbers},
                                {"energy", found.energy}};
    const std::string law =
        slope ? fmt::format("; E(k) ~ k^{:.3g} from {:.4g} to {:.4g} (Kolmogorov: -5/3)", *slope, fit.lower, fit.upper)
              : "";
    c.info(fmt::format("spectrum: kinetic energy {:.4g}, peak at {:.4g} cycles per world unit{}", found.kineticEnergy,
                       peakWaveNumber(found), law));
    if (options.window != SpectrumWindow::none && peakWaveNumber(found) == found.waveNumber(1))
        c.warn(
            fmt::format("the peak is at the lowest wave number that the box can show, {:.4g} cycles per world unit, "
                        "so larger eddies may be cut off; use a larger box",
                        found.shellWidth));
    if (!a.given("plot")) return;
    const std::string svg =
        plotSvg(plotOf(found, fit, slope.has_value()),
                {.title = a.text("title"), .yLabel = "energy per wave number", .logX = true, .logY = true});
    writeAtomically(a.text("plot"), [&](std::ostream& out) { out << svg; });
    c.info(fmt::format("wrote {}", a.text("plot")));
}

} // namespace

Registry spectrumActions() {
    std::vector<Option> options = spectrumBinding().options();
    options.push_back(interval("fit", "1 / world unit",
                               "range of wave numbers in which the slope is measured (default: from the peak of the "
                               "energy to half of the grid's Nyquist wave number)"));
    options.push_back(text(
        "plot", "",
        ".svg file for a plot of the energy against the wave number, with Kolmogorov's slope; -: standard output"));
    options.push_back(text("title", "", "title above the plot"));
    options.push_back(text("name", "spectrum", "name of the figures in the report"));
    return {{.name = "spectrum",
             .group = "grids",
             .summary = "energy spectrum of the newest velocity grid: kinetic energy by wave number, and its slope",
             .takes = {stays("velocity", {Kind::velocity})},
             .makes = {made("report", {Kind::report})},
             .options = std::move(options),
             .examples = {"curlew -noise octaves=5 gain=0.37 -noise octaves=5 gain=0.37 seed=1 -dfvn speed=1 "
                          "box=-2,-2,-2,2,2,2 -velocity dim=128 -spectrum plot=spectrum.svg"},
             .evaluation = Evaluation::effect,
             .run = spectrum,
             .prepare =
                 [](const Arguments& a) {
                     if (a.given("plot")) checkWritable(a.text("plot"));
                 },
             .files =
                 [](const Arguments& a) {
                     FileUse use;
                     if (a.given("plot")) use.written = {a.text("plot")};
                     return use;
                 }}};
}

} // namespace curlew::app
