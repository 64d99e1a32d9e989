// SPDX-License-Identifier: Apache-2.0
#include "curlew/base/Error.h"
#include "curlew/base/Parallel.h"
#include "curlew/base/Random.h"
#include "curlew/vdb/Openvdb.h"
#include "curlew/vdb/Spectrum.h"
#include "support/Catch.h"

#include <numbers>
#include <numeric>

using namespace curlew;
using openvdb::Coord;
using openvdb::Vec3s;

namespace {

constexpr double kTurn = 2 * std::numbers::pi;

/// Returns a grid of the given size whose velocity is a function of the voxel.
template <class Velocity>
openvdb::Vec3SGrid::Ptr gridOf(const Coord& size, double voxel, const Velocity& velocity) {
    const auto grid = openvdb::Vec3SGrid::create(Vec3s(0));
    grid->setTransform(openvdb::math::Transform::createLinearTransform(voxel));
    auto voxels = grid->getAccessor();
    for (int i = 0; i < size[0]; ++i)
        for (int j = 0; j < size[1]; ++j)
            for (int k = 0; k < size[2]; ++k) voxels.setValue({i - 3, j, k + 7}, Vec3s(velocity(Coord(i, j, k))));
    return grid;
}

/// Returns a different velocity for each voxel.
openvdb::Vec3d unlike(const Coord& ijk) {
    const auto index = static_cast<uint64_t>((ijk[0] * 100 + ijk[1]) * 100 + ijk[2]);
    return {randomUniform(1, index, 0), randomUniform(1, index, 1) - 0.5, 3 * randomUniform(1, index, 2)};
}

double total(const EnergySpectrum& s) { return std::accumulate(s.energy.begin(), s.energy.end(), 0.0) * s.shellWidth; }

/// A sum of 400 real plane waves with random phases. Their wave numbers are evenly distributed on a logarithmic scale,
/// and their energies follow a power law.
openvdb::Vec3SGrid::Ptr powerLaw(int size, double slope) {
    struct Wave {
        openvdb::Vec3d k, amplitude;
        double phase;
    };
    std::vector<Wave> waves;
    for (uint64_t n = 0; n < 400; ++n) {
        const double length = std::pow(size / 3.0, (static_cast<double>(n) + 0.5) / 400);
        const double z = 2 * randomUniform(2, n, 0) - 1, angle = kTurn * randomUniform(2, n, 1);
        const double r = std::sqrt(1 - z * z);
        Wave wave{{std::round(length * r * std::cos(angle)), std::round(length * r * std::sin(angle)),
                   std::round(length * z)},
                  {0, 0, 0},
                  kTurn * randomUniform(2, n, 2)};
        // Each interval of log k has equally many waves, so the energy in it is k E(k).
        if (wave.k.lengthSqr() > 0) wave.amplitude[n % 3] = std::pow(wave.k.length(), (slope + 1) / 2);
        waves.push_back(wave);
    }
    return gridOf(Coord(size), 1.0 / size, [&](const Coord& ijk) {
        openvdb::Vec3d u(0);
        for (const Wave& wave : waves)
            u += wave.amplitude * std::cos(kTurn / size * wave.k.dot(ijk.asVec3d()) + wave.phase);
        return u;
    });
}

} // namespace

TEST_CASE("energySpectrum: shells sum to the mean kinetic energy", "[vdb]") {
    const Coord size = GENERATE(Coord(16, 16, 16), Coord(12, 9, 14), Coord(7, 22, 13));
    const auto window = GENERATE(SpectrumWindow::none, SpectrumWindow::hann);
    CAPTURE(size, static_cast<int>(window));
    double energy = 0;
    for (int i = 0; i < size[0]; ++i)
        for (int j = 0; j < size[1]; ++j)
            for (int k = 0; k < size[2]; ++k) energy += 0.5 * openvdb::Vec3d(Vec3s(unlike({i, j, k}))).lengthSqr();
    energy /= static_cast<double>(size[0]) * size[1] * size[2];
    const EnergySpectrum spectrum = energySpectrum(*gridOf(size, 0.1, unlike), {.window = window});
    CHECK(spectrum.samples == size);
    CHECK(spectrum.nyquist == Approx(5));
    CHECK(spectrum.kineticEnergy == Approx(energy).epsilon(1e-13));
    CHECK(total(spectrum) == Approx(energy).epsilon(1e-12)); // Parseval's theorem
}

