// SPDX-License-Identifier: Apache-2.0
#include "MeshDistances.h"

#include "ClosestFace.h"
#include "IndexMesh.h"
#include "LeafFaces.h"
#include "VertexFaces.h"
#include "curlew/base/Parallel.h"
#include "curlew/vdb/Openvdb.h"

#include <openvdb/tools/ChangeBackground.h>
#include <openvdb/tools/Morphology.h>
#include <openvdb/tools/Prune.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <memory>
#include <numbers>
#include <span>
#include <utility>
#include <vector>

namespace curlew {

namespace {

using openvdb::Coord;
using openvdb::FloatGrid;
using openvdb::FloatTree;
using openvdb::Index;
using openvdb::Int32Grid;
using openvdb::Int32Tree;
using Leaf = FloatTree::LeafNodeType;
template <class Tree>
using Reader = openvdb::tree::ValueAccessor<const Tree, /*IsSafe=*/false>;

// In voxels.
constexpr double kRidge = 0.1; ///< A second difference of distances, negative.
constexpr double kSame = 1e-5; ///< A change of a distance that does not count. Smaller ones would spread far.
constexpr double kNarrow = 3;  ///< A band up to this half width is exact.
constexpr double kKnown = 1.5; ///< The half width from which a wide band grows. From 3, its errors were greater.
constexpr int kEdge = Leaf::DIM;
constexpr openvdb::Int32 kNoFace = -1;

/// The faces known in a leaf and at the voxels next to it.
class KnownFaces {
  public:
    /// A voxel's face is known if its distance is active.
    KnownFaces(const Reader<FloatTree>& distances, const Reader<Int32Tree>& faces, const Coord& origin) {
        for (int n = 0; n < 27; ++n) {
            const Coord side(n / 9 - 1, n / 3 % 3 - 1, n % 3 - 1), at = origin + (side << 3);
            const Leaf* distance = distances.probeConstLeaf(at);
            const Int32Tree::LeafNodeType* face = faces.probeConstLeaf(at);
            if (!distance || !face) continue;
            addRows(*distance, side);
            mFaces[static_cast<size_t>(n)] = face->buffer().data();
        }
    }

    /// Calls use(face) with the known faces of the 26 neighbours of a voxel, which is given relative to the leaf.
    template <class Use>
    void forNeighbours(const Coord& voxel, const Use& use) const {
        for (int i = voxel[0] - 1; i <= voxel[0] + 1; ++i)
            for (int j = voxel[1] - 1; j <= voxel[1] + 1; ++j)
                for (unsigned row = (mKnown[rowAt(i, j)] >> voxel[2]) & 7; row != 0; row &= row - 1)
                    use(at(i, j, voxel[2] - 1 + std::countr_zero(row)));
    }

  private:
    static constexpr int kRows = kEdge + 2;

    static size_t rowAt(int i, int j) {
        const int row = (i + 1) * kRows + j + 1;
        return static_cast<size_t>(row);
    }

    /// Adds what is known in the leaf on this side (-1, 0 or 1 along each axis).
    void addRows(const Leaf& leaf, const Coord& side) {
        const auto first = [&](int axis) { return side[axis] < 0 ? kEdge - 1 : 0; };
        const auto last = [&](int axis) { return side[axis] > 0 ? 0 : kEdge - 1; };
        for (int i = first(0); i <= last(0); ++i)
            for (int j = first(1); j <= last(1); ++j) {
                const unsigned bits = leaf.getValueMask().getWord<uint8_t>(static_cast<Index>(i * kEdge + j));
                const unsigned shifted = side[2] < 0   ? bits >> (kEdge - 1)
                                         : side[2] > 0 ? (bits & 1) << (kEdge + 1)
                                                       : bits << 1;
                mKnown[rowAt(i + side[0] * kEdge, j + side[1] * kEdge)] |= static_cast<uint16_t>(shifted);
            }
    }

    openvdb::Int32 at(int i, int j, int k) const {
        const int leaf = ((i >> 3) * 3 + (j >> 3)) * 3 + (k >> 3) + 13;
        return mFaces[static_cast<size_t>(leaf)][((i & 7) * kEdge + (j & 7)) * kEdge + (k & 7)];
    }

