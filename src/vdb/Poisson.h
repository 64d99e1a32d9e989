// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/base/Monitor.h"
#include "curlew/vdb/Openvdb.h"

#include <openvdb/math/ConjGradient.h>

#include <functional>

namespace curlew {

/// Changes the source at an active voxel and the diagonal element of its row, given an inactive neighbour. Called from
/// several threads.
using PoissonBoundary =
    std::function<void(const openvdb::Coord& voxel, const openvdb::Coord& neighbour, double& source, double& diagonal)>;

/// Solves the Poisson equation on the active voxels of `sources`, whose values are the sources times the square of the
/// voxel size, by OpenVDB's conjugate gradients with an incomplete Cholesky preconditioner, on staggered voxels,
/// restarted where OpenVDB gives up. The state holds the limits, and afterwards what was reached. Throws Interrupted on
/// cancellation.
openvdb::DoubleTree::Ptr solvePoisson(const openvdb::DoubleTree& sources, const PoissonBoundary& boundary,
                                      openvdb::math::pcg::State& state, const Monitor& monitor);

} // namespace curlew
