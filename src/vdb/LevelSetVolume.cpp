// SPDX-License-Identifier: Apache-2.0
#include "curlew/vdb/LevelSetVolume.h"

#include "curlew/field/ForEachBatch.h"
#include "curlew/vdb/Openvdb.h"

#include <algorithm>
#include <cmath>

namespace curlew {

double volumeOf(const LevelSet& levelSet, const Monitor& monitor) {
    // Voxels: more than half of the diagonal, because values may be larger than distances.
    constexpr double kNear = 1.5;
    const openvdb::FloatGrid& grid = *levelSet.grid;
    const double voxel = levelSet.voxelSize();
    double whole = 0; // voxels
    std::vector<openvdb::Coord> cut;
    for (auto value = grid.tree().cbeginValueAll(); value; ++value)
        if (value.isVoxelValue() && std::abs(static_cast<double>(*value)) < kNear * voxel)
            cut.push_back(value.getCoord());
        else if (*value < 0)
            whole += static_cast<double>(value.getVoxelCount());
    const auto eighth = [&](size_t k) {
        const auto offset = [k](size_t bit) { return (k >> bit & 1) == 0 ? -0.25 : 0.25; };
        const auto p = grid.indexToWorld(cut[k / 8].asVec3d() + openvdb::Vec3d(offset(0), offset(1), offset(2)));
        return Vec3d{{p[0], p[1], p[2]}};
    };
    const Sdf sdf = sdfOf(levelSet);
    const double parts = sumOverBatches(
        PointsBy{8 * cut.size(), eighth},
        [&](const PointBatch& points, size_t) {
            JetBatch<double, 1> distance;
            sdf.distance.eval(points, distance);
            double sum = 0;
            for (int i = 0; i < points.size; ++i) {
                const double width = std::max(length(distance[i].gradient), 1e-3) * voxel / 2;
                sum += std::clamp(0.5 - distance[i].value / width, 0.0, 1.0);
            }
            return sum;
        },
        monitor);
    return (whole + parts / 8) * voxel * voxel * voxel;
}

} // namespace curlew
