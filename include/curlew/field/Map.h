// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/field/ScalarField.h"

namespace curlew {

// Fields evaluated elsewhere: at moved, projected, lifted or displaced positions. The chain rule keeps their
// derivatives exact.

/// Where a field is put: first scaled, then rotated, then moved.
template <int N>
struct PlacementN {
    Vec<double, N> offset{};            ///< World units.
    Vec3d rotate{};                     ///< Degrees about x, then y, then z; in 2D only z turns, elsewhere nothing.
    Vec<double, N> scale = filled(1.0); ///< Per axis, not zero.

    friend bool operator==(const PlacementN&, const PlacementN&) = default;

  private:
    static Vec<double, N> filled(double value) {
        Vec<double, N> v;
        v.c.fill(value);
        return v;
    }
};
using Placement = PlacementN<3>;

/// The rotation of a placement. Throws ValueError for one that the dimension does not have.
template <int N>
Matrix<N, N> rotationOf(const PlacementN<N>& placement);

/// `field` put elsewhere: its value at R S p + offset is the field's at p. Throws ValueError for a scale of zero, and
/// for a rotation that the dimension does not have.
template <int N>
ScalarFieldN<N> placed(const ScalarFieldN<N>& field, const PlacementN<N>& placement);
inline ScalarField placed(const ScalarField& field, const Placement& placement) { return placed<3>(field, placement); }

/// field(A x): a field of M variables as one of N. Rows of A that are rows of the identity pick coordinates: so a 2D
/// field becomes one in 3D that does not change along z.
template <int M, int N>
ScalarFieldN<N> projected(const ScalarFieldN<M>& field, const Matrix<M, N>& A);

/// field(x, w1(x), …): a field of M variables on the graph of M - N = 1 or 2 functions of N (docs/math.md). A flow made
/// of such fields is the flow of the higher dimension, projected, and still divergence-free. With constant functions it
/// is a slice. Call it as lifted<N>(field, {w1, …}).
template <int N, int M>
ScalarFieldN<N> lifted(const ScalarFieldN<M>& field, const std::array<ScalarFieldN<N>, size_t{M - N}>& graph);

/// x_N - height(x_1 … x_{N-1}): zero on the surface of a terrain, negative below it. Not a distance where it is steep.
/// N = 2 … 7.
template <int N>
ScalarFieldN<N> heightField(const ScalarFieldN<N - 1>& height);

/// field(x + amount * grad by(x)): a field displaced by the gradient of another. Its derivatives need those of `by` to
/// one order more: it is C² where `by` is C³, and for a `by` that is only C² its Hessian jumps where third derivatives
/// of `by` do. Its own third ones are not there, so it cannot itself displace another (ValueError).
template <int N>
ScalarFieldN<N> displaced(const ScalarFieldN<N>& field, const ScalarFieldN<N>& by, double amount);

} // namespace curlew
