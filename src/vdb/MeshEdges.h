// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/vdb/MeshFile.h"

#include <cstdint>
#include <numeric>
#include <span>
#include <vector>

// The edges of triangle meshes, and the parts that they join.
namespace curlew {

/// A side of a triangle.
struct TriangleSide {
    uint64_t edge; ///< The two points: the lower index in the upper half, the higher one in the lower half.
    uint32_t triangle;
    bool up; ///< Whether the triangle runs from the lower index to the higher one.
};

/// Returns the sides of all triangles with three distinct points, sorted by edge, those of an edge by triangle.
std::vector<TriangleSide> sidesByEdge(const Mesh& mesh);

/// Calls use(sides) for each edge.
template <class Use>
void forEachEdge(const std::vector<TriangleSide>& sides, const Use& use) {
    for (size_t begin = 0; begin < sides.size();) {
        size_t end = begin + 1;
        while (end < sides.size() && sides[end].edge == sides[begin].edge) ++end;
        use(std::span(sides).subspan(begin, end - begin));
        begin = end;
    }
}

/// Returns whether an edge is used equally often in both directions.
bool isBalanced(std::span<const TriangleSide> sides);
/// Returns whether that is so for all edges of a triangle mesh. Then winding numbers are integers.
bool isOriented(const Mesh& mesh);

/// Numbers that are joined to groups (union-find).
class Groups {
  public:
    explicit Groups(size_t count) : mParent(count) { std::iota(mParent.begin(), mParent.end(), 0u); }

    void join(uint32_t a, uint32_t b) { mParent[of(a)] = of(b); }
    /// Returns the member that stands for the group of n.
    uint32_t of(uint32_t n) {
        while (mParent[n] != n) n = mParent[n] = mParent[mParent[n]];
        return n;
    }

  private:
    std::vector<uint32_t> mParent;
};

} // namespace curlew
