// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "SplineContraction.h"

#include <array>
#include <cstdlib>

namespace curlew {

/// A cubic B-spline on voxels is also one on voxels of a third of their size (knot insertion, Boehm 1980). Independent
/// of OpenVDB.
struct SplineRefinement {
    static constexpr int kRatio = 3; ///< Of the sizes; the centre of voxel i is that of the smaller voxel 3 i.

    /// The coefficients of kBlock³ smaller voxels, z fastest.
    static constexpr size_t kBlock{SplineContraction::kBlock};
    using Block = std::array<double, kBlock * kBlock * kBlock>;

    /// Returns those from `first` on. `coefficient(i, j, k)` returns one of the spline.
    template <class Coefficient>
    static Block blockAt(const Vec<int, 3>& first, const Coefficient& coefficient) {
        constexpr size_t kCube = kLarge * kLarge * kLarge, kPlane = kBlock * kBlock;
        std::array<Weights, 3> w;
        for (size_t axis = 0; axis < 3; ++axis) w[axis] = weightsFrom(first[static_cast<int>(axis)]);
        std::array<double, kCube> c;
        for (size_t n = 0; n < kCube; ++n) {
            const auto at = [&](size_t axis, size_t index) { return w[axis].lowest + static_cast<int>(index); };
            c[n] = static_cast<double>(
                coefficient(at(0, n / kLarge / kLarge), at(1, n / kLarge % kLarge), at(2, n % kLarge)));
        }
        // Along z, then y, then x.
        std::array<double, kLarge * kLarge * kBlock> lines{};
        for (size_t row = 0; row < kLarge * kLarge; ++row)
            for (size_t m = 0; m < kLarge; ++m)
                for (size_t k = 0; k < kBlock; ++k) lines[row * kBlock + k] += w[2].of[m][k] * c[row * kLarge + m];
        std::array<double, kLarge * kPlane> planes{};
        for (size_t i = 0; i < kLarge; ++i)
            for (size_t m = 0; m < kLarge; ++m)
                for (size_t j = 0; j < kBlock; ++j)
                    for (size_t k = 0; k < kBlock; ++k)
                        planes[(i * kBlock + j) * kBlock + k] += w[1].of[m][j] * lines[(i * kLarge + m) * kBlock + k];
        Block block{};
        for (size_t m = 0; m < kLarge; ++m)
            for (size_t i = 0; i < kBlock; ++i)
                for (size_t k = 0; k < kPlane; ++k) block[i * kPlane + k] += w[0].of[m][i] * planes[m * kPlane + k];
        return block;
    }

    /// Returns one of the smaller voxels' coefficients.
    template <class Coefficient>
    static double at(const Vec<int, 3>& small, const Coefficient& coefficient) {
        constexpr int kMost = 3; // coefficients along an axis on which it depends
        Vec<int, 3> lowest;
        for (int axis = 0; axis < 3; ++axis) lowest[axis] = roundedUp(small[axis] - kReach);
        const auto weight = [&](int axis, int n) { return weightAt(small[axis] - kRatio * (lowest[axis] + n)); };
        double sum = 0;
        for (int i = 0; i < kMost; ++i)
            for (int j = 0; j < kMost; ++j)
                for (int k = 0; k < kMost; ++k)
                    if (const double w = weight(0, i) * weight(1, j) * weight(2, k); w > 0)
                        sum += w * static_cast<double>(coefficient(lowest[0] + i, lowest[1] + j, lowest[2] + k));
        return sum;
    }

  private:
    static constexpr int kReach = 4;    ///< Smaller voxels on either side on which a coefficient has an effect.
    static constexpr size_t kLarge = 7; ///< Coefficients along an axis on which those of a block depend.

    /// What coefficients lowest … lowest + kLarge - 1 along an axis contribute to those of a block.
    struct Weights {
        int lowest;
        std::array<std::array<double, kBlock>, kLarge> of;
    };
    static Weights weightsFrom(int first) {
        Weights w;
        w.lowest = roundedUp(first - kReach);
        for (size_t m = 0; m < kLarge; ++m)
            for (size_t k = 0; k < kBlock; ++k)
                w.of[m][k] = weightAt(first + static_cast<int>(k) - kRatio * (w.lowest + static_cast<int>(m)));
        return w;
    }
    /// What a coefficient contributes to that of the smaller voxel at this offset.
    static double weightAt(int offset) {
        constexpr std::array<double, size_t{kReach} + 1> kTwentySevenths{19, 16, 10, 4, 1};
        const int off = std::abs(offset);
        return off <= kReach ? kTwentySevenths[static_cast<size_t>(off)] / 27 : 0;
    }
    /// Returns the first voxel whose centre is not before that of a smaller one.
    static int roundedUp(int small) { return small / kRatio + (small % kRatio > 0 ? 1 : 0); }
};

} // namespace curlew
