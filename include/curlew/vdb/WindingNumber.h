// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/base/Monitor.h"
#include "curlew/math/Vec.h"
#include "curlew/vdb/MeshFile.h"

#include <array>
#include <memory>
#include <span>
#include <vector>

namespace curlew {

/// The generalised winding number of a mesh: w(x) = Σ Ω(x) / 4π over its triangles, where Ω is the solid angle of a
/// triangle as seen from x, positive if x is behind it (Jacobson et al. 2013, "Robust inside-outside segmentation using
/// generalized winding numbers"). w is 1 inside a closed mesh whose faces run counter-clockwise as seen from outside, 0
/// outside, -1 inside a mesh of opposite orientation, 2 where two such meshes overlap, and in between near holes. It
/// jumps by 1 across a face.
///
/// The evaluation follows Barill et al. 2018 ("Fast winding numbers for soups and clouds"). Beyond 2.7 radii, a cluster
/// of triangles is replaced by its moments, here up to second order about its centre. Closer triangles are summed
/// exactly (van Oosterom and Strackee 1983). Errors against the exact sum are below 1e-3, and 3e-4 rms. Time: O(n log
/// n) to build, O(log n) per position. Memory: 120 to 250 bytes per triangle.
///
/// Quads are split along the diagonal from their first to their third vertex. The mesh is not needed after
/// construction. Immutable; safe to share between threads. Results do not depend on the number of threads.
class WindingNumber {
  public:
    /// Throws Interrupted if the monitor asks for it, ResourceError if the tree would not fit in memory.
    explicit WindingNumber(const Mesh& mesh, const Monitor& monitor = {});

    /// Returns w at a position in world units. On a face, returns the mean of both sides. Returns 0 if the position is
    /// not finite.
    double at(const Vec3d& position) const;
    /// Returns w at many positions, computed on all threads.
    std::vector<double> at(std::span<const Vec3d> positions, const Monitor& monitor = {}) const;
    /// Returns w at position + step and position - step, for a short step, in half the time. Triangles farther away
    /// than 32 steps are evaluated once for both, so the difference of the two has an error of up to 0.01.
    std::array<double, 2> beside(const Vec3d& position, const Vec3d& step) const;
    /// Returns the exact sum over all triangles, for comparison: O(n).
    double exactAt(const Vec3d& position) const;

  private:
    struct Tree;
    std::shared_ptr<const Tree> mTree;
};

} // namespace curlew
