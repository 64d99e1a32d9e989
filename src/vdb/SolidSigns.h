// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/base/Monitor.h"

#include <openvdb/openvdb.h>

namespace curlew {

/// Voxels closer to a surface than this are told apart themselves, in voxels; others follow them.
inline constexpr double kNearSurface = 1.5;

/// Of distances whose sign is known within kNearSurface: gives all others of the band that of the neighbour closest to
/// the surface, step by step. There is no surface between the two.
void spreadSigns(openvdb::FloatGrid& grid, const Monitor& monitor);

/// Whether no two neighbours differ in sign that are together farther from the surface than from each other: there can
/// be no surface between them.
bool signsAgree(const openvdb::FloatGrid& grid, const Monitor& monitor);

} // namespace curlew
