// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/base/Monitor.h"
#include "curlew/flow/Domain.h"
#include "curlew/track/WallVelocity.h"
#include "curlew/vdb/GridTypes.h"
#include "curlew/vdb/Voxels.h"

namespace curlew {

struct DisplacedAirOptions {
    Voxels voxels;           ///< Those of velocityGrid(), from voxelsOf().
    int corrections = 2;     ///< How often velocities on faces of the wall are taken from the previous solution.
    double tolerance = 1e-6; ///< Of the Poisson solver: residual relative to the sources, both by the maximum norm.
    int iterations = 10000;  ///< Maximum per solution.
};

/// The velocity of the air that a moving obstacle displaces.
struct DisplacedAir {
    /// Staggered (MAC), world units per second. All voxels of the box are active in which the velocity is not zero.
    /// Inside the obstacle it holds the velocity of the wall, w. Also has the values of the faces that end the box
    /// above, in inactive voxels.
    std::shared_ptr<openvdb::Vec3SGrid> faces;
    size_t voxels = 0;  ///< Voxels of air.
    int iterations = 0; ///< Of all solutions.
};

/// Computes the potential flow ∇φ around a moving obstacle in the box of its domain: Δφ = 0 in the air, ∂φ/∂n is the
/// normal velocity of the wall, and φ = 0 beyond the box, so air can pass through it. Unlike w (WallVelocity.h), which
/// fades out across the layer, it reaches as far as the box, and it is divergence-free for a wall that deforms, too.
///
/// Voxels are air if their centres are outside the wall. The velocity is the difference of φ between two voxels of air,
/// so its discrete divergence in the air is the residual of the solver, OpenVDB's Poisson solver (conjugate gradients).
/// On a face between air and wall, it follows from the normal velocity of the wall and, by extrapolation, from the
/// previous solution. (OpenVDB's tools::PotentialFlow leaves out the velocity along the wall there, and does not
/// converge at the wall: docs/math.md has figures.)
///
/// The result has the same bytes for any number of threads. Throws ValueError if the domain is infinite, has no wall or
/// a wall that is not an obstacle (Side::outside), if the distance of the wall is not known for 3 voxels, if the box
/// has no voxel of air or none of the obstacle, or if the solver does not converge, as in air that the obstacle
/// encloses. Throws ResourceError if the solution would not fit in memory.
DisplacedAir displacedAir(const Domain& domain, const WallVelocity& wall, const DisplacedAirOptions& options,
                          const Monitor& monitor = {});

} // namespace curlew
