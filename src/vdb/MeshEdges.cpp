// SPDX-License-Identifier: Apache-2.0
#include "MeshEdges.h"

#include <tbb/parallel_sort.h>

#include <algorithm>

namespace curlew {

std::vector<TriangleSide> sidesByEdge(const Mesh& mesh) {
    std::vector<TriangleSide> sides;
    sides.reserve(3 * mesh.triangles.size());
    for (size_t n = 0; n < mesh.triangles.size(); ++n) {
        const auto& t = mesh.triangles[n];
        if (t[0] == t[1] || t[1] == t[2] || t[2] == t[0]) continue;
        for (int k = 0; k < 3; ++k) {
            const uint64_t a = t[k], b = t[(k + 1) % 3];
            sides.push_back({std::min(a, b) << 32 | std::max(a, b), static_cast<uint32_t>(n), a < b});
        }
    }
    tbb::parallel_sort(sides.begin(), sides.end(), [](const TriangleSide& a, const TriangleSide& b) {
        return std::pair(a.edge, a.triangle) < std::pair(b.edge, b.triangle);
    });
    return sides;
}

bool isBalanced(std::span<const TriangleSide> sides) {
    const auto up = std::count_if(sides.begin(), sides.end(), [](const TriangleSide& side) { return side.up; });
    return 2 * static_cast<size_t>(up) == sides.size();
}

bool isOriented(const Mesh& mesh) {
    bool oriented = true;
    forEachEdge(sidesByEdge(mesh), [&](std::span<const TriangleSide> sides) { oriented &= isBalanced(sides); });
    return oriented;
}

} // namespace curlew
