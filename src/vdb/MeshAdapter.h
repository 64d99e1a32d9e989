// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/vdb/MeshFile.h"

#include <openvdb/math/Transform.h>

#include <vector>

namespace curlew {

/// A mesh in the index space of a grid, with the interface that OpenVDB's meshToVolume requires.
class MeshAdapter {
  public:
    MeshAdapter(const Mesh& mesh, const openvdb::math::Transform& transform) : mMesh(mesh) {
        mIndexSpace.reserve(mesh.points.size());
        for (const auto& p : mesh.points) mIndexSpace.push_back(transform.worldToIndex(openvdb::Vec3d(p)));
    }

    size_t polygonCount() const { return mMesh.faces(); }
    size_t pointCount() const { return mMesh.points.size(); }
    size_t vertexCount(size_t face) const { return face < mMesh.triangles.size() ? 3 : 4; }
    void getIndexSpacePoint(size_t face, size_t corner, openvdb::Vec3d& position) const {
        position = mIndexSpace[vertex(face, corner)];
    }
    /// Returns a vertex of a face in world units.
    openvdb::Vec3d point(size_t face, size_t corner) const {
        return openvdb::Vec3d(mMesh.points[vertex(face, corner)]);
    }

    openvdb::Index32 vertex(size_t face, size_t corner) const {
        const size_t triangles = mMesh.triangles.size();
        return face < triangles ? mMesh.triangles[face].asV()[corner] : mMesh.quads[face - triangles].asV()[corner];
    }

  private:
    const Mesh& mMesh;
    std::vector<openvdb::Vec3d> mIndexSpace; ///< The points.
};

} // namespace curlew
