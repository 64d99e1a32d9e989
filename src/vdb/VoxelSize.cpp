// SPDX-License-Identifier: Apache-2.0
#include "VoxelSize.h"

#include "curlew/base/Error.h"
#include "curlew/base/PacedMonitor.h"
#include "curlew/base/Parallel.h"

#include <fmt/format.h>
#include <tbb/parallel_sort.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <numeric>

namespace curlew {

namespace {

struct Bounds {
    std::array<double, 3> low, high;

    /// Throws ValueError if a position is not finite.
    explicit Bounds(const Points& particles) {
        const std::array<const std::vector<double>*, 3> axes{&particles.x, &particles.y, &particles.z};
        size_t bad = 0;
        for (size_t axis = 0; axis < 3; ++axis) {
            low[axis] = std::numeric_limits<double>::infinity(), high[axis] = -low[axis];
            for (const double value : *axes[axis]) {
                bad += !std::isfinite(value);
                low[axis] = std::min(low[axis], value), high[axis] = std::max(high[axis], value);
            }
        }
        if (bad > 0)
            throw ValueError(
                fmt::format("{} coordinates of the {} particles are not finite numbers; remove those particles", bad,
                            particles.size()));
    }

    double extent() const { return std::max({high[0] - low[0], high[1] - low[1], high[2] - low[2]}); }

    double largest() const {
        double result = 0;
        for (size_t axis = 0; axis < 3; ++axis) result = std::max({result, -low[axis], high[axis]});
        return result;
    }
};

constexpr double kMaxCoordinate = 1 << 30; // in voxels, so that neighbours still have 32-bit coordinates

uint64_t spread(uint64_t bits21) {
    uint64_t spread = 0;
    for (int bit = 0; bit < 21; ++bit) spread |= (bits21 >> bit & 1) << 3 * bit;
    return spread;
}

/// Chooses a voxel size. Two points that are adjacent in Morton order (Morton 1966) are in different octree cells from
/// the level on at which their codes differ. So one sort counts the occupied cells of all levels.
double chosenVoxelSize(const Points& particles, const Bounds& bounds, const Monitor& monitor) {
    constexpr int kLevels = 21;
    constexpr double kPointsPerVoxel = 8;
    const double extent = bounds.extent();
    if (!(extent > 0)) return 0.1;

    std::array<uint64_t, 128> spreads; // for 7 bits each
    for (uint64_t bits = 0; bits < spreads.size(); ++bits) spreads[bits] = spread(bits);
    const double scale = ((1 << kLevels) - 1) / extent;
    std::vector<uint64_t> codes(particles.size());
    parallelFor(
        codes.size(), 4096,
        [&](size_t begin, size_t end) {
            const auto code = [&](double value, double low) {
                const auto cell = std::min(uint64_t((value - low) * scale), uint64_t((1 << kLevels) - 1));
                return spreads[cell & 127] | spreads[cell >> 7 & 127] << 21 | spreads[cell >> 14] << 42;
            };
            for (size_t n = begin; n < end; ++n)
                codes[n] = code(particles.x[n], bounds.low[0]) << 2 | code(particles.y[n], bounds.low[1]) << 1 |
                           code(particles.z[n], bounds.low[2]);
        },
        monitor);
    tbb::parallel_sort(codes, [ask = PacedMonitor(monitor)](uint64_t a, uint64_t b) {
        ask();
        return a < b;
    });

    std::array<size_t, kLevels + 1> cells{1}; // occupied cells at each level
    for (size_t n = 1; n < codes.size(); ++n)
        if (codes[n] != codes[n - 1]) ++cells[1 + (size_t(std::countl_zero(codes[n] ^ codes[n - 1])) - 1) / 3];
    std::partial_sum(cells.begin(), cells.end(), cells.begin());

    const double wanted = std::max(1.0, double(particles.size()) / kPointsPerVoxel);
    size_t level = 1;
    while (level < kLevels && double(cells[level]) < wanted) ++level;
    const double above = std::log(double(cells[level - 1])), below = std::log(double(cells[level]));
    const double part = below > above ? std::clamp((std::log(wanted) - above) / (below - above), 0.0, 1.0) : 0.0;
    return extent * std::exp2(-(double(level) - 1 + part));
}

} // namespace

void requireVoxel(double voxel) {
    if (!(voxel >= kSmallestVoxel))
        throw ValueError(
            fmt::format("voxels of {:g} are too small for OpenVDB, which takes {:g} and more; choose "
                        "larger ones, or scale the scene up",
                        voxel, kSmallestVoxel));
}

double voxelSizeFor(const Points& particles, double given, const Monitor& monitor) {
    const Bounds bounds(particles);
    const double smallest = std::max(kSmallestVoxel, bounds.largest() / kMaxCoordinate);
    const double voxel = given == 0 ? std::max(smallest, chosenVoxelSize(particles, bounds, monitor)) : given;
    if (!(voxel >= smallest) || !std::isfinite(voxel * voxel * voxel))
        throw ValueError(
            fmt::format("the voxel size {:g} does not suit these points; give at least {:g}, or 0 to have it chosen",
                        voxel, smallest));
    return voxel;
}

} // namespace curlew
