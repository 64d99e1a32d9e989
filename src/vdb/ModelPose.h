// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/vdb/ModelData.h"

namespace curlew {

/// Returns the transform of each node to world space, at a time of a clip (on the time axis of its keys, in seconds),
/// or without a clip if it is null.
std::vector<openvdb::Mat4d> nodesAt(const ModelData& data, const ModelData::Clip* clip, double time);

/// Returns the points of all parts in world space, one part after another.
std::vector<openvdb::Vec3s> pointsAt(const ModelData& data, const ModelData::Clip* clip, double time);

} // namespace curlew
