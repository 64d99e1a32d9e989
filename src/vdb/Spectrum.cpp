// SPDX-License-Identifier: Apache-2.0
#include "curlew/vdb/Spectrum.h"

#include "DenseBox.h"
#include "curlew/base/Error.h"
#include "curlew/base/Memory.h"
#include "curlew/base/Parallel.h"
#include "curlew/vdb/Openvdb.h"

#include <fmt/format.h>
#include <kissfft/kissfft.hh>

#include <algorithm>
#include <limits>
#include <numbers>

namespace curlew {

namespace {

using openvdb::Coord;
using Complex = std::complex<double>;

/// A box of samples, z fastest.
struct SpectrumSamples {
    openvdb::CoordBBox box;
    std::array<size_t, 3> size{};
    std::vector<Complex> values;

    explicit SpectrumSamples(const openvdb::CoordBBox& voxels) : box(voxels) {
        const Coord dim = voxels.dim();
        for (size_t axis = 0; axis < 3; ++axis) size[axis] = static_cast<size_t>(dim[static_cast<int>(axis)]);
        values.resize(size[0] * size[1] * size[2]);
    }
    size_t stride(size_t axis) const { return axis == 0 ? size[1] * size[2] : axis == 1 ? size[2] : 1; }
};

openvdb::CoordBBox boxOf(const openvdb::Vec3SGrid& velocity) {
    const auto box = velocity.evalActiveVoxelBoundingBox();
    if (box.empty()) throw ValueError("a spectrum needs a grid with active voxels");
    if (!hasCubicVoxels(velocity)) throw ValueError("a spectrum needs cubic voxels");
    const Coord dim = box.dim();
    if (box.volume() == 1) throw ValueError("a spectrum needs more than one voxel");
    requireMemory(static_cast<double>(box.volume()) * sizeof(Complex),
                  fmt::format("the spectrum of {} x {} x {} voxels", dim[0], dim[1], dim[2]), "use larger voxels");
    return box;
}

/// The axes along which the velocity changes.
struct Varying {
    std::array<bool, 3> axes{};
    Varying& operator+=(const Varying& o) {
        for (size_t axis = 0; axis < 3; ++axis) axes[axis] |= o.axes[axis];
        return *this;
    }
    bool everywhere() const { return axes[0] && axes[1] && axes[2]; }
};

/// Returns the result of use(grid, voxels) for layers of a box, summed.
template <class Use>
auto sumOfLayers(const openvdb::Vec3SGrid& velocity, const openvdb::CoordBBox& box, const Use& use) {
    return parallelSum(static_cast<size_t>(box.dim()[0]), 1, [&](size_t begin, size_t end) {
        const openvdb::tree::ValueAccessor<const openvdb::Vec3STree, /*IsSafe=*/false> grid(velocity.tree());
        auto layers = box;
        layers.min()[0] = box.min()[0] + static_cast<int>(begin);
        layers.max()[0] = box.min()[0] + static_cast<int>(end) - 1;
        return use(grid, layers);
    });
}

/// Compares each voxel with the first one in its row along each axis. Rounding errors are no changes.
Varying varyingIn(const openvdb::Vec3SGrid& velocity, const openvdb::CoordBBox& box) {
    constexpr double kRounding = 1e-5; // of the rms speed
    const double squares = sumOfLayers(velocity, box, [](const auto& grid, const openvdb::CoordBBox& layers) {
        double sum = 0;
        for (auto voxel = layers.begin(); voxel; ++voxel) sum += openvdb::Vec3d(grid.getValue(*voxel)).lengthSqr();
        return sum;
    });
    const double same = kRounding * kRounding * squares / static_cast<double>(box.volume());
    return sumOfLayers(velocity, box, [&](const auto& grid, const openvdb::CoordBBox& layers) {
        Varying found;
        for (auto voxel = layers.begin(); voxel && !found.everywhere(); ++voxel)
            for (int axis = 0; axis < 3; ++axis) {
                Coord first = *voxel;
                first[axis] = box.min()[axis];
                const openvdb::Vec3d change(grid.getValue(*voxel) - grid.getValue(first));
                if (!(change.lengthSqr() <= same)) found.axes[static_cast<size_t>(axis)] = true;
            }
        return found;
    });
}

/// Returns the number of voxels along the shortest edge along which the velocity changes; of a constant velocity, along
/// the longest edge.
size_t shortestVarying(const std::array<size_t, 3>& size, const Varying& varying) {
    size_t shortest = std::max({size[0], size[1], size[2]});
    for (size_t axis = 0; axis < 3; ++axis)
        if (varying.axes[axis]) shortest = std::min(shortest, size[axis]);
    return shortest;
}

/// Returns the window along one axis, periodic: 0 midway between the last sample and the first.
std::vector<double> windowOf(size_t size, SpectrumWindow kind) {
    std::vector<double> window(size, 1);
    if (kind == SpectrumWindow::hann)
        for (size_t i = 0; i < size; ++i) {
            const double sine = std::sin(std::numbers::pi * (static_cast<double>(i) + 0.5) / static_cast<double>(size));
            window[i] = sine * sine;
        }
    return window;
}

/// The mean, and the energy of the fluctuations before and after the window.
struct WaveMoments {
    double mean = 0, energy = 0, windowed = 0;
    WaveMoments& operator+=(const WaveMoments& o) {
        mean += o.mean;
        energy += o.energy;
        windowed += o.windowed;
        return *this;
    }
};

/// Reads one component, subtracts its mean and multiplies it by the window.
WaveMoments read(const openvdb::Vec3SGrid& velocity, int component, const std::array<std::vector<double>, 3>& window,
                 SpectrumSamples& samples) {
    const size_t nx = samples.size[0], ny = samples.size[1], nz = samples.size[2];
    const auto count = static_cast<double>(samples.values.size());
    const size_t plane = ny * nz;
    WaveMoments total = parallelSum(nx, 1, [&](size_t begin, size_t end) {
        const openvdb::tree::ValueAccessor<const openvdb::Vec3STree, /*IsSafe=*/false> grid(velocity.tree());
        WaveMoments sum;
        for (size_t n = begin * plane; n < end * plane; ++n) {
            const Coord ijk = samples.box.min().offsetBy(static_cast<int>(n / plane), static_cast<int>(n / nz % ny),
                                                         static_cast<int>(n % nz));
            const auto value = static_cast<double>(grid.getValue(ijk)[component]);
            samples.values[n] = value;
            sum.mean += value;
        }
        return sum;
    });
    if (!std::isfinite(total.mean)) throw ValueError("the grid has velocities that are not finite");
    const double mean = total.mean / count;
    total = parallelSum(nx, 1, [&](size_t begin, size_t end) {
        WaveMoments sum;
        for (size_t n = begin * plane; n < end * plane; ++n) {
            const double rest = samples.values[n].real() - mean;
            const double seen = rest * window[0][n / plane] * window[1][n / nz % ny] * window[2][n % nz];
            samples.values[n] = seen;
            sum.energy += 0.5 * rest * rest;
            sum.windowed += 0.5 * seen * seen;
        }
        return sum;
    });
    return {mean, total.energy / count, total.windowed / count};
}

/// Transforms all lines along one axis.
void transform(SpectrumSamples& samples, size_t axis) {
    const size_t length = samples.size[axis], stride = samples.stride(axis), lines = samples.values.size() / length;
    parallelFor(lines, 256, [&](size_t begin, size_t end) {
        const kissfft<double> fft(length, false); // has a buffer, so each thread needs its own
        std::vector<Complex> line(length), transformed(length);
        for (size_t n = begin; n < end; ++n) {
            Complex* first = samples.values.data() + n / stride * stride * length + n % stride;
            for (size_t k = 0; k < length; ++k) line[k] = first[k * stride];
            fft.transform(line.data(), transformed.data());
            for (size_t k = 0; k < length; ++k) first[k * stride] = transformed[k];
        }
    });
}

/// Returns the square of one component of a coefficient's wave number, in shells. `shells`: shells per cycle over the
/// box.
double shellsSquared(size_t k, size_t size, double shells) {
    const double cycles = static_cast<double>(std::min(k, size - k)) * shells;
    return cycles * cycles;
}

struct Shells {
    std::vector<double> energy;
    Shells& operator+=(const Shells& o) {
        energy.resize(std::max(energy.size(), o.energy.size()));
        for (size_t s = 0; s < o.energy.size(); ++s) energy[s] += o.energy[s];
        return *this;
    }
};

/// Returns the energy of the coefficients in each shell. A shell is as wide as one cycle over `shortest` voxels.
Shells shellsOf(const SpectrumSamples& samples, size_t shortest, size_t count) {
    const size_t nx = samples.size[0], ny = samples.size[1], nz = samples.size[2];
    const auto edge = static_cast<double>(shortest), total = static_cast<double>(samples.values.size());
    return parallelSum(nx, 1, [&](size_t begin, size_t end) {
        Shells sum{std::vector<double>(count)};
        for (size_t i = begin; i < end; ++i)
            for (size_t j = 0; j < ny; ++j)
                for (size_t k = 0; k < nz; ++k) {
                    const double squared = shellsSquared(i, nx, edge / static_cast<double>(nx)) +
                                           shellsSquared(j, ny, edge / static_cast<double>(ny)) +
                                           shellsSquared(k, nz, edge / static_cast<double>(nz));
                    const auto shell = static_cast<size_t>(std::lround(std::sqrt(squared)));
                    sum.energy[shell] += 0.5 * std::norm(samples.values[(i * ny + j) * nz + k]) / (total * total);
                }
        return sum;
    });
}

/// Sums over shells of log k, log E and their products, each shell weighted by 1/k.
struct LogSums {
    double weights = 0, k = 0, E = 0, kk = 0, kE = 0;
};

/// Calls use(shell, wave number) for the shells in a range that have energy.
template <class Use>
void forShells(const EnergySpectrum& spectrum, double lower, double upper, const Use& use) {
    for (size_t s = 1; s < spectrum.energy.size(); ++s)
        if (const double k = spectrum.waveNumber(s); k >= lower && k <= upper && spectrum.energy[s] > 0) use(s, k);
}

LogSums logSums(const EnergySpectrum& spectrum, double lower, double upper) {
    LogSums sums;
    forShells(spectrum, lower, upper, [&](size_t s, double waveNumber) {
        const double weight = 1 / waveNumber, k = std::log(waveNumber), E = std::log(spectrum.energy[s]);
        sums.weights += weight;
        sums.k += weight * k;
        sums.E += weight * E;
        sums.kk += weight * k * k;
        sums.kE += weight * k * E;
    });
    if (shellsIn(spectrum, lower, upper) < kShellsForSlope)
        throw ValueError(fmt::format(
            "a slope needs at least two shells with energy between the wave numbers {:.4g} and {:.4g}", lower, upper));
    return sums;
}

} // namespace

EnergySpectrum energySpectrum(const openvdb::Vec3SGrid& velocity, const SpectrumOptions& options,
                              const Monitor& monitor) {
    SpectrumSamples samples(boxOf(velocity));
    const Varying varying = varyingIn(velocity, samples.box);
    const size_t shortest = shortestVarying(samples.size, varying);
    const double voxel = velocity.voxelSize()[0];
    EnergySpectrum spectrum{.shellWidth = 1 / (static_cast<double>(shortest) * voxel),
                            .nyquist = 1 / (2 * voxel),
                            .samples = samples.box.dim()};
    const size_t count = static_cast<size_t>(std::ceil(std::sqrt(3) / 2 * static_cast<double>(shortest))) + 2;
    spectrum.energy.resize(count);
    std::array<std::vector<double>, 3> window;
    for (size_t axis = 0; axis < 3; ++axis)
        window[axis] = windowOf(samples.size[axis], varying.axes[axis] ? options.window : SpectrumWindow::none);
    for (int component = 0; component < 3; ++component) {
        const WaveMoments moments = read(velocity, component, window, samples);
        for (size_t axis = 0; axis < 3; ++axis) {
            monitor.check();
            transform(samples, axis);
        }
        const Shells shells = shellsOf(samples, shortest, count);
        // Scales by the energy that the window has removed.
        const double whole = moments.windowed > 0 ? moments.energy / moments.windowed : 0;
        for (size_t s = 0; s < count; ++s) spectrum.energy[s] += whole * shells.energy[s] / spectrum.shellWidth;
        const double ofMean = 0.5 * moments.mean * moments.mean;
        spectrum.energy[0] += ofMean / spectrum.shellWidth;
        spectrum.kineticEnergy += moments.energy + ofMean;
    }
    return spectrum;
}

size_t shellsIn(const EnergySpectrum& spectrum, double lower, double upper) {
    size_t count = 0;
    forShells(spectrum, lower, upper, [&](size_t, double) { ++count; });
    return count;
}

double powerLawSlope(const EnergySpectrum& spectrum, double lower, double upper) {
    const LogSums sums = logSums(spectrum, lower, upper);
    return (sums.weights * sums.kE - sums.k * sums.E) / (sums.weights * sums.kk - sums.k * sums.k);
}

std::vector<double> powerLaw(const EnergySpectrum& spectrum, double slope, double lower, double upper) {
    const LogSums sums = logSums(spectrum, lower, upper);
    const double level = (sums.E - slope * sums.k) / sums.weights;
    std::vector<double> law(spectrum.energy.size(), std::numeric_limits<double>::quiet_NaN());
    for (size_t s = 1; s < law.size(); ++s) law[s] = std::exp(level + slope * std::log(spectrum.waveNumber(s)));
    return law;
}

double peakWaveNumber(const EnergySpectrum& spectrum) {
    const auto peak = std::max_element(spectrum.energy.begin() + 1, spectrum.energy.end());
    return spectrum.waveNumber(static_cast<size_t>(peak - spectrum.energy.begin()));
}

} // namespace curlew
