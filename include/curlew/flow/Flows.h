#pragma once

#include "curlew/flow/Flow.h"

namespace curlew {

// Flows that are made of something else than N - 1 potentials. All are divergence-free.

/// Classical curl noise, curl ψ (Bridson et al. 2007; Catlike Coding, "Noise Derivatives"), of three independent
/// fields.
Flow curlFlow(const std::array<ScalarField, 3>& psi, const Domain& domain = {});

/// Curl noise of three 2D fields, each over another pair of axes: ψ_x over z and y, ψ_y over x and z, ψ_z over y and x,
/// so that every component of the curl uses both derivatives of two of them (Catlike Coding). A third of the cost of 3D
/// noise.
Flow curlFlow(const std::array<ScalarFieldN<2>, 3>& psi, const Domain& domain = {});

/// The same velocity everywhere. It has tracks: the straight lines. Throws ValueError for a velocity of zero.
Flow uniformFlow(const Vec3d& velocity, const Domain& domain = {});

/// A vortex about the y axis: the angular velocity at the distance r is 2 pi turns / (1 + r²/core²) (Kaufmann and
/// Scully): a rigid rotation near the axis, slower and slower away from it. It has tracks: circles. Throws ValueError
/// for a core that is not positive and for no turns.
Flow vortexFlow(double turns, double core, const Domain& domain = {});

/// A column that rises along y at speed / (1 + y / height) and spreads as it slows down: Catlike Coding adds 1 / (1 +
/// y) to the velocity itself, which is not divergence-free; this is the flow whose potential has that upward component.
/// Below y = 0, where that would become infinite, it goes on as its Taylor polynomial, C². A sum without tracks. Throws
/// ValueError for a height that is not positive and for a speed of zero.
Flow updraftFlow(double speed, double height, const Domain& domain = {});

} // namespace curlew
