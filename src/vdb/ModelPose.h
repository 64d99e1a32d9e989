// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/vdb/ModelData.h"

namespace curlew {

/// From the space of each node to the world, at a time of a clip (seconds as its keys have them), or without one.
std::vector<openvdb::Mat4d> nodesAt(const ModelData& data, const ModelData::Clip* clip, double time);

/// The points of all parts in a row, in the world.
std::vector<openvdb::Vec3s> pointsAt(const ModelData& data, const ModelData::Clip* clip, double time);

} // namespace curlew
