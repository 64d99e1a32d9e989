// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "IndexMesh.h"

#include <span>
#include <vector>

namespace curlew {

/// The faces at each vertex of a mesh, in ascending order.
class VertexFaces {
  public:
    explicit VertexFaces(const IndexMesh& mesh) : mFirst(mesh.pointCount() + 2, 0) {
        const auto forCorners = [&](const auto& use) {
            for (size_t face = 0; face < mesh.polygonCount(); ++face)
                for (size_t k = 0; k < mesh.vertexCount(face); ++k) use(face, mesh.vertex(face, k));
        };
        // Counts are stored two places further on: filling then moves each beginning to that of the next vertex.
        forCorners([&](size_t, openvdb::Index32 vertex) { ++mFirst[vertex + 2]; });
        for (size_t n = 2; n < mFirst.size(); ++n) mFirst[n] += mFirst[n - 1];
        mFaces.resize(mFirst.back());
        forCorners([&](size_t face, openvdb::Index32 vertex) {
            mFaces[mFirst[vertex + 1]++] = static_cast<openvdb::Index32>(face);
        });
    }

    std::span<const openvdb::Index32> at(openvdb::Index32 vertex) const {
        return std::span(mFaces).subspan(mFirst[vertex], mFirst[vertex + 1] - mFirst[vertex]);
    }

  private:
    std::vector<openvdb::Index32> mFirst, mFaces; ///< mFirst[n] is the place of the first face at vertex n.
};

} // namespace curlew
