// SPDX-License-Identifier: Apache-2.0
#include "curlew/vdb/DisplacedAir.h"

#include "Poisson.h"
#include "VoxelSize.h"
#include "curlew/base/Error.h"
#include "curlew/base/Memory.h"
#include "curlew/base/Parallel.h"
#include "curlew/field/ForEachBatch.h"
#include "curlew/vdb/Openvdb.h"

#include <fmt/format.h>

#include <cmath>
#include <cstdint>
#include <memory>

namespace curlew {

namespace {

using openvdb::Coord;
using VelocityLeaf = openvdb::Vec3STree::LeafNodeType;

/// What a voxel holds. A voxel beyond the box is open unless it is in the wall.
enum class Cell : uint8_t { open, air, wall };
using CellTree = openvdb::Int32Tree;

/// Distances from the wall, in voxels, at which the velocity is sampled to extrapolate it to the faces of the wall.
/// Closer to the wall, it shows the steps of the voxels.
constexpr double kNearVoxels = 1.5, kFarVoxels = 2.5;

/// A face between air and wall: the lower face of `voxel` along `axis`.
struct WallFace {
    Coord voxel;
    int axis = 0;
    Vec3d foot = {}, normal = {}; ///< The closest point of the wall.
    double distance = 0;          ///< Of the middle of the face from the wall.
    Vec3d wall = {};              ///< Velocity of the wall at the foot.
};

class AirSolver {
  public:
    AirSolver(const Domain& domain, const WallVelocity& wall, const DisplacedAirOptions& options,
              const Monitor& monitor)
        : mDomain(domain), mWall(wall), mOptions(options), mVoxels(options.voxels), mMonitor(monitor) {
        for (int axis = 0; axis < 3; ++axis) {
            mLower[axis] = static_cast<int>(std::ceil(mVoxels.index(axis, domain.box.lower[axis]) - kSideRounding));
            mUpper[axis] = static_cast<int>(std::floor(mVoxels.index(axis, domain.box.upper[axis]) + kSideRounding));
        }
        classify();
        findWallFaces();
    }

    DisplacedAir run() {
        DisplacedAir result;
        setWallVelocity([&](const WallFace& face) { return face.normal * dot(face.wall, face.normal); });
        result.iterations = solve();
        for (int k = 0; k < mOptions.corrections; ++k) {
            correct();
            result.iterations += solve();
        }
        result.voxels = mAir;
        result.faces = faces();
        return result;
    }

  private:
    Vec3d centre(const Coord& ijk) const { return mVoxels.centre(ijk[0], ijk[1], ijk[2]); }
    Vec3d middleOf(const Coord& ijk, int axis) const {
        Vec3d p = centre(ijk);
        p[axis] -= 0.5 * mVoxels.size;
        return p;
    }
    Cell at(const Coord& ijk) const { return static_cast<Cell>(mCells.getValue(ijk)); }

    /// Classifies the voxels of the box and of one layer around it.
    void classify() {
        const openvdb::CoordBBox box(mLower, mUpper), around(mLower.offsetBy(-1), mUpper.offsetBy(1));
        if (box.empty()) throw ValueError("the box is smaller than a voxel; use smaller voxels");
        constexpr double kBytesEach = 350; // of the solver
        requireMemory(static_cast<double>(box.volume()) * kBytesEach,
                      fmt::format("the potential flow on {} voxels", box.volume()), "choose larger voxels");
        std::vector<Coord> origins;
        const Coord first = around.min() & ~7, last = around.max() & ~7;
        for (int i = first[0]; i <= last[0]; i += 8)
            for (int j = first[1]; j <= last[1]; j += 8)
                for (int k = first[2]; k <= last[2]; k += 8) origins.emplace_back(i, j, k);
        std::vector<std::unique_ptr<CellTree::LeafNodeType>> leaves(origins.size());
        parallelFor(
            origins.size(), 16,
            [&](size_t begin, size_t end) {
                for (size_t n = begin; n < end; ++n) {
                    leaves[n] = std::make_unique<CellTree::LeafNodeType>(origins[n], 0);
                    classify(*leaves[n], box, around);
                }
            },
            mMonitor.quiet());
        for (auto& leaf : leaves)
            if (!leaf->isEmpty()) mCells.addLeaf(leaf.release());
        mSources.topologyUnion(mCells);
        for (auto leaf = mSources.beginLeaf(); leaf; ++leaf) {
            const auto* cells = mCells.probeConstLeaf(leaf->origin());
            for (auto value = leaf->beginValueOn(); value; ++value)
                if (cells->getValue(value.pos()) != static_cast<int>(Cell::air)) value.setValueOff();
        }
        mAir = static_cast<size_t>(mSources.activeVoxelCount());
        if (mAir == 0) throw ValueError("the obstacle fills the box; use a larger box (padding=)");
    }

