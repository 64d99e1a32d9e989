// SPDX-License-Identifier: Apache-2.0
#include "MeshDistances.h"

#include "BandLayers.h"
#include "MeshAdapter.h"
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

/// The values of a leaf and of the leaves around it.
template <class Tree>
class Around {
  public:
    using Value = typename Tree::ValueType;

    Around(const Tree& tree, const Coord& origin) : mBackground(tree.background()) {
        for (int k = 0; k < 27; ++k) {
            const auto* leaf = tree.probeConstLeaf(origin + (Coord(k / 9 - 1, k / 3 % 3 - 1, k % 3 - 1) << 3));
            mData[static_cast<size_t>(k)] = leaf ? leaf->buffer().data() : nullptr;
        }
    }

    /// Returns the value of a voxel relative to the leaf's origin, from -8 to 15 along each axis.
    Value operator()(const Coord& local) const {
        const auto leaf = static_cast<size_t>(((local[0] >> 3) * 3 + (local[1] >> 3)) * 3 + (local[2] >> 3) + 13);
        const auto voxel = static_cast<size_t>(((local[0] & 7) * 8 + (local[1] & 7)) * 8 + (local[2] & 7));
        return mData[leaf] ? mData[leaf][voxel] : mBackground;
    }

  private:
    Value mBackground;
    std::array<const Value*, 27> mData;
};

/// A smaller value found for a voxel.
struct Closer {
    Leaf* leaf;
    Index position;
    float distance;
    openvdb::Int32 face;
};

/// Looks for faces that are closer to voxels of a leaf than those known, among the faces of neighbours closer to the
/// mesh.
class Search {
  public:
    Search(const MeshDistances& distances, const MeshAdapter& mesh, Leaf& leaf)
        : mMesh(mesh),
          mVoxel(static_cast<float>(distances.distance->voxelSize()[0])),
          mLeaf(leaf),
          mDistance(distances.distance->tree(), leaf.origin()),
          mFace(distances.face->tree(), leaf.origin()) {}

    void look(Index position, std::vector<Closer>& found) const {
        const Coord voxel = Leaf::offsetToLocalCoord(position);
        const openvdb::Vec3d centre = mLeaf.offsetToGlobalCoord(position).asVec3d();
        const float here = mDistance(voxel);
        const openvdb::Int32 own = mFace(voxel);
        std::array<openvdb::Int32, 26> seen;
        size_t count = 0;
        Closer best{&mLeaf, position, here, own};
        for (const Coord& offset : openvdb::util::COORD_OFFSETS) {
            const Coord next = voxel + offset;
            if (!(mDistance(next) < here)) continue; // inactive voxels have the background, which no distance exceeds
            const openvdb::Int32 other = mFace(next);
            if (other < 0 || other == own ||
                std::find(seen.begin(), seen.begin() + count, other) != seen.begin() + count)
                continue;
            seen[count++] = other;
            const auto d = mVoxel * static_cast<float>(distanceTo(mMesh, static_cast<size_t>(other), centre));
            if (d < best.distance) best.distance = d, best.face = other;
        }
        if (best.face != own) found.push_back(best);
    }

  private:
    const MeshAdapter& mMesh;
    float mVoxel;
    Leaf& mLeaf;
    Around<openvdb::FloatTree> mDistance;
    Around<openvdb::Int32Tree> mFace;
};

/// Corrects the distances from kExact voxels on, in layers of half a voxel outwards.
void correct(MeshDistances& distances, const MeshAdapter& mesh, double halfWidth, const Monitor& monitor) {
    const double voxel = distances.distance->voxelSize()[0];
    std::vector<float> bounds;
    for (double bound = kExact; bound < halfWidth + kLayer; bound += kLayer)
        bounds.push_back(static_cast<float>(bound * voxel));
    if (bounds.empty()) return;
    const BandLayers layers(distances.distance->tree(), bounds);
    openvdb::tree::ValueAccessor<openvdb::Int32Tree> face(distances.face->tree());
    for (size_t k = 0; k < layers.count(); ++k)
        layers.forEach<Closer>(
            k,
            [&](Leaf& leaf, std::span<const uint16_t> voxels, std::vector<Closer>& found) {
                const Search search(distances, mesh, leaf);
                for (const uint16_t n : voxels) search.look(n, found);
            },
            [&](const Closer& c) {
                c.leaf->setValueOnly(c.position, c.distance);
                face.setValue(c.leaf->offsetToGlobalCoord(c.position), c.face);
            },
            monitor);
}

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
    correct(result, adapter, halfWidth, monitor.quiet());
    return result;
}

} // namespace curlew
