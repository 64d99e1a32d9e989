// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "IndexMesh.h"
#include "VertexFaces.h"
#include "curlew/vdb/Openvdb.h"

namespace curlew {

/// Determines on which side of a mesh a position is, from its closest face. For a closed, oriented triangle mesh that
/// does not cross itself, this tells exactly whether the position is inside. The sign is that of the offset from the
/// closest point along a normal: the face's normal, at an edge the sum of the normals of its triangles, at a vertex the
/// sum weighted by their angles there (Bærentzen and Aanæs 2005, "Signed distance computation using the angle weighted
/// pseudonormal").
class FaceSides {
  public:
    /// Refers to the mesh, which must consist of triangles only.
    FaceSides(const Mesh& mesh, const openvdb::math::Transform& transform);

    /// Returns a positive value if p is in front of the mesh, where the faces run counter-clockwise. `p` is in voxels;
    /// `face` is the face closest to it.
    double sideOf(size_t face, const openvdb::Vec3d& p) const;

  private:
    openvdb::Vec3d cornerOf(size_t face, size_t k) const;
    openvdb::Vec3d normalOf(size_t face) const;

    const Mesh& mMesh;
    IndexMesh mIndexMesh;
    VertexFaces mFaces;
};

} // namespace curlew