    void classify(CellTree::LeafNodeType& leaf, const openvdb::CoordBBox& box, const openvdb::CoordBBox& around) const {
        constexpr openvdb::Index kSize = CellTree::LeafNodeType::SIZE;
        for (openvdb::Index from = 0; from < kSize; from += kBatch) {
            PointBatch points;
            for (openvdb::Index n = from; n < from + kBatch; ++n) points.push(centre(leaf.offsetToGlobalCoord(n)));
            JetBatch<double, 0> d;
            mDomain.wall->sdf.distance.eval(points, d);
            for (openvdb::Index n = 0; n < kBatch; ++n) {
                const Coord ijk = leaf.offsetToGlobalCoord(from + n);
                if (!around.isInside(ijk)) continue;
                const Cell cell = !(d.c[0][n] > 0) ? Cell::wall : box.isInside(ijk) ? Cell::air : Cell::open;
                if (cell != Cell::open) leaf.setValueOn(from + n, static_cast<int>(cell));
            }
        }
    }

    void findWallFaces() {
        const auto addBetween = [&](const Coord& air, int axis, int side) {
            Coord other = air;
            other[axis] += side;
            if (at(other) == Cell::wall) mFaces.push_back({.voxel = side > 0 ? other : air, .axis = axis});
        };
        for (auto value = mSources.cbeginValueOn(); value; ++value)
            for (int axis = 0; axis < 3; ++axis)
                for (const int side : {-1, 1}) addBetween(value.getCoord(), axis, side);
        if (mFaces.empty())
            throw ValueError("no voxel of the box is in the obstacle; use smaller voxels or another box");
        forEachBatch(
            PointsBy{mFaces.size(), [&](size_t k) { return middleOf(mFaces[k].voxel, mFaces[k].axis); }},
            [&](const PointBatch& middles, size_t begin) {
                JetBatch<double, 1> d;
                mDomain.wall->sdf.distance.eval(middles, d);
                PointBatch feet;
                for (int i = 0; i < middles.size; ++i) {
                    WallFace& face = mFaces[begin + static_cast<size_t>(i)];
                    const double slope = length(d[i].gradient);
                    if (slope > 0) face.normal = d[i].gradient * (1 / slope);
                    face.distance = slope > 0 ? d[i].value / slope : 0;
                    face.foot = middles[i] - face.normal * face.distance;
                    feet.push(face.foot);
                }
                VecBatch<double> w;
                mWall.eval(feet, w);
                for (int i = 0; i < feet.size; ++i) mFaces[begin + static_cast<size_t>(i)].wall = w[i];
            },
            mMonitor.quiet());
    }

    /// Sets the velocities through the faces of the wall to components of velocityAt(face).
    template <class VelocityAt>
    void setWallVelocity(const VelocityAt& velocityAt) {
        std::vector<double> through(mFaces.size());
        parallelFor(mFaces.size(), 256, [&](size_t begin, size_t end) {
            for (size_t k = begin; k < end; ++k) through[k] = velocityAt(mFaces[k])[mFaces[k].axis];
        });
        for (size_t k = 0; k < mFaces.size(); ++k)
            mThrough[static_cast<size_t>(mFaces[k].axis)].setValueOn(mFaces[k].voxel, through[k]);
    }

