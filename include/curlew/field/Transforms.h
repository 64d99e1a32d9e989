// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/field/ScalarField.h"

namespace curlew {

// Fields evaluated at other positions: affine transforms, projection, restriction to a graph, domain warp. The chain
// rule keeps their derivatives exact.

/// The transform of a field: scales first, then rotates, then translates.
template <int N>
struct PlacementN {
    Vec<double, N> offset{};            ///< World units.
    Vec3d rotate{};                     ///< Degrees about x, then y, then z. 2D: only z. Other dimensions: none.
    Vec<double, N> scale = filled(1.0); ///< Per axis; must not be zero.

    friend bool operator==(const PlacementN&, const PlacementN&) = default;

  private:
    static Vec<double, N> filled(double value) {
        Vec<double, N> v;
        v.c.fill(value);
        return v;
    }
};
using Placement = PlacementN<3>;

/// Returns the rotation of a placement. Throws ValueError if the dimension does not support it.
template <int N>
Matrix<N, N> rotationOf(const PlacementN<N>& placement);

/// Returns the transformed field: its value at R S p + offset is the value of `field` at p. Throws ValueError if a
/// scale is zero or the dimension does not support the rotation.
template <int N>
ScalarFieldN<N> placed(const ScalarFieldN<N>& field, const PlacementN<N>& placement);
inline ScalarField placed(const ScalarField& field, const Placement& placement) { return placed<3>(field, placement); }

/// Returns a box that contains the transformed one. If there is a rotation, it is a cube that does so for every
/// rotation, so that an animated one does not change it. A box that is infinite in any direction stays as it is.
template <int N>
BoxN<N> placed(const BoxN<N>& box, const PlacementN<N>& placement);

/// field(A x): a field of M variables as a field of N. Rows of A that are rows of the identity select coordinates; a 2D
/// field can thus become a 3D field that is constant along z.
template <int M, int N>
ScalarFieldN<N> projected(const ScalarFieldN<M>& field, const Matrix<M, N>& A);

/// field(x, w1(x), …): the restriction of a field of M variables to the graph of M - N = 1 or 2 functions of N
/// variables (docs/math.md). A flow of such fields is the projection of the flow in the higher dimension, and is still
/// divergence-free. Constant functions give a slice. Call it as lifted<N>(field, {w1, …}).
template <int N, int M>
ScalarFieldN<N> lifted(const ScalarFieldN<M>& field, const std::array<ScalarFieldN<N>, size_t{M - N}>& graph);

/// x_N - height(x_1 … x_{N-1}): zero on the surface of a terrain, negative below it. It is not a distance where the
/// terrain is steep. N = 2 … 7.
template <int N>
ScalarFieldN<N> heightField(const ScalarFieldN<N - 1>& height);

/// field(x + amount * grad by(x)): domain warp of a field by the gradient of another. Its derivatives need those of
/// `by` to one order more. It is C² if `by` is C³; if `by` is only C², its Hessian jumps where the third derivatives of
/// `by` do. It has no third derivatives of its own, so it cannot displace another field (ValueError).
template <int N>
ScalarFieldN<N> displaced(const ScalarFieldN<N>& field, const ScalarFieldN<N>& by, double amount);

} // namespace curlew
