#pragma once

#include "curlew/base/Error.h"

#include <fmt/format.h>

namespace curlew {

constexpr double kLeastVoxel = 1.5e-5; ///< OpenVDB takes no voxel below 3e-15 in volume.

inline void requireVoxel(double voxel) {
    if (!(voxel >= kLeastVoxel))
        throw ValueError(
            fmt::format("voxels of {:g} are too small for OpenVDB, which takes {:g} and more; choose "
                        "larger ones, or scale the scene up",
                        voxel, kLeastVoxel));
}

} // namespace curlew
