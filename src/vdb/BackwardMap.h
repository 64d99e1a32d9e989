// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/base/Monitor.h"
#include "curlew/field/ScalarField.h"

#include <openvdb/openvdb.h>

#include <array>
#include <functional>
#include <optional>
#include <vector>

namespace curlew {

/// Where the matter at the voxels around a moving surface was at first: its origins X, and φ(x) = φ₀(X), φ₀ a distance.
/// Positions here are in voxels.
///
/// Between voxels either X is interpolated, by polynomials of degree 5 along each axis (Lagrange's, off by O(h⁶)), or φ
/// itself, of degree 3 (O(h⁴), and fewer voxels count): whichever differs less between those two degrees, as far as φ
/// is concerned. Where the flow has pressed matter together, φ has kinks and levels off within a voxel but X is smooth;
/// where it has sheared matter along the surface, as along a wall, it is the other way around.
class BackwardMap {
  public:
    /// The origins of voxels, in their order.
    using Trace = std::function<std::vector<Vec3d>(const std::vector<openvdb::Coord>&)>;

    /// An edge between voxels that the surface crosses: from `voxel` along `axis`, at `fraction` of it.
    struct Crossing {
        openvdb::Coord voxel;
        int axis = 0;
        double fraction = 0;
        openvdb::Vec3d position() const {
            openvdb::Vec3d p = voxel.asVec3d();
            p[axis] += fraction;
            return p;
        }
    };

    /// φ, and its derivatives along the axes, per voxel.
    struct Sample {
        double phi = 0;
        openvdb::Vec3d gradient{0};
    };

    explicit BackwardMap(ScalarField source) : mSource(std::move(source)) {}

    /// Traces all voxels from which X can be interpolated where the surface is. It begins in the cells (cubes between
    /// eight voxels) of `seeds`, and goes on where the surface leaves what it knows, until that is closed. Throws
    /// ResourceError where the surface becomes too large for the memory.
    void follow(const std::vector<openvdb::Vec3d>& seeds, const Trace& trace, const Monitor& monitor);

    size_t size() const { return mVoxels.size(); }
    const std::vector<openvdb::Coord>& voxels() const { return mVoxels; }
    Vec3d origin(size_t n) const { return {{mNodes[n][0], mNodes[n][1], mNodes[n][2]}}; }
    const openvdb::Int32Tree& index() const { return mIndex; } ///< Of each voxel in these arrays; -1: none.

    bool inside(size_t n) const { return mNodes[n][3] < 0; }

    /// Every edge that the surface crosses, with the place where it does, in the order of voxels().
    std::vector<Crossing> crossings(const Monitor& monitor) const;

    /// φ and its gradient at up to kBatch positions; false where X is not known all around.
    using Accessor = openvdb::tree::ValueAccessor<const openvdb::Int32Tree, false>;
    void sample(const std::vector<openvdb::Vec3d>& positions, const Accessor& index, std::vector<Sample>& samples,
                std::vector<uint8_t>& known) const;

  private:
    void evaluate(size_t begin, const Monitor& monitor);
    std::vector<openvdb::Coord> crossedCells(size_t begin, const Monitor& monitor) const;

    /// At a voxel or between some: the origin, and φ as the fourth.
    using Node = Vec<double, 4>;
    struct Interpolated {
        Node value;
        std::array<Node, 3> derivatives; ///< Along the axes.
        Node difference;                 ///< Degree 5 less degree 3.
    };
    bool interpolate(const openvdb::Vec3d& position, const Accessor& index, Interpolated& result) const;

    ScalarField mSource;
    openvdb::Int32Tree mIndex{-1};
    openvdb::MaskTree mKnown;
    std::vector<openvdb::Coord> mVoxels;
    std::vector<Node> mNodes;
};

} // namespace curlew
