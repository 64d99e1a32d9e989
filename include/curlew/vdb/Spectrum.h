// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/base/Monitor.h"

#include <openvdb/openvdb.h>

#include <string_view>
#include <vector>

namespace curlew {

/// What is done about the ends of a box whose content does not repeat.
enum class SpectrumWindow {
    none, ///< Nothing: right for what tiles with the box. Anything else has a jump there, whose spectrum falls as k^-2.
    hann  ///< Fluctuations fade out towards the ends. Peaks are as wide as three shells.
};
/// In the order of the enumerators.
inline constexpr std::array<std::string_view, 2> kSpectrumWindowNames{"none", "hann"};

struct SpectrumOptions {
    SpectrumWindow window = SpectrumWindow::hann;
};

/// How the kinetic energy of a velocity field, ½ |u|² per mass, is shared among wave numbers.
struct EnergySpectrum {
    /// Cycles per world unit, as a noise's frequency: the width of a shell, 1 / the shortest edge of the box, and the
    /// largest wave number that the voxels can hold. Shell s is about s shellWidth.
    double shellWidth = 0, nyquist = 0;
    /// E(k) of each shell, energy per wave number: their sum times shellWidth is kineticEnergy. The first has the mean
    /// velocity's. Shells beyond nyquist have only the corners of the box of wave numbers.
    std::vector<double> energy = {};
    double kineticEnergy = 0; ///< The mean of ½ |u|² over the box, (world units / s)².
    openvdb::Coord samples = {};

    double waveNumber(size_t shell) const { return static_cast<double>(shell) * shellWidth; }
};

/// The spectrum of the smallest box around a velocity grid's active voxels; voxels that are not active count as they
/// are (0 for a background of 0). Of a staggered grid each component is taken on its own faces, which changes no
/// energy. Transforms: KISS FFT in double; memory: 16 bytes for each voxel of the box. Same bytes for any number of
/// threads. Throws ValueError for a grid without active voxels, a box of less than 2 voxels along an axis, voxels that
/// are no cubes, and values that are not finite; ResourceError if the box would not fit the memory.
EnergySpectrum energySpectrum(const openvdb::Vec3SGrid& velocity, const SpectrumOptions& options = {},
                              const Monitor& monitor = {});

/// The slope of a power law through the shells with wave numbers from `lower` to `upper`, cycles per world unit: least
/// squares over log k and log E, each shell weighted with 1/k, so that every octave counts the same. Throws ValueError
/// if less than 2 shells with energy are there.
double powerLawSlope(const EnergySpectrum& spectrum, double lower, double upper);

/// E(k) of the power law with this slope through the same shells, for every shell; NaN for the first.
std::vector<double> powerLaw(const EnergySpectrum& spectrum, double slope, double lower, double upper);

/// The wave number, beyond 0, whose shell has most energy.
double peakWaveNumber(const EnergySpectrum& spectrum);

} // namespace curlew
