// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "EdgePotentials.h"
#include "curlew/field/ScalarField.h"

namespace curlew {

/// A frame of lattice coordinates: A x + b, in units of the edges of the cells.
struct LatticeFrame {
    Matrix3 toLattice;
    Vec3d shift;
};

/// Returns one component of the potentials as a field in world space, times a factor: the spline of degree 2 along its
/// axis, whose integrals over the edges are the given ones, and of degree 3 across, which interpolates between them.
///
/// These degrees are those of a discrete de Rham complex of splines (Buffa, Rivas, Sangalli and Vazquez, "Isogeometric
/// discrete differential forms in three dimensions", 2011): the curl of such splines is the spline of degree 3 along
/// and 2 across whose fluxes through the faces are the circulations of the edges. So it does not depend on the gauge.
///
/// Beyond the lattice, its polynomials continue and come to rest within one edge, so that the curl is continuous there
/// too. It is C² across its axis and C¹ along it (C¹ across the sides of the lattice). Not defined for fewer than 4
/// cells along an axis.
ScalarField edgeSpline(const EdgePotentials& potentials, int axis, const LatticeFrame& frame, double factor);

} // namespace curlew
