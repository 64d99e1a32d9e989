// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/base/Monitor.h"
#include "curlew/vdb/GridTypes.h"

#include <string_view>
#include <vector>

namespace curlew {

/// The window that is applied along each axis along which the velocity changes.
enum class SpectrumWindow {
    none, ///< No window, for fields that tile with the box. Other fields jump at its ends, which adds a k^-2 spectrum.
    hann  ///< Fluctuations fade out towards the ends of the box. Peaks become three shells wide.
};
/// In the order of the enumerators.
inline constexpr std::array<std::string_view, 2> kSpectrumWindowNames{"none", "hann"};

struct SpectrumOptions {
    SpectrumWindow window = SpectrumWindow::hann;
};

/// The distribution of the kinetic energy of a velocity field, ½ |u|² per mass, over wave numbers.
struct EnergySpectrum {
    /// In cycles per world unit, like the frequency of a noise: the width of a shell, which is 1 / the shortest edge of
    /// the box along which the velocity changes, and the largest wave number that the voxels resolve. Shell s is
    /// centred at s shellWidth. So the spectrum of a flow in two dimensions does not depend on how thick its grid is.
    double shellWidth = 0, nyquist = 0;
    /// E(k) of each shell, in energy per wave number. The sum times shellWidth is kineticEnergy. Shell 0 includes the
    /// energy of the mean velocity. Shells beyond nyquist are incomplete: they contain only the corners of the box of
    /// wave numbers.
    std::vector<double> energy = {};
    double kineticEnergy = 0; ///< Mean of ½ |u|² over the box, (world units / s)².
    openvdb::Coord samples = {};

    double waveNumber(size_t shell) const { return static_cast<double>(shell) * shellWidth; }
};

/// Computes the energy spectrum over the bounding box of a velocity grid's active voxels. Inactive voxels count with
/// their value, 0 for a background of 0. On a staggered grid each component is sampled at its own faces, which does not
/// change its energy. Uses KISS FFT in double, and 16 bytes of memory per voxel of the box. The result has the same
/// bytes for any number of threads. Throws ValueError if the grid has no active voxels or only one, the voxels are not
/// cubes, or a value is not finite; ResourceError if the box would not fit in memory.
EnergySpectrum energySpectrum(const openvdb::Vec3SGrid& velocity, const SpectrumOptions& options = {},
                              const Monitor& monitor = {});

/// Returns how many shells with wave numbers from `lower` to `upper`, in cycles per world unit, have energy. Shell 0
/// does not count.
size_t shellsIn(const EnergySpectrum& spectrum, double lower, double upper);

constexpr size_t kShellsForSlope = 2;

/// Fits a power law to the shells with wave numbers from `lower` to `upper`, in cycles per world unit, and returns its
/// slope. The fit is a least-squares line through log E over log k, each shell weighted by 1/k, so that every octave
/// counts the same. Throws ValueError if fewer than kShellsForSlope of these shells have energy.
double powerLawSlope(const EnergySpectrum& spectrum, double lower, double upper);

/// Returns E(k) of the power law with this slope, fitted to the same shells, for every shell; NaN for shell 0.
std::vector<double> powerLaw(const EnergySpectrum& spectrum, double slope, double lower, double upper);

/// Returns the wave number of the shell with the most energy, shell 0 excluded.
double peakWaveNumber(const EnergySpectrum& spectrum);

} // namespace curlew
