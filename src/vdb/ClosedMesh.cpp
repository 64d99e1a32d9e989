// SPDX-License-Identifier: Apache-2.0
#include "ClosedMesh.h"

#include "FaceSides.h"
#include "MeshDistances.h"
#include "MeshShells.h"
#include "SolidChecks.h"
#include "SolidSigns.h"
#include "WindingMoments.h"
#include "curlew/base/Parallel.h"
#include "curlew/vdb/Openvdb.h"
#include "curlew/vdb/WindingNumber.h"

#include <cmath>
#include <vector>

namespace curlew {

namespace {

using openvdb::FloatGrid;

/// Gives distances near the mesh the sign of the side of their closest face.
void signNear(FloatGrid& grid, const openvdb::Int32Grid& closest, const FaceSides& sides, const Monitor& monitor) {
    std::vector<openvdb::FloatTree::LeafNodeType*> leaves;
    grid.tree().getNodes(leaves);
    const auto near = static_cast<float>(kNearSurface * grid.voxelSize()[0]);
    parallelFor(
        leaves.size(), 16,
        [&](size_t begin, size_t end) {
            const openvdb::tree::ValueAccessor<const openvdb::Int32Tree> face(closest.tree());
            for (size_t n = begin; n < end; ++n)
                for (auto value = leaves[n]->beginValueOn(); value; ++value) {
                    if (!(*value < near)) continue;
                    const auto voxel = value.getCoord();
                    if (sides.sideOf(static_cast<size_t>(face.getValue(voxel)), voxel.asVec3d()) < 0)
                        value.setValue(-*value);
                }
        },
        monitor);
}

/// Returns the largest triangle of each shell of a mesh.
std::vector<winding::Triangle> onePerShell(const Mesh& mesh) {
    const MeshShells shells = shellsOf(mesh);
    std::vector<winding::Triangle> largest(shells.count);
    std::vector<double> areas(shells.count, -1);
    for (size_t n = 0; n < mesh.triangles.size(); ++n) {
        const winding::Triangle triangle = winding::triangleOf(mesh, n);
        const double area = length(triangle.area());
        const uint32_t shell = shells.ofTriangle[n];
        if (area > areas[shell]) {
            areas[shell] = area;
            largest[shell] = triangle;
        }
    }
    return largest;
}

enum class InFront { outside, inside, mixed };

/// Returns what lies in front of the faces of all shells.
InFront inFront(const Mesh& mesh, const Monitor& monitor) {
    const std::vector<winding::Triangle> shells = onePerShell(mesh);
    if (shells.size() == 1) return volumeOf(mesh) < 0 ? InFront::inside : InFront::outside;
    const WindingNumber winding(mesh, monitor);
    std::vector<Vec3d> positions;
    for (const winding::Triangle& t : shells) {
        const double size = std::sqrt(length(t.area()));
        positions.push_back(t.middle() + (size > 0 ? t.area() * (1e-3 / size) : Vec3d{}));
    }
    size_t outside = 0, inside = 0;
    for (const double w : winding.at(positions, monitor)) {
        outside += std::lround(w) == 0;
        inside += std::lround(w) == -1;
    }
    return outside == shells.size() ? InFront::outside : inside == shells.size() ? InFront::inside : InFront::mixed;
}

} // namespace

FloatGrid::Ptr closedLevelSet(const Mesh& mesh, const openvdb::math::Transform& transform, double halfWidth,
                              bool& turned, const Monitor& monitor) {
    const auto [grid, face] = distancesTo(mesh, transform, halfWidth, monitor);
    const Monitor quiet = monitor.quiet();
    signNear(*grid, *face, FaceSides(mesh, transform), quiet);
    spreadSigns(*grid, quiet);
    if (!signsAgree(*grid, quiet)) return nullptr;
    const InFront front = inFront(mesh, quiet);
    if (front == InFront::mixed) return nullptr;
    turned = front == InFront::inside;
    if (turned)
        for (auto value = grid->beginValueOn(); value; ++value) value.setValue(-*value);
    return grid;
}

} // namespace curlew