    std::array<uint16_t, size_t{kRows * kRows}> mKnown{}; ///< Rows along z, which begin at the voxel before the leaf.
    std::array<const openvdb::Int32*, 27> mFaces{};       ///< Of the leaves, null where there are none.
};

/// Distances that grow from the surface outwards, one voxel in each round, across the faces of voxels. Each new voxel
/// is compared with the faces of all known voxels around it; the neighbour closest to the direction of the surface is
/// always among them. From the best of these faces it walks over the mesh. Where two fronts meet, one may have run too
/// far. There the distances have a ridge, whose voxels are compared again, and then those around each voxel that
/// changes.
class GrowingBand {
  public:
    /// The band grows from the voxels within `known` voxels.
    GrowingBand(MeshDistances& band, const IndexMesh& mesh, double known, double halfWidth)
        : mDistance(band.distance->tree()),
          mFace(band.face->tree()),
          mMesh(mesh),
          mFacesAt(mesh),
          mVoxel(band.distance->voxelSize()[0]),
          mKnown(known),
          mHalfWidth(halfWidth) {}

    void grow(const Monitor& monitor) {
        forgetUnknown();
        const Monitor quiet = monitor.quiet();
        openvdb::MaskTree front(mDistance, false, true, openvdb::TopologyCopy());
        for (int round = 1; !front.empty(); ++round) {
            dilate(front);
            front.topologyDifference(mDistance);
            improve(front, quiet);
            if (monitor.report) monitor.report(std::min(1.0, round / (std::numbers::sqrt3 * (mHalfWidth - mKnown))));
        }
        openvdb::MaskTree changed = ridges(quiet);
        while (!changed.empty()) {
            improve(changed, quiet);
            dilate(changed);
            changed.topologyIntersection(mDistance);
        }
        // Leaves in which no voxel was close enough.
        openvdb::tools::pruneInactive(mDistance);
        openvdb::tools::pruneInactive(mFace);
    }

  private:
    /// A leaf of the front, and those that hold its distances and faces.
    struct Part {
        openvdb::MaskTree::LeafNodeType* front;
        Leaf* distance;
        Int32Tree::LeafNodeType* face;
    };
    struct Closer {
        Index voxel; ///< In its leaf.
        float distance;
        openvdb::Int32 face;
    };

    static void dilate(openvdb::MaskTree& voxels) {
        if (!voxels.empty())
            openvdb::tools::morphology::Morphology<openvdb::MaskTree>(voxels).dilateVoxels(1, openvdb::tools::NN_FACE,
                                                                                           false);
    }

    /// Forgets the voxels from which the band does not grow.
    void forgetUnknown() {
        const auto known = static_cast<float>(mKnown * mVoxel);
        openvdb::tools::changeBackground(mDistance, static_cast<float>(mHalfWidth * mVoxel));
        std::vector<Leaf*> leaves;
        mDistance.getNodes(leaves);
        parallelFor(leaves.size(), 64, [&](size_t begin, size_t end) {
            for (size_t n = begin; n < end; ++n)
                for (auto value = leaves[n]->beginValueOn(); value; ++value)
                    if (!(*value < known)) leaves[n]->setValueOff(value.pos(), mDistance.background());
        });
    }

    /// Returns the voxels from which the distances fall on either side along an axis, or rise less than they fall.
    openvdb::MaskTree ridges(const Monitor& monitor) const {
        openvdb::MaskTree found(mDistance, false, true, openvdb::TopologyCopy());
        std::vector<openvdb::MaskTree::LeafNodeType*> leaves;
        found.getNodes(leaves);
        parallelFor(
            leaves.size(), 16,
            [&](size_t begin, size_t end) {
                const Reader<FloatTree> distances(mDistance);
                for (size_t n = begin; n < end; ++n)
                    for (auto voxel = leaves[n]->beginValueOn(); voxel; ++voxel)
                        if (!isRidge(voxel.getCoord(), distances)) leaves[n]->setValueOff(voxel.pos());
            },
            monitor);
        return found;
    }

    bool isRidge(const Coord& ijk, const Reader<FloatTree>& distances) const {
        const auto here = distances.getValue(ijk), fall = static_cast<float>(kRidge * mVoxel);
        for (int axis = 0; axis < 3; ++axis) {
            Coord below = ijk, above = ijk;
            --below[axis], ++above[axis];
            float before, after;
            if (distances.probeValue(below, before) && distances.probeValue(above, after) &&
                before + after < 2 * here - fall)
                return true;
        }
        return false;
    }

