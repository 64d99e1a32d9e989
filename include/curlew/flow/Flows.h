// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/flow/FlowInTime.h"

namespace curlew {

// Flows that are made of something else than N - 1 potentials. All are divergence-free.

/// Classical curl noise, curl ψ (Bridson et al. 2007; Catlike Coding, "Noise Derivatives"), of three independent
/// fields. If the domain has a wall, ψ is ramped to zero at it (layerRamp): each of the three terms is tangent to the
/// wall then.
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

/// The deformation field with which level sets are tested (LeVeque 1996; Enright, Fedkiw, Ferziger and Mitchell 2002):
/// u = 2 sin²(πx) sin(2πy) sin(2πz), v = -sin(2πx) sin²(πy) sin(2πz), w = -sin(2πx) sin(2πy) sin²(πz), times the
/// amplitude, in the box [0,1]³. A sum without tracks, periodic beyond the box.
Flow enrightFlow(double amplitude = 1);

/// The same times cos(πt/period): what it has carried off by half of the period it brings back by its end. The test
/// carries a sphere of radius 0.15 about (0.35, 0.35, 0.35) through a period of 3 seconds. Throws ValueError for a
/// period that is not positive.
FlowInTime enrightFlowInTime(double period = 3);

} // namespace curlew
