// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/flow/Domain.h"
#include "curlew/math/Fade.h"

#include <algorithm>
#include <limits>
#include <span>

namespace curlew {

/// The factor by which a flow fades beyond a one-sided wall: 1 as far as trilinear interpolation on the flow's side
/// looks beyond the wall, then falling smoothly to 0.
class WallFade {
  public:
    /// The fade ends `voxels` voxels of edge `voxel` beyond the wall of the domain.
    WallFade(const Domain& domain, double voxel, double voxels) {
        if (!domain.wall || domain.wall->side == Side::both) return;
        mSide = domain.wall->side;
        // A sampled distance levels off beyond its reach; a lower bound of the distance (reach 0) does not.
        const double reach = domain.wall->sdf.reach;
        mLipschitz = domain.wall->sdf.lipschitz;
        mEnd = reach > 0 ? std::min(voxels * voxel, reach) : voxels * voxel;
        mBegin = mEnd * std::min(kInterpolation / voxels, 0.75);
        mOneSided = true;
    }
    bool oneSided() const { return mOneSided; }
    /// Returns the factor, from 1 to 0, at a distance from a one-sided wall.
    double at(double distance) const { return 1 - quinticFade((beyond(distance) - mBegin) / (mEnd - mBegin)).value; }
    /// Replaces distances by the factors there.
    template <class T>
    void replace(std::span<T> distances) const {
        constexpr size_t kAtOnce = 16; // mostly, all factors are 1 or all are 0
        const WallFade fade = *this;   // a copy, which the compiler knows that the results do not change
        for (size_t from = 0; from < distances.size(); from += kAtOnce) {
            const auto some = distances.subspan(from, std::min(kAtOnce, distances.size() - from));
            size_t ones = 0, zeros = 0; // as wide as the numbers that are compared, for SIMD
            for (const T d : some) {
                ones += static_cast<size_t>(fade.beyond(static_cast<double>(d)) <= fade.mBegin);
                zeros += static_cast<size_t>(fade.beyond(static_cast<double>(d)) >= fade.mEnd);
            }
            if (ones == some.size() || zeros == some.size())
                std::fill(some.begin(), some.end(), T(ones > 0));
            else
                for (T& d : some) d = static_cast<T>(fade.at(static_cast<double>(d)));
        }
    }
    /// The distance from the wall at which the factor is about 1/2.
    double middle() const { return (mSide == Side::inside ? 0.5 : -0.5) * (mBegin + mEnd); }
    /// Returns whether the factor is 1 within `radius` of a position at this distance.
    bool isFar(double distance, double radius) const {
        return !mOneSided || beyondWall(mSide, distance) + mLipschitz * radius < mBegin;
    }
    /// Returns the distances at which the factor is positive, widened by `margin`.
    DistanceRange range(double margin) const {
        DistanceRange range;
        if (mOneSided && mSide == Side::inside) range.upper = mEnd + margin;
        if (mOneSided && mSide == Side::outside) range.lower = -mEnd - margin;
        return range;
    }

  private:
    static constexpr double kInterpolation = 1.75; // In voxels; trilinear interpolation looks √3 voxels beyond the
                                                   // wall.

    double beyond(double distance) const { return mSide == Side::inside ? distance : -distance; }

    bool mOneSided = false;
    Side mSide = Side::inside;
    double mBegin = 0, mEnd = 1, mLipschitz = 1;
};

/// Computes the distances of the points from the wall of the domain; infinite if there is no wall.
template <class T>
void wallDistances(const Domain& domain, const PointBatch& points, JetBatch<T, 0>& distances) {
    if (domain.wall)
        domain.wall->sdf.distance.eval(points, distances);
    else
        distances.c[0].fill(std::numeric_limits<T>::infinity());
}

} // namespace curlew
