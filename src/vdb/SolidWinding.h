// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "SolidFaces.h"
#include "curlew/vdb/WindingNumber.h"

#include <cmath>
#include <optional>

namespace curlew {

/// The winding numbers that decide what is inside a mesh. What is inside its closed shells alone is inside, too: an
/// open sheet beside or across a closed body, such as the ground under it or a plane that cuts it, has |w| = 1/2 on
/// both of its sides. Added to the 1 of the body, that may leave 1/2, and the body would have a hole there. Cavities of
/// open shells do not count by themselves (solidShells() in MeshShells.h). Immutable; safe to share between threads.
class SolidWinding {
  public:
    SolidWinding(const SolidFaces& faces, const Monitor& monitor);

    /// The margin exceeds the error of w: a flat sheet, on which w is 1/2, encloses nothing.
    static bool isInside(double w) { return std::abs(w) > 0.5 + 1e-3; }

    /// As in WindingNumber. But inside the closed shells these return their winding number, 1 farther from zero, if
    /// there are open ones: across their faces it jumps by more than 1, even if a sheet passes within the same voxel.
    double at(const Vec3d& position) const;
    std::vector<double> at(std::span<const Vec3d> positions, const Monitor& monitor) const;
    std::array<double, 2> beside(const Vec3d& position, const Vec3d& step) const;

  private:
    std::optional<WindingNumber> mClosed, mOthers; ///< Of the parts of the mesh, if it has such.
};

} // namespace curlew
