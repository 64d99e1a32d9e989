// SPDX-License-Identifier: Apache-2.0
#include "SplineBlocks.h"

#include "curlew/base/Parallel.h"
#include "curlew/math/Fade.h"
#include "curlew/vdb/Openvdb.h"

#include <algorithm>
#include <cmath>

namespace curlew {

using openvdb::Coord;

namespace {

/// Returns how much the coefficients of the larger voxels count at a distance, relative to the reach: not at all near
/// the surface, and alone from the reach on.
double coarseness(double distance) {
    constexpr double kOwn = 1.0 / 3;
    return quinticFade((std::abs(distance) - kOwn) / (1 - kOwn)).value;
}

/// Returns the longest gradient between the coefficients of a block, per voxel.
float steepestIn(const SplineBlocks::Block& block) {
    constexpr size_t kX = SplineBlocks::kBlock * SplineBlocks::kBlock, kY = SplineBlocks::kBlock;
    float squared = 0;
    for (size_t i = 1; i < SplineBlocks::kBlock - 1; ++i)
        for (size_t j = 1; j < SplineBlocks::kBlock - 1; ++j)
            for (size_t k = 1; k < SplineBlocks::kBlock - 1; ++k) {
                const float* c = &block[i * kX + j * kY + k];
                const float x = c[kX] - *(c - kX), y = c[kY] - *(c - kY), z = c[1] - *(c - 1);
                squared = std::max(squared, x * x + y * y + z * z);
            }
    return std::sqrt(squared) / 2;
}

} // namespace

SplineBlocks::SplineBlocks(const std::shared_ptr<const openvdb::FloatGrid>& grid, double reach,
                           const SplineBlocks* beyond)
    : mGrid(grid), mReach(reach), mBeyond(beyond) {
    std::vector<const openvdb::FloatTree::LeafNodeType*> leaves;
    mGrid->tree().getNodes(leaves);
    mBlocks.resize(leaves.size());
    std::vector<Vec3d> coordinates;
    coordinates.reserve(leaves.size());
    for (const auto* leaf : leaves) coordinates.push_back(coordinatesOf(leafOf(leaf->origin())));
    mNumbers = LeafTable(coordinates);
    parallelFor(leaves.size(), 16, [&](size_t begin, size_t end) {
        for (size_t n = begin; n < end; ++n) fill(mBlocks[n], leaves[n]->origin());
    });
    measure();
}

void SplineBlocks::fill(Block& block, const Coord& origin) const {
    const openvdb::tree::ValueAccessor<const openvdb::FloatTree, /*IsSafe=*/false> samples(mGrid->tree());
    constexpr int kRim = kBlock + 2; // the prefilter needs one more sample on each side
    std::array<float, kRim * kRim * kRim> s;
    size_t n = 0;
    for (int i = -2; i < kRim - 2; ++i)
        for (int j = -2; j < kRim - 2; ++j)
            for (int k = -2; k < kRim - 2; ++k) s[n++] = samples.getValue(origin.offsetBy(i, j, k));
    SplineRefinement::Block coarse{};
    if (mBeyond)
        coarse = SplineRefinement::blockAt({{origin[0] - 1, origin[1] - 1, origin[2] - 1}}, [&](int i, int j, int k) {
            return mBeyond->coefficient({i, j, k});
        });
    n = 0;
    for (int i = 1; i <= kBlock; ++i)
        for (int j = 1; j <= kBlock; ++j)
            for (int k = 1; k <= kBlock; ++k, ++n) {
                const auto at = [&](int a, int b, int c) {
                    const int index = (a * kRim + b) * kRim + c;
                    return static_cast<double>(s[static_cast<size_t>(index)]);
                };
                const double around = at(i - 1, j, k) + at(i + 1, j, k) + at(i, j - 1, k) + at(i, j + 1, k) +
                                      at(i, j, k - 1) + at(i, j, k + 1);
                const double here = 2 * at(i, j, k) - around / 6;
                block[n] =
                    static_cast<float>(mBeyond ? std::lerp(here, coarse[n], coarseness(at(i, j, k) / mReach)) : here);
            }
}

float SplineBlocks::coefficient(const Coord& ijk) const {
    constexpr int kOfVoxel = (kBlock + 1) * kBlock + 1; // from the first coefficient that a position in it needs
    if (const float* block = at(leafOf(ijk)))
        return block[((ijk[0] & 7) * kBlock + (ijk[1] & 7)) * kBlock + (ijk[2] & 7) + kOfVoxel];
    if (!mBeyond) return mGrid->tree().getValue(ijk);
    const auto larger = [&](int i, int j, int k) { return mBeyond->coefficient({i, j, k}); };
    return static_cast<float>(SplineRefinement::at({{ijk[0], ijk[1], ijk[2]}}, larger));
}

void SplineBlocks::measure() {
    const auto background = static_cast<double>(mGrid->background());
    mRange = {background, background};
    const auto widen = [&](float c) {
        mRange = {std::min(mRange.lower, static_cast<double>(c)), std::max(mRange.upper, static_cast<double>(c))};
    };
    auto tile = mGrid->tree().cbeginValueAll();
    tile.setMaxDepth(openvdb::FloatTree::ValueAllCIter::LEAF_DEPTH - 1);
    for (; tile; ++tile) widen(*tile);
    for (const Block& block : mBlocks)
        for (const float c : block) widen(c);
    constexpr size_t kGrain = 64;
    std::vector<float> steepest((mBlocks.size() + kGrain - 1) / kGrain);
    parallelFor(mBlocks.size(), kGrain, [&](size_t begin, size_t end) {
        for (size_t n = begin; n < end; ++n)
            steepest[begin / kGrain] = std::max(steepest[begin / kGrain], steepestIn(mBlocks[n]));
    });
    for (const float one : steepest)
        mLipschitz = std::max(mLipschitz, static_cast<double>(one) / mGrid->voxelSize()[0]);
}

} // namespace curlew
