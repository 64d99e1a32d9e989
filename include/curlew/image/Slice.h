#pragma once

#include "curlew/base/Monitor.h"
#include "curlew/flow/Flow.h"
#include "curlew/image/Image.h"

#include <functional>

namespace curlew {

struct SliceOptions {
    int axis = 2;          ///< The plane is perpendicular to this axis (0, 1, 2 for x, y, z).
    double position = 0;   ///< Where on that axis, world units.
    int width = 800;       ///< Pixels.
    int supersampling = 2; ///< Samples per pixel along each edge, averaged.
};

/// A scalar that a slice shows: its values at a batch of positions; NaN where there is nothing to show.
using SliceChannel = std::function<void(const PointBatch&, std::array<float, kBatch>&)>;

/// The scalar `channel` on a plane through `box`, which fills the picture but for a margin. x points right (across x:
/// z), y up (across y: z). Throws ValueError for an infinite or empty box and for a width that is not positive.
Image slice(const Box& box, const SliceChannel& channel, std::string name, const SliceOptions& options,
            const Monitor& monitor = {});

/// Channels of a flow, within its domain: "speed", "vx", "vy", "vz", "f", "g", "distance". ValueError for other names.
SliceChannel flowChannel(const Flow& flow, std::string_view name);

} // namespace curlew
