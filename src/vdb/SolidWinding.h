// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/vdb/WindingNumber.h"

#include <cmath>
#include <optional>

namespace curlew {

/// The winding numbers that decide what is inside a mesh. What is inside its closed shells alone is inside, too: an
/// open sheet beside or across a closed body, such as the ground under it or a plane that cuts it, has |w| = 1/2 on
/// both of its sides. Added to the 1 of the body, that may leave 1/2, and the body would have a hole there. A closed
/// shell that shares a point with an open one counts as open, and cavities of open ones do not count by themselves.
/// Immutable; safe to share between threads.
class SolidWinding {
  public:
    /// The mesh has triangles only, with shared points (distinctTriangles() in SolidChecks.h).
    SolidWinding(const Mesh& mesh, const Monitor& monitor);

    /// The margin exceeds the error of w: a flat sheet, on which w is 1/2, encloses nothing.
    static bool isInside(double w) { return std::abs(w) > 0.5 + 1e-3; }

    /// As in WindingNumber. But inside the closed shells these return their winding number, 1 farther from zero: across
    /// their faces it jumps by more than 1, even if a sheet passes within the same voxel.
    double at(const Vec3d& position) const;
    std::vector<double> at(std::span<const Vec3d> positions, const Monitor& monitor) const;
    std::array<double, 2> beside(const Vec3d& position, const Vec3d& step) const;

  private:
    WindingNumber mAll;
    std::optional<WindingNumber> mClosed; ///< Of the closed shells, if there are open ones too.
};

} // namespace curlew
