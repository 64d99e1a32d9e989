// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/base/Monitor.h"
#include "curlew/field/ScalarField.h"
#include "curlew/vdb/Openvdb.h"

#include <array>
#include <functional>
#include <optional>
#include <vector>

namespace curlew {

/// The backward flow map at the voxels around a moving surface: the origin X of each voxel, and φ(x) = φ₀(X), where φ₀
/// is a distance. Positions here are in voxels.
///
/// Between voxels, either X is interpolated by Lagrange polynomials of degree 5 along each axis (error O(h⁶)), or φ
/// itself by polynomials of degree 3 (error O(h⁴), from fewer voxels). The interpolant whose two degrees differ less,
/// measured in φ, is used. Where the flow compresses matter, φ has kinks and levels off within a voxel but X is smooth.
/// Where it shears matter along the surface, as along a wall, it is the other way around.
class BackwardMap {
  public:
    /// Returns the origins of voxels, in their order.
    using Trace = std::function<std::vector<Vec3d>(const std::vector<openvdb::Coord>&)>;

    /// The origin X, and φ as the fourth component: numbers that are added and multiplied together, if possible in one
    /// SIMD register.
    using Node = double __attribute__((vector_size(32)));

    /// An edge between two voxels that the surface crosses: from `voxel` along `axis`. The crossing is at `fraction` of
    /// it.
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

    /// φ and its derivatives along the axes, per voxel.
    struct Sample {
        double phi = 0;
        openvdb::Vec3d gradient{0};
    };

    explicit BackwardMap(ScalarField source) : mSource(std::move(source)) {}

    /// Traces all voxels that are needed to interpolate X at the surface. Starts in the cells (cubes between eight
    /// voxels) of `seeds`, and adds neighbours until every cell that the surface crosses is covered. Throws
    /// ResourceError if the surface becomes too large for the memory.
    void follow(const std::vector<openvdb::Vec3d>& seeds, const Trace& trace, const Monitor& monitor);

    size_t size() const { return mVoxels.size(); }
    const std::vector<openvdb::Coord>& voxels() const { return mVoxels; }
    Vec3d origin(size_t n) const { return {{mNodes[n][0], mNodes[n][1], mNodes[n][2]}}; }
    const openvdb::Int32Tree& index() const { return mIndex; } ///< Index in these arrays; -1 if unknown.

    bool inside(size_t n) const { return mNodes[n][3] < 0; }

    /// Returns every edge that the surface crosses, with the position of the crossing, in the order of voxels().
    std::vector<Crossing> crossings(const Monitor& monitor) const;

    /// Computes φ and its gradient at up to kBatch positions. `known` is false where a voxel of the interpolation is
    /// missing.
    using Accessor = openvdb::tree::ValueAccessor<const openvdb::Int32Tree, false>;
    void sample(const std::vector<openvdb::Vec3d>& positions, const Accessor& index, std::vector<Sample>& samples,
                std::vector<uint8_t>& known) const;

  private:
    void evaluate(size_t begin, const Monitor& monitor);
    std::vector<openvdb::Coord> crossedCells(size_t begin, const Monitor& monitor) const;

    struct Interpolated {
        Node value;
        std::array<Node, 3> derivatives; ///< Along the axes.
        Node difference;                 ///< Degree 5 minus degree 3.
    };
    bool interpolate(const openvdb::Vec3d& position, const Accessor& index, Interpolated& result) const;

    ScalarField mSource;
    openvdb::Int32Tree mIndex{-1};
    openvdb::MaskTree mKnown;
    std::vector<openvdb::Coord> mVoxels;
    std::vector<Node> mNodes;
};

} // namespace curlew