    /// Compares the voxels of the front with the faces known around them. Leaves those in the front that have become
    /// closer to the mesh, and makes them known.
    void improve(openvdb::MaskTree& front, const Monitor& monitor) {
        openvdb::tools::pruneInactive(front);
        std::vector<openvdb::MaskTree::LeafNodeType*> leaves;
        front.getNodes(leaves);
        std::vector<Part> parts;
        parts.reserve(leaves.size());
        for (auto* leaf : leaves)
            parts.push_back({leaf, mDistance.touchLeaf(leaf->origin()), mFace.touchLeaf(leaf->origin())});
        std::vector<std::vector<Closer>> found(parts.size());
        parallelFor(
            parts.size(), 16,
            [&](size_t begin, size_t end) {
                const Reader<FloatTree> distances(mDistance);
                const Reader<Int32Tree> faces(mFace);
                for (size_t n = begin; n < end; ++n)
                    search(parts[n], KnownFaces(distances, faces, parts[n].front->origin()), found[n]);
            },
            monitor);
        // Only now, since what is known must not change during a round.
        parallelFor(parts.size(), 64, [&](size_t begin, size_t end) {
            for (size_t n = begin; n < end; ++n) {
                parts[n].front->setValuesOff();
                for (const Closer& one : found[n]) {
                    parts[n].front->setValueOn(one.voxel);
                    parts[n].distance->setValueOn(one.voxel, one.distance);
                    parts[n].face->setValueOn(one.voxel, one.face);
                }
            }
        });
        openvdb::tools::pruneInactive(front);
    }

    void search(const Part& part, const KnownFaces& faces, std::vector<Closer>& found) const {
        for (auto voxel = part.front->cbeginValueOn(); voxel; ++voxel) {
            const bool known = part.distance->isValueOn(voxel.pos());
            const Coord ijk = voxel.getCoord();
            ClosestFace closest(mMesh, Vec3d{{double(ijk[0]), double(ijk[1]), double(ijk[2])}});
            faces.forNeighbours(Leaf::offsetToLocalCoord(voxel.pos()),
                                [&](openvdb::Int32 face) { closest.add(static_cast<size_t>(face)); });
            // At a ridge the closest face may be next to one that is not the best of these, where no walk begins.
            if (known) closest.addAround(mFacesAt);
            closest.compare();
            closest.descend(mFacesAt);
            const auto distance = static_cast<float>(mVoxel * closest.distance());
            // The value of a voxel that is not known yet is the background.
            if (distance < part.distance->getValue(voxel.pos()) - (known ? static_cast<float>(kSame * mVoxel) : 0))
                found.push_back({voxel.pos(), distance, static_cast<openvdb::Int32>(closest.face())});
        }
    }

    FloatTree& mDistance;
    Int32Tree& mFace;
    const IndexMesh& mMesh;
    VertexFaces mFacesAt;
    double mVoxel;             ///< World units.
    double mKnown, mHalfWidth; ///< Voxels.
};

/// The distances and the closest faces of a leaf.
struct ExactLeaf {
    ExactLeaf() = default;
    ExactLeaf(const Coord& origin, const LeafTriangleKernel::Closest& closest, double voxel, float background) {
        distance = std::make_unique<Leaf>(origin, background);
        face = std::make_unique<Int32Tree::LeafNodeType>(origin, kNoFace);
        for (Index k = 0; k < Leaf::SIZE; ++k) {
            const auto here = static_cast<float>(voxel * std::sqrt(closest.square[k]));
            if (!(here < background)) continue;
            distance->setValueOn(k, here);
            face->setValueOn(k, static_cast<openvdb::Int32>(closest.face[k]));
        }
    }

