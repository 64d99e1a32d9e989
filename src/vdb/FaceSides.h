// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "MeshAdapter.h"

#include <vector>

namespace curlew {

/// On which side of a mesh positions are, as told by their closest faces. For a closed mesh whose triangles are
/// oriented and do not cross each other that is exactly whether they are inside: the closest point's normal decides, at
/// an edge the sum of those of its triangles, at a corner the sum weighted by their angles there (Bærentzen and Aanæs
/// 2005, "Signed distance computation using the angle weighted pseudonormal").
class FaceSides {
  public:
    /// A mesh of triangles only, which has to stay.
    FaceSides(const Mesh& mesh, const openvdb::math::Transform& transform);

    /// Positive in front of the mesh, from where its corners run counter-clockwise. `p`: in voxels. `face`: the
    /// closest.
    double sideOf(size_t face, const openvdb::Vec3d& p) const;

  private:
    openvdb::Vec3d cornerOf(size_t face, size_t k) const;
    openvdb::Vec3d normalOf(size_t face) const;

    const Mesh& mMesh;
    MeshAdapter mAdapter;
    std::vector<openvdb::Index32> mFirst,
        mFaces; ///< The faces at vertex n: mFaces[mFirst[n]] to mFaces[mFirst[n + 1]].
};

} // namespace curlew
