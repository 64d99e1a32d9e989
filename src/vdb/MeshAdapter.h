// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/vdb/MeshFile.h"

#include <openvdb/math/Transform.h>

namespace curlew {

/// A mesh in the index space of a grid, with the interface that OpenVDB's meshToVolume requires.
class MeshAdapter {
  public:
    MeshAdapter(const Mesh& mesh, const openvdb::math::Transform& transform) : mMesh(mesh), mTransform(transform) {}

    size_t polygonCount() const { return mMesh.faces(); }
    size_t pointCount() const { return mMesh.points.size(); }
    size_t vertexCount(size_t face) const { return face < mMesh.triangles.size() ? 3 : 4; }
    void getIndexSpacePoint(size_t face, size_t corner, openvdb::Vec3d& position) const {
        position = mTransform.worldToIndex(point(face, corner));
    }
    /// Returns a vertex of a face in world units.
    openvdb::Vec3d point(size_t face, size_t corner) const {
        const size_t triangles = mMesh.triangles.size();
        const openvdb::Index32* corners =
            face < triangles ? mMesh.triangles[face].asV() : mMesh.quads[face - triangles].asV();
        return openvdb::Vec3d(mMesh.points[corners[corner]]);
    }

  private:
    const Mesh& mMesh;
    const openvdb::math::Transform& mTransform;
};

} // namespace curlew