    std::unique_ptr<Leaf> distance;
    std::unique_ptr<Int32Tree::LeafNodeType> face;
};

/// Compares the voxels up to a width, in voxels, with all faces near them.
MeshDistances exactDistances(const IndexMesh& mesh, const openvdb::math::Transform& transform, double width,
                             const Monitor& monitor) {
    const double voxel = transform.voxelSize()[0];
    const auto background = static_cast<float>(width * voxel);
    const LeafFaces faces(mesh, width, monitor.quiet());
    std::vector<ExactLeaf> leaves(faces.leaves());
    parallelFor(
        leaves.size(), 4,
        [&](size_t begin, size_t end) {
            LeafTriangleKernel::Closest closest{};
            for (size_t n = begin; n < end; ++n) {
                closest.square.fill(width * width);
                faces.forTriangles(n, [&](const std::span<const LeafTriangle>& triangles) {
                    runKernel<LeafTriangleKernel, double>(triangles, closest);
                });
                leaves[n] = ExactLeaf(faces.origin(n), closest, voxel, background);
            }
        },
        monitor);
    MeshDistances result;
    result.distance = FloatGrid::create(background);
    result.face = Int32Grid::create(kNoFace);
    result.distance->setTransform(transform.copy());
    result.face->setTransform(transform.copy());
    for (ExactLeaf& leaf : leaves) {
        if (leaf.distance->isEmpty()) continue;
        result.distance->tree().addLeaf(leaf.distance.release());
        result.face->tree().addLeaf(leaf.face.release());
    }
    return result;
}

/// Returns whether a band is compared with all faces within reach: if it is narrow, or if that takes no longer than to
/// grow it. To prepare a triangle for a leaf takes about as long as to grow a voxel (measured with faces of 0.5 to 10
/// voxels), and a pair of both takes less memory.
bool comparesAll(const IndexMesh& mesh, double halfWidth) {
    constexpr double kEdgeOfLeaf = kEdge;
    constexpr double kNear = 0.6; // of the leaves in the box of what is within reach
    if (halfWidth <= kNarrow) return true;
    struct Work {
        double leaves = 0, area = 0;
        Work& operator+=(const Work& o) {
            leaves += o.leaves;
            area += o.area;
            return *this;
        }
    };
    const Work work = parallelSum(mesh.polygonCount(), 4096, [&](size_t begin, size_t end) {
        Work sum;
        const auto add = [&](const std::array<Vec3d, 3>& corner, const auto&) {
            double leaves = kNear;
            for (int axis = 0; axis < 3; ++axis) {
                const double least = std::min(std::min(corner[0][axis], corner[1][axis]), corner[2][axis]);
                const double most = std::max(std::max(corner[0][axis], corner[1][axis]), corner[2][axis]);
                leaves *= 1 + (most - least + 2 * halfWidth) / kEdgeOfLeaf;
            }
            sum += {leaves, length(cross(corner[1] - corner[0], corner[2] - corner[0])) / 2};
        };
        for (size_t face = begin; face < end; ++face) mesh.forTriangles(face, add);
        return sum;
    });
    const Vec3d size = mesh.size();
    double box = 1;
    for (int axis = 0; axis < 3; ++axis) box *= size[axis] + 2 * halfWidth;
    return work.leaves <= std::min(2 * halfWidth * work.area, box);
}

/// Copies the values of a narrower band to a wider one.
void copyTo(MeshDistances& wide, const MeshDistances& narrow) {
    for (auto leaf = narrow.distance->tree().cbeginLeaf(); leaf; ++leaf) {
        const auto& faces = *narrow.face->tree().probeConstLeaf(leaf->origin());
        Leaf* distance = wide.distance->tree().touchLeaf(leaf->origin());
        Int32Tree::LeafNodeType* face = wide.face->tree().touchLeaf(leaf->origin());
        for (auto value = leaf->cbeginValueOn(); value; ++value) {
            distance->setValueOn(value.pos(), *value);
            face->setValueOn(value.pos(), faces.getValue(value.pos()));
        }
    }
}

} // namespace

MeshDistances distancesTo(const Mesh& mesh, const openvdb::math::Transform& transform, double halfWidth,
                          const Monitor& monitor) {
    const IndexMesh indexMesh(mesh, transform);
    const double exact = comparesAll(indexMesh, halfWidth) ? halfWidth : kNarrow, share = exact / halfWidth;
    const auto part = [&](double begin, double end) {
        const auto report = [&monitor, begin, end](double done) { monitor.report(begin + (end - begin) * done); };
        return monitor.report ? Monitor{.report = report, .cancelled = monitor.cancelled} : monitor;
    };
    MeshDistances result = exactDistances(indexMesh, transform, exact, part(0, share));
    if (halfWidth > exact) {
        const MeshDistances near{result.distance->deepCopy(), result.face->deepCopy()};
        GrowingBand(result, indexMesh, kKnown, halfWidth).grow(part(share, 1));
        copyTo(result, near);
    }
    return result;
}

} // namespace curlew
