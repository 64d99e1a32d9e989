// SPDX-License-Identifier: Apache-2.0
#include "MeshDistances.h"

#include "MeshAdapter.h"
#include "curlew/base/Parallel.h"
#include "curlew/vdb/Interrupter.h"
#include "curlew/vdb/Openvdb.h"

#include <openvdb/math/Proximity.h>
#include <openvdb/tools/MeshToVolume.h>
#include <openvdb/util/Util.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace curlew {

namespace {

using openvdb::Coord;
using openvdb::FloatGrid;
using openvdb::Index;
using openvdb::Int32Grid;
using Leaf = openvdb::FloatTree::LeafNodeType;

constexpr double kExact = 1.75; ///< In voxels; closer values are exact.
constexpr double kLayer = 0.5;  ///< In voxels; a voxel has a neighbour in the next layer inwards, which is closer to
                                ///< the mesh.
constexpr size_t kGrain = 8;    ///< In leaves.

double distanceTo(const MeshAdapter& mesh, size_t face, const openvdb::Vec3d& p) {
    std::array<openvdb::Vec3d, 4> corner;
    const size_t count = mesh.vertexCount(face);
    for (size_t k = 0; k < count; ++k) mesh.getIndexSpacePoint(face, k, corner[k]);
    double square = std::numeric_limits<double>::infinity();
    for (size_t k = 2; k < count; ++k) {
        openvdb::Vec3d uvw;
        const auto closest = openvdb::math::closestPointOnTriangleToPoint(corner[0], corner[k - 1], corner[k], p, uvw);
        square = std::min(square, (p - closest).lengthSqr());
    }
    return std::sqrt(square);
}

/// A smaller value found for a voxel.
struct Closer {
    Leaf* leaf;
    Index position;
    float distance;
    openvdb::Int32 face;
};

class Layers {
  public:
    Layers(MeshDistances& distances, const MeshAdapter& mesh)
        : mDistances(distances), mMesh(mesh), mVoxel(static_cast<float>(distances.distance->voxelSize()[0])) {
        distances.distance->tree().getNodes(mLeaves);
    }

    /// Corrects values in [from, to) using neighbours that are closer to the mesh.
    void correct(float from, float to, const Monitor& monitor) {
        std::vector<std::vector<Closer>> found((mLeaves.size() + kGrain - 1) / kGrain);
        parallelFor(
            mLeaves.size(), kGrain,
            [&](size_t begin, size_t end) {
                const openvdb::tree::ValueAccessor<const openvdb::FloatTree> distance(mDistances.distance->tree());
                const openvdb::tree::ValueAccessor<const openvdb::Int32Tree> face(mDistances.face->tree());
                for (size_t n = begin; n < end; ++n)
                    for (auto value = mLeaves[n]->cbeginValueOn(); value; ++value)
                        if (*value >= from && *value < to)
                            look(*mLeaves[n], value.pos(), distance, face, found[begin / kGrain]);
            },
            monitor);
        openvdb::tree::ValueAccessor<openvdb::Int32Tree> face(mDistances.face->tree());
        for (const auto& some : found)
            for (const Closer& c : some) {
                c.leaf->setValueOnly(c.position, c.distance);
                face.setValue(c.leaf->offsetToGlobalCoord(c.position), c.face);
            }
    }

  private:
    template <class Distance, class Face>
    void look(Leaf& leaf, Index position, const Distance& distance, const Face& face,
              std::vector<Closer>& found) const {
        const Coord voxel = leaf.offsetToGlobalCoord(position);
        const float here = leaf.getValue(position);
        const openvdb::Int32 own = face.getValue(voxel);
        std::array<openvdb::Int32, 26> seen;
        size_t count = 0;
        Closer best{&leaf, position, here, own};
        for (const Coord& offset : openvdb::util::COORD_OFFSETS) {
            const Coord next = voxel + offset;
            float there = 0;
            if (!distance.probeValue(next, there) || !(there < here)) continue;
            const openvdb::Int32 other = face.getValue(next);
            if (other < 0 || other == own ||
                std::find(seen.begin(), seen.begin() + count, other) != seen.begin() + count)
                continue;
            seen[count++] = other;
            const auto d = mVoxel * static_cast<float>(distanceTo(mMesh, static_cast<size_t>(other), voxel.asVec3d()));
            if (d < best.distance) best.distance = d, best.face = other;
        }
        if (best.face != own) found.push_back(best);
    }

    MeshDistances& mDistances;
    const MeshAdapter& mMesh;
    float mVoxel;
    std::vector<Leaf*> mLeaves;
};

} // namespace

MeshDistances distancesTo(const Mesh& mesh, const openvdb::math::Transform& transform, double halfWidth,
                          const Monitor& monitor) {
    Interrupter interrupter(monitor);
    const auto width = static_cast<float>(halfWidth);
    const MeshAdapter adapter(mesh, transform);
    MeshDistances result;
    result.face = Int32Grid::create(static_cast<openvdb::Int32>(openvdb::util::INVALID_IDX));
    // Unsigned, since OpenVDB's signs are wrong in parts thinner than 1.5 voxels, and computing them raises distances
    // in such parts to 0.75 voxels.
    result.distance = openvdb::tools::meshToVolume<FloatGrid>(
        interrupter, adapter, transform, width, width, openvdb::tools::UNSIGNED_DISTANCE_FIELD, result.face.get());
    monitor.check();
    Layers layers(result, adapter);
    const double voxel = transform.voxelSize()[0];
    const Monitor quiet{.report = {}, .cancelled = monitor.cancelled};
    for (double from = kExact; from < halfWidth; from += kLayer)
        layers.correct(static_cast<float>(from * voxel), static_cast<float>((from + kLayer) * voxel), quiet);
    return result;
}

} // namespace curlew
