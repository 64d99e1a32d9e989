// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/base/Monitor.h"
#include "curlew/math/Vec.h"
#include "curlew/vdb/MeshFile.h"

#include <functional>

namespace curlew {

/// The triangles of a mesh, cut into pieces of about a voxel, and sorted by whether both of their sides are inside or
/// outside of a solid, or one is. Where pieces of both sorts meet, they are cut again, into pieces of about 0.4
/// voxels, so that what is kept ends within such a piece of where the surface of the solid leaves the face.
class FacePieces {
  public:
    /// Whether a face bounds the solid at a position on it: one of position ± step is inside. World units. Thread-safe.
    using Bounds = std::function<bool(const Vec3d& position, const Vec3d& step)>;

    FacePieces(const Mesh& mesh, double voxel, const Bounds& bounds, const Monitor& monitor);

    /// Those with the inside on one side: whole triangles where all of their pieces have, and the pieces of others.
    Mesh takeSurface() { return std::move(mSurface); }
    /// The others' share of the area.
    double hidden() const { return mHidden; }

  private:
    Mesh mSurface;
    double mHidden = 0;
};

} // namespace curlew
