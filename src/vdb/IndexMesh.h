// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/math/Vec.h"
#include "curlew/vdb/MeshFile.h"

#include <openvdb/math/Transform.h>

#include <algorithm>
#include <array>
#include <vector>

namespace curlew {

/// A mesh in the index space of a grid.
class IndexMesh {
  public:
    IndexMesh(const Mesh& mesh, const openvdb::math::Transform& transform) : mMesh(mesh) {
        mIndexSpace.reserve(mesh.points.size());
        for (const auto& p : mesh.points) {
            const openvdb::Vec3d q = transform.worldToIndex(openvdb::Vec3d(p));
            mIndexSpace.push_back({{q[0], q[1], q[2]}});
        }
    }

    /// The size of the box around the points, in voxels.
    Vec3d size() const {
        Vec3d least = mIndexSpace.front(), most = least;
        for (const Vec3d& p : mIndexSpace)
            for (int axis = 0; axis < 3; ++axis) {
                least[axis] = std::min(least[axis], p[axis]);
                most[axis] = std::max(most[axis], p[axis]);
            }
        return most - least;
    }
    size_t polygonCount() const { return mMesh.faces(); }
    size_t pointCount() const { return mMesh.points.size(); }
    size_t vertexCount(size_t face) const { return face < mMesh.triangles.size() ? 3 : 4; }
    /// Returns a vertex of a face in voxels.
    const Vec3d& indexPoint(size_t face, size_t corner) const { return mIndexSpace[vertex(face, corner)]; }
    /// Calls use(corners, numbers) with the triangles of a face, in voxels, and the numbers of their corners.
    template <class Use>
    void forTriangles(size_t face, const Use& use) const {
        const auto triangle = [&](size_t b, size_t c) {
            use(std::array{indexPoint(face, 0), indexPoint(face, b), indexPoint(face, c)},
                std::array<size_t, 3>{0, b, c});
        };
        triangle(1, 2);
        if (vertexCount(face) == 4) triangle(2, 3);
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
    std::vector<Vec3d> mIndexSpace; ///< The points.
};

} // namespace curlew
