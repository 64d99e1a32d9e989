// SPDX-License-Identifier: Apache-2.0
#include "SurfaceVelocity.h"

#include "IndexMesh.h"
#include "MeshDistances.h"
#include "SplineField.h"
#include "curlew/base/Parallel.h"
#include "curlew/vdb/LevelSet.h"
#include "curlew/vdb/Openvdb.h"

#include <openvdb/math/Proximity.h>

#include <limits>
#include <memory>

namespace curlew {

namespace {

using Leaf = openvdb::FloatTree::LeafNodeType;

/// Returns the velocity of the point of a face that is closest to a position in world units.
openvdb::Vec3d velocityOn(const MovingSurface& surface, size_t face, const openvdb::Vec3d& position) {
    const size_t triangles = surface.mesh.triangles.size();
    const bool triangle = face < triangles;
    const openvdb::Index32* corners =
        triangle ? surface.mesh.triangles[face].asV() : surface.mesh.quads[face - triangles].asV();
    const auto point = [&](int k) { return openvdb::Vec3d(surface.mesh.points[corners[k]]); };
    const auto velocity = [&](int k) { return openvdb::Vec3d(surface.velocities[corners[k]]); };
    double closest = std::numeric_limits<double>::infinity();
    openvdb::Vec3d result(0);
    for (int k = 2; k < (triangle ? 3 : 4); ++k) {
        openvdb::Vec3d weights;
        const openvdb::Vec3d foot =
            openvdb::math::closestPointOnTriangleToPoint(point(0), point(k - 1), point(k), position, weights);
        const double squared = (position - foot).lengthSqr();
        if (!(squared < closest)) continue;
        closest = squared;
        result = velocity(0) * weights[0] + velocity(k - 1) * weights[1] + velocity(k) * weights[2];
    }
    return result;
}

} // namespace

std::array<ScalarField, 3> surfaceVelocity(const MovingSurface& surface, double voxel, double reach,
                                           const Monitor& monitor) {
    const double halfWidth = reach / voxel + kSplineSupport;
    const auto transform = openvdb::math::Transform::createLinearTransform(voxel);
    const MeshDistances near = distancesTo(surface.mesh, *transform, halfWidth, monitor);
    std::array<openvdb::FloatGrid::Ptr, 3> grids;
    std::array<std::vector<Leaf*>, 3> leaves;
    for (size_t axis = 0; axis < 3; ++axis) {
        grids[axis] = openvdb::FloatGrid::create(
            std::make_shared<openvdb::FloatTree>(near.distance->tree(), 0.0f, openvdb::TopologyCopy()));
        grids[axis]->setTransform(transform);
        grids[axis]->tree().voxelizeActiveTiles();
        grids[axis]->tree().getNodes(leaves[axis]);
    }
    parallelFor(
        leaves[0].size(), 8,
        [&](size_t begin, size_t end) {
            const openvdb::tree::ValueAccessor<const openvdb::Int32Tree> faces(near.face->tree());
            for (size_t n = begin; n < end; ++n)
                for (auto value = leaves[0][n]->beginValueOn(); value; ++value) {
                    const openvdb::Coord ijk = value.getCoord();
                    const int32_t face = faces.getValue(ijk);
                    if (face < 0) continue;
                    const openvdb::Vec3d v =
                        velocityOn(surface, static_cast<size_t>(face), transform->indexToWorld(ijk));
                    for (int axis = 0; axis < 3; ++axis)
                        leaves[static_cast<size_t>(axis)][n]->setValueOnly(value.pos(), static_cast<float>(v[axis]));
                }
        },
        monitor.quiet());
    return {splineOf(grids[0]), splineOf(grids[1]), splineOf(grids[2])};
}

} // namespace curlew
