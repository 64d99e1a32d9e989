// SPDX-License-Identifier: Apache-2.0
#include "Cases.h"

#include <malloc.h>

namespace curlew::bench {

std::vector<PointBatch> rowBatches(double step) {
    constexpr int kRow = 8; // voxels of a leaf along an axis
    std::vector<PointBatch> batches(kBatches);
    for (int b = 0; b < kBatches; ++b)
        for (int n = 0; n < kBatch; ++n)
            batches[static_cast<size_t>(b)].push(
                {{b * step, (n / kRow) * step, (n % kRow + kRow * (b % kVoxelsPerCell)) * step}});
    return batches;
}

Flow freeFlow(const Domain& domain, double frequency) {
    const OctaveOptions octaves{.frequency = frequency};
    return Flow(noiseField<Psrd3>({.seed = 1}, octaves), noiseField<Psrd3>({.seed = 2}, octaves), domain);
}

Domain voxelDomain(int dim) {
    // The box of whole voxels: half a voxel beyond the outer voxel centres. All of these numbers are exact.
    const double voxel = 1.0 / kVoxelsPerCell, low = -0.5 * voxel, high = (dim - 0.5) * voxel;
    return {.box = {{{low, low, low}}, {{high, high, high}}}, .wall = std::nullopt};
}

void forgetMemory() { malloc_trim(0); }

} // namespace curlew::bench
