// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "FaceVelocities.h"

namespace curlew {

/// A discrete vector potential: component k at (i, j, k) is its integral over the edge from lattice corner (i, j, k) to
/// the next corner along axis k, in units of velocity times the length of an edge. The circulation around a face is the
/// flux through it.
struct EdgePotentials {
    std::array<Lattice<double>, 3> along;
    Lattice<double>& operator[](int axis) { return along[static_cast<size_t>(axis)]; }
    const Lattice<double>& operator[](int axis) const { return along[static_cast<size_t>(axis)]; }

    /// Returns the velocity through the lower face of a cell along an axis.
    double curl(int axis, const Vec<int, 3>& face) const;
};

/// Returns potentials of divergence-free velocities by summing up fluxes: the z component is zero, the others are sums
/// along z.
EdgePotentials sweep(const FaceVelocities& velocities);

struct Gauge {
    EdgePotentials potentials;
    int iterations = 0;
    size_t channels = 0; ///< Number of connected stationary parts through which the flow passes: a torus, a channel.
};

/// Subtracts a gradient from the potentials. It leaves their curl as it is, makes them small and smooth (the sum of the
/// potentials that leave a corner is zero), and zero on all edges between two corners that are `stationary`: those of
/// solids and of closed sides of the box, where nothing flows through the faces between them. It cannot be zero around
/// a hole through which the flow passes, so a connected stationary part with such a hole counts as not stationary.
Gauge gauged(const EdgePotentials& potentials, const Lattice<uint8_t>& stationary, const Monitor& monitor);

} // namespace curlew
