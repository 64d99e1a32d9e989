// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/base/Monitor.h"
#include "curlew/math/Vec.h"
#include "curlew/vdb/MeshFile.h"

#include <functional>

namespace curlew {

/// Separates the parts of a triangle mesh that bound a solid from those that do not. Triangles are cut into pieces of
/// about a voxel. A piece is kept if exactly one of its sides is inside the solid, and hidden otherwise. Where kept and
/// hidden pieces meet, they are cut again into pieces of about 0.4 voxels. So the kept part of a face ends within the
/// size of such a piece from where the surface of the solid leaves the face.
class FacePieces {
  public:
    /// Returns whether a face bounds the solid at a position on it, which means that exactly one of position ± step is
    /// inside. World units. Must be thread-safe.
    using Bounds = std::function<bool(const Vec3d& position, const Vec3d& step)>;

    FacePieces(const Mesh& mesh, double voxel, const Bounds& isBoundary, const Monitor& monitor);

    /// Moves out the kept faces: whole triangles if all of their pieces are kept, otherwise the kept pieces.
    Mesh takeSurface() { return std::move(mSurface); }
    /// Fraction of the area that is hidden.
    double hidden() const { return mHidden; }

  private:
    Mesh mSurface;
    double mHidden = 0;
};

} // namespace curlew
