// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "IndexMesh.h"
#include "TriangleDistances.h"
#include "curlew/base/Monitor.h"

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

namespace curlew {

/// The faces near each leaf of a grid. Refers to the mesh.
class LeafFaces {
  public:
    /// `reach`: how near, in voxels, to the centre of any voxel of the leaf. A few faces are a little farther away.
    LeafFaces(const IndexMesh& mesh, double reach, const Monitor& monitor);

    size_t leaves() const { return mFirst.size() - 1; }
    /// Returns the first voxel of a leaf. The leaves are in the order of these.
    openvdb::Coord origin(size_t leaf) const { return mRuns[mFirst[leaf]].leaf << 3; }
    /// Calls use(triangles) with some triangles near a leaf after the other, without those that are farther from all of
    /// its voxels than another one. Those of the face nearest to its centre are the first, and the others are in the
    /// order of their faces.
    void forTriangles(size_t leaf, const std::function<void(std::span<const LeafTriangle>)>& use) const;

  private:
    struct Near {
        uint32_t face;
        float distance; ///< From the centre of the leaf, in voxels.
    };
    /// The faces of a chunk near a leaf.
    struct Run {
        openvdb::Coord leaf; ///< Its first voxel, divided by 8.
        uint32_t chunk, begin, end;
    };

    const IndexMesh& mMesh;
    double mReach;
    std::vector<std::vector<Near>> mFaces; ///< By chunk, leaf by leaf.
    std::vector<Run> mRuns;                ///< By leaf, then by chunk.
    std::vector<size_t> mFirst;            ///< Of each leaf, in mRuns; at the end their number.
};

} // namespace curlew