TEST_CASE("energySpectrum: a plane wave appears in the shell of its wave number", "[vdb]") {
    // 3, 4 and 12 cycles along the edges of a cube of 2 units: a wave number of 13 cycles, 6.5 cycles per unit.
    const int n = 32;
    const auto wave = gridOf(Coord(n), 2.0 / n, [&](const Coord& ijk) {
        const double phase = kTurn / n * (3 * ijk[0] - 4 * ijk[1] + 12 * ijk[2]);
        return openvdb::Vec3d(0, 2 * std::sin(phase), std::cos(phase));
    });
    const EnergySpectrum spectrum = energySpectrum(*wave, {.window = SpectrumWindow::none});
    CHECK(spectrum.shellWidth == Approx(0.5));
    CHECK(peakWaveNumber(spectrum) == Approx(6.5));
    for (size_t s = 0; s < spectrum.energy.size(); ++s) {
        CAPTURE(s);
        // ½ (2² + 1²) times the mean of a squared sine. The grid is in float.
        CHECK(spectrum.energy[s] * spectrum.shellWidth == Approx(s == 13 ? 1.25 : 0).margin(1e-12).epsilon(1e-6));
    }
    // In a box of twice the length, and with a window, most of the energy is near that shell.
    const auto longer = gridOf(Coord(n, 2 * n, n), 2.0 / n, [&](const Coord& ijk) {
        const double phase = kTurn / n * (3 * ijk[0] - 4 * ijk[1] + 12 * ijk[2]);
        return openvdb::Vec3d(std::sin(phase), 0, 0);
    });
    CHECK(peakWaveNumber(energySpectrum(*longer, {.window = SpectrumWindow::none})) == Approx(6.5));
    const EnergySpectrum seen = energySpectrum(*wave, {.window = SpectrumWindow::hann});
    double near = 0;
    for (size_t s = 11; s <= 15; ++s) near += seen.energy[s] * seen.shellWidth;
    CHECK(near == Approx(1.25).epsilon(0.01));
}

TEST_CASE("energySpectrum: the mean velocity is in the first shell", "[vdb]") {
    const auto wind = gridOf(Coord(8, 9, 10), 0.5, [](const Coord&) { return openvdb::Vec3d(1, -2, 0.5); });
    for (const auto window : {SpectrumWindow::none, SpectrumWindow::hann}) {
        const EnergySpectrum spectrum = energySpectrum(*wind, {.window = window});
        CHECK(spectrum.energy[0] * spectrum.shellWidth == Approx(0.5 * 5.25));
        for (size_t s = 1; s < spectrum.energy.size(); ++s) CHECK(spectrum.energy[s] < 1e-25);
    }
}

TEST_CASE("energySpectrum: of a flow in two dimensions does not depend on how thick its grid is", "[vdb]") {
    constexpr int kEdge = 48;
    const auto spectrumOf = [&](const Coord& size, int flat) {
        return energySpectrum(*gridOf(size, 1.0 / kEdge, [&](Coord ijk) {
            const double rounding = 1e-7 * (ijk[flat] & 1);
            ijk[flat] = 0;
            return (1 + rounding) * unlike(ijk) +
                   openvdb::Vec3d(std::cos(5 * kTurn / kEdge * (ijk[0] + ijk[1] + ijk[2])));
        }));
    };
    const int flat = GENERATE(0, 1, 2);
    Coord size(kEdge);
    size[flat] = 1;
    const EnergySpectrum layer = spectrumOf(size, flat);
    CHECK(layer.shellWidth == Approx(1));
    CHECK(peakWaveNumber(layer) == Approx(7)); // 5 cycles along each of two axes
    for (const int thickness : {2, 5, 80}) {
        size[flat] = thickness;
        const EnergySpectrum slab = spectrumOf(size, flat);
        CAPTURE(flat, thickness);
        REQUIRE(slab.energy.size() == layer.energy.size());
        for (size_t s = 0; s < layer.energy.size(); ++s)
            CHECK(slab.energy[s] ==
                  Approx(layer.energy[s]).epsilon(1e-6).margin(1e-12)); // of the same order as `rounding`
    }
}

TEST_CASE("powerLawSlope: finds the slope of a power law", "[vdb]") {
    EnergySpectrum exact{.shellWidth = 0.25, .energy = std::vector<double>(60)};
    for (size_t s = 1; s < 60; ++s) exact.energy[s] = 3 * std::pow(exact.waveNumber(s), -5.0 / 3);
    CHECK(powerLawSlope(exact, 0.5, 14) == Approx(-5.0 / 3).epsilon(1e-12));
    const auto law = powerLaw(exact, -5.0 / 3, 2, 5);
    for (size_t s = 1; s < 60; ++s) CHECK(law[s] == Approx(exact.energy[s]).epsilon(1e-12));
    CHECK(std::isnan(law[0]));
    CHECK_THROWS_WITH(powerLawSlope(exact, 0.3, 0.5), Catch::ContainsSubstring("two shells"));
    const double slope = GENERATE(-5.0 / 3, -3.0);
    CAPTURE(slope);
    const auto spectrum = energySpectrum(*powerLaw(48, slope), {.window = SpectrumWindow::none});
    // The sum has 400 random waves; shells above 16 have no energy.
    CHECK(powerLawSlope(spectrum, 2, 14) == Approx(slope).margin(0.15));
}

TEST_CASE("energySpectrum: does not depend on the number of threads", "[vdb]") {
    const auto grid = gridOf(Coord(20, 21, 22), 0.1, unlike);
    const EnergySpectrum all = energySpectrum(*grid);
    const ThreadLimit one(1);
    CHECK(energySpectrum(*grid).energy == all.energy);
}

TEST_CASE("energySpectrum: unsuitable grids are errors that say why", "[vdb]") {
    CHECK_THROWS_WITH(energySpectrum(*openvdb::Vec3SGrid::create()), Catch::ContainsSubstring("active voxels"));
    CHECK_THROWS_WITH(energySpectrum(*gridOf(Coord(1), 1, unlike)), Catch::ContainsSubstring("one voxel"));
    const auto nowhere = gridOf(Coord(4), 1, [](const Coord&) { return openvdb::Vec3d(std::nan("")); });
    CHECK_THROWS_WITH(energySpectrum(*nowhere), Catch::ContainsSubstring("not finite"));
}
