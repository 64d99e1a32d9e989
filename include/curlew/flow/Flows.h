// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/field/Transforms.h"
#include "curlew/flow/FlowInTime.h"

namespace curlew {

// Flows that are not given by N - 1 potentials. All but gradientFlow() are divergence-free.

/// Classical curl noise, curl ψ (Bridson et al. 2007; Catlike Coding, "Noise Derivatives"), of three independent
/// fields. If the domain has a wall, ψ is ramped to zero at it (layerRamp), which makes each of the three terms tangent
/// to the wall.
Flow curlFlow(const std::array<ScalarField, 3>& psi, const Domain& domain = {});

/// Curl noise of three 2D fields over different pairs of axes: ψ_x over z and y, ψ_y over x and z, ψ_z over y and x.
/// Every component of the curl then uses both derivatives of two of them (Catlike Coding). It costs a third of 3D
/// noise.
Flow curlFlow(const std::array<ScalarFieldN<2>, 3>& psi, const Domain& domain = {});

/// The same velocity everywhere. It has tracks: straight lines. Throws ValueError if the velocity is zero.
Flow uniformFlow(const Vec3d& velocity, const Domain& domain = {});

/// A vortex about the y axis with the angular velocity 2 pi turns / (1 + r²/core²) at the distance r (Kaufmann and
/// Scully). It is a rigid rotation near the axis and slows down away from it. It has tracks: circles. Throws ValueError
/// if `core` is not positive, or if `turns` is zero or not finite.
Flow vortexFlow(double turns, double core, const Domain& domain = {});

/// A column that rises along y at speed / (1 + y / height) and spreads as it slows down. Catlike Coding adds
/// 1 / (1 + y) to the velocity itself, which is not divergence-free. This flow is the curl of a vector potential and
/// has that upward component. Below y = 0 the component is continued by its Taylor polynomial, C², because it would
/// become infinite at y = -height. A sum without tracks. Throws ValueError if `height` is not positive, or if `speed`
/// is zero or not finite.
Flow updraftFlow(double speed, double height, const Domain& domain = {});

/// Returns the flow, rotated and translated: its velocity at R p + offset is R times that of `flow` at p. The domain
/// stays. Throws ValueError unless the velocity is that of potentials, if the flow has a wall, or if the placement
/// scales.
Flow placed(const Flow& flow, const Placement& placement);

/// The gradient of a field as a velocity, in world units per second. Not divergence-free: points gather at the maxima,
/// which are sinks (Catlike Coding, "Noise Derivatives", shows this before the curl). Its velocity gradient is the
/// Hessian of the field. 2D and 3D.
template <int N>
FlowN<N> gradientFlow(const ScalarFieldN<N>& field, const DomainN<N>& domain = {});

/// The deformation field of a common test of level-set methods (LeVeque 1996; Enright, Fedkiw, Ferziger and Mitchell
/// 2002): u = 2 sin²(πx) sin(2πy) sin(2πz), v = -sin(2πx) sin²(πy) sin(2πz), w = -sin(2πx) sin(2πy) sin²(πz), times
/// `amplitude`, in the box [0,1]³. A sum without tracks, periodic beyond the box.
Flow enrightFlow(double amplitude = 1);

/// The same flow times cos(πt/period). It brings everything that it moved in the first half of the period back in the
/// second half. The test moves a sphere of radius 0.15 about (0.35, 0.35, 0.35) through a period of 3 seconds. Throws
/// ValueError if the period is not positive.
FlowInTime enrightFlowInTime(double period = 3);

} // namespace curlew