    /// Sets the velocities through the faces of the wall to those of the last solution. The middle of a face is not on
    /// the wall: there, the normal velocity lies on the line through that of the wall and that of the air beside it,
    /// and the velocity along the wall is extrapolated.
    void correct() {
        setWallVelocity([&](const WallFace& face) {
            const double across = dot(face.wall, face.normal), distance = face.distance / mVoxels.size;
            Vec3d u, beyond;
            if (!velocity(face.foot + face.normal * (kNearVoxels * mVoxels.size), u)) return face.normal * across;
            const double acrossNear = dot(u, face.normal);
            if (velocity(face.foot + face.normal * (kFarVoxels * mVoxels.size), beyond))
                u += (beyond - u) * ((distance - kNearVoxels) / (kFarVoxels - kNearVoxels));
            const double acrossThere = across + (acrossNear - across) * distance / kNearVoxels;
            return u + face.normal * (acrossThere - dot(u, face.normal));
        });
    }

    /// Solves for φ with the velocities through the wall. Returns the number of iterations.
    int solve() {
        const auto boundary = [this](const Coord& air, const Coord& neighbour, double& source, double& diagonal) {
            if (at(neighbour) != Cell::wall) {
                diagonal -= 1; // φ = 0
                return;
            }
            int axis = 0;
            while (neighbour[axis] == air[axis]) ++axis;
            const bool above = neighbour[axis] > air[axis];
            const double v = mThrough[static_cast<size_t>(axis)].getValue(above ? neighbour : air);
            source += (above ? -v : v) * mVoxels.size;
        };
        openvdb::math::pcg::State state{.success = false,
                                        .iterations = mOptions.iterations,
                                        .relativeError = mOptions.tolerance,
                                        .absoluteError = 0};
        mPhi = solvePoisson(mSources, boundary, state, mMonitor);
        if (!state.success)
            throw ValueError(fmt::format(
                "the potential flow has not converged: its residual is {:.2g} after {} iterations; if the obstacle "
                "encloses air, use displaced=fade, otherwise larger voxels",
                state.relativeError, state.iterations));
        return state.iterations;
    }

    /// Computes the velocity through the lower face of a voxel. Returns false if the face is not at air.
    bool through(const Coord& ijk, int axis, double& v) const {
        Coord below = ijk;
        --below[axis];
        const Cell a = at(below), b = at(ijk);
        if (a != Cell::air && b != Cell::air) return false;
        if (a == Cell::wall || b == Cell::wall)
            v = mThrough[static_cast<size_t>(axis)].getValue(ijk);
        else // φ is 0 beyond the box
            v = (mPhi->getValue(ijk) - mPhi->getValue(below)) / mVoxels.size;
        return true;
    }

    /// Interpolates the velocity at a position. Returns false if a face around it is not at air.
    bool velocity(const Vec3d& position, Vec3d& u) const {
        u = {};
        for (int axis = 0; axis < 3; ++axis) {
            openvdb::Vec3d p(mVoxels.index(0, position[0]), mVoxels.index(1, position[1]),
                             mVoxels.index(2, position[2]));
            p[axis] += 0.5;
            const Coord base = Coord::floor(p);
            const openvdb::Vec3d part = p - base.asVec3d();
            for (int n = 0; n < 8; ++n) {
                const Coord offset(n & 1, n >> 1 & 1, n >> 2);
                double weight = 1, v = 0;
                for (int k = 0; k < 3; ++k) weight *= offset[k] ? part[k] : 1 - part[k];
                if (!through(base + offset, axis, v)) return false;
                u[axis] += weight * v;
            }
        }
        return true;
    }

    openvdb::Vec3SGrid::Ptr faces() const {
        std::vector<const CellTree::LeafNodeType*> cells;
        mCells.getNodes(cells);
        std::vector<std::unique_ptr<VelocityLeaf>> leaves(cells.size());
        parallelFor(
            cells.size(), 16,
            [&](size_t begin, size_t end) {
                for (size_t n = begin; n < end; ++n) {
                    leaves[n] = std::make_unique<VelocityLeaf>(cells[n]->origin(), openvdb::Vec3s(0));
                    fill(*leaves[n]);
                }
            },
            mMonitor.quiet());
        auto grid = openvdb::Vec3SGrid::create();
        for (auto& leaf : leaves) grid->tree().addLeaf(leaf.release());
        grid->setTransform(openvdb::math::Transform::createLinearTransform(mVoxels.size));
        grid->transform().postTranslate({mVoxels.origin[0], mVoxels.origin[1], mVoxels.origin[2]});
        grid->setGridClass(openvdb::GRID_STAGGERED);
        grid->setVectorType(openvdb::VEC_CONTRAVARIANT_RELATIVE);
        return grid;
    }

