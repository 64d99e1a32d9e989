// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "LeafTable.h"
#include "SplineContraction.h"
#include "SplineRefinement.h"
#include "curlew/math/Interval.h"
#include "curlew/vdb/GridTypes.h"

#include <openvdb/Types.h>

#include <array>
#include <memory>
#include <vector>

namespace curlew {

/// The coefficients of a tricubic B-spline on the leaves of a narrow band. Each leaf has all that a position in it
/// needs, including its neighbours', in one block. So a lookup is one entry of a table and 64 values close together in
/// memory.
///
/// A band with larger voxels on the same lattice may continue the spline (SplineRefinement.h). The coefficients of both
/// are blended. Where only those of the larger voxels are left, the two are the same function, and it does not matter
/// where the blocks end: a leaf without one is at least the half width away from the surface, and at its faces only
/// coefficients within kSplineSupport of it count, which are beyond the reach.
class SplineBlocks {
  public:
    static constexpr int kBlock = SplineContraction::kBlock;
    using Block = std::array<float, kBlock * kBlock * kBlock>;

    SplineBlocks() = default;
    /// `beyond`: the blocks that continue these, or nullptr. They must live as long. `reach`: in world units from the
    /// surface; farther away, the spline of the grid is no distance, and `beyond` counts alone.
    SplineBlocks(const std::shared_ptr<const openvdb::FloatGrid>& grid, double reach, const SplineBlocks* beyond);

    static openvdb::Coord leafOf(const openvdb::Coord& ijk) { return {ijk[0] >> 3, ijk[1] >> 3, ijk[2] >> 3}; }

    const LeafTable& table() const { return mNumbers; }
    const std::vector<Block>& all() const { return mBlocks; }
    /// Returns the number of a leaf's block, or LeafTable::kNone.
    int32_t numberOf(const openvdb::Coord& leaf) const { return mNumbers.find(mNumbers.keyOf(coordinatesOf(leaf))); }
    /// Returns the block of a leaf, or nullptr.
    const float* at(const LeafTable::Key<double>& key) const { return numbered(mNumbers.find(key)); }
    const float* at(const openvdb::Coord& leaf) const { return numbered(numberOf(leaf)); }

    /// The range of all coefficients, tiles and the background, between which the values of the spline lie.
    const Interval& range() const { return mRange; }
    /// Maximum length of the gradient, from the central differences of the coefficients, of which the gradient is an
    /// average.
    double lipschitz() const { return mLipschitz; }

  private:
    static Vec3d coordinatesOf(const openvdb::Coord& leaf) {
        return {{double(leaf[0]), double(leaf[1]), double(leaf[2])}};
    }
    const float* numbered(int32_t number) const {
        return number == LeafTable::kNone ? nullptr : mBlocks[static_cast<size_t>(number)].data();
    }
    /// Returns one coefficient; where there is no block, that of the band that continues this one, or the level.
    float coefficient(const openvdb::Coord& ijk) const;
    void fill(Block& block, const openvdb::Coord& origin) const;
    void measure();

    std::shared_ptr<const openvdb::FloatGrid> mGrid;
    double mReach = 0;
    const SplineBlocks* mBeyond = nullptr;
    LeafTable mNumbers;
    std::vector<Block> mBlocks;
    Interval mRange;
    double mLipschitz = 0;
};

} // namespace curlew