    void fill(VelocityLeaf& leaf) const {
        const openvdb::CoordBBox box(mLower, mUpper);
        std::array<PointBatch, 3> inWall; // middles of faces with wall on both sides
        std::array<std::array<openvdb::Index, kBatch>, 3> owners;
        const auto flush = [&](int axis) {
            const auto k = static_cast<size_t>(axis);
            VecBatch<double> w;
            mWall.eval(inWall[k], w);
            for (int i = 0; i < inWall[k].size; ++i) set(leaf, owners[k][static_cast<size_t>(i)], axis, w[i][axis]);
            inWall[k].size = 0;
        };
        for (openvdb::Index n = 0; n < VelocityLeaf::SIZE; ++n) {
            const Coord ijk = leaf.offsetToGlobalCoord(n);
            for (int axis = 0; axis < 3; ++axis) {
                double v = 0;
                if (through(ijk, axis, v)) {
                    set(leaf, n, axis, v);
                } else if (at(ijk) == Cell::wall) {
                    const auto k = static_cast<size_t>(axis);
                    owners[k][static_cast<size_t>(inWall[k].size)] = n;
                    inWall[k].push(middleOf(ijk, axis));
                    if (inWall[k].full()) flush(axis);
                }
            }
        }
        for (int axis = 0; axis < 3; ++axis)
            if (inWall[static_cast<size_t>(axis)].size > 0) flush(axis);
        for (openvdb::Index n = 0; n < VelocityLeaf::SIZE; ++n)
            if (box.isInside(leaf.offsetToGlobalCoord(n)) && leaf.getValue(n) != openvdb::Vec3s(0)) leaf.setValueOn(n);
    }
    static void set(VelocityLeaf& leaf, openvdb::Index n, int axis, double v) {
        leaf.buffer().data()[n][axis] = static_cast<float>(v);
    }

    const Domain& mDomain;
    const WallVelocity& mWall;
    DisplacedAirOptions mOptions;
    Voxels mVoxels;
    const Monitor& mMonitor;
    Coord mLower, mUpper; // voxels of the box
    CellTree mCells{0};
    size_t mAir = 0;
    std::vector<WallFace> mFaces;
    std::array<openvdb::DoubleTree, 3> mThrough; // velocities through the faces of the wall
    openvdb::DoubleTree mSources{0};             // zero, active in the air
    openvdb::DoubleTree::Ptr mPhi;
};

} // namespace

DisplacedAir displacedAir(const Domain& domain, const WallVelocity& wall, const DisplacedAirOptions& options,
                          const Monitor& monitor) {
    if (!(options.voxels.size > 0))
        throw ValueError(fmt::format("voxel size {} must be positive", options.voxels.size));
    requireVoxel(options.voxels.size);
    if (!domain.wall) throw ValueError("there is no wall that could displace air");
    if (domain.wall->side != Side::outside)
        throw ValueError(
            "air can only be displaced around an obstacle (-bound side=outside); inside a wall that "
            "deforms there is no divergence-free flow, so use displaced=fade");
    if (!domain.box.finite()) throw ValueError("the domain is infinite; give a box");
    const double reach = domain.wall->sdf.reach, needed = 3 * options.voxels.size;
    if (reach > 0 && reach < needed)
        throw ValueError(
            fmt::format("the distance from the wall is known up to {:.3g} only, but a potential flow on "
                        "voxels of {:.3g} needs {:.3g}; use smaller voxels or a wider layer (-bound layer=)",
                        reach, options.voxels.size, needed));
    return AirSolver(domain, wall, options, monitor).run();
}

} // namespace curlew
