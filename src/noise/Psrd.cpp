// SPDX-License-Identifier: Apache-2.0
#include "curlew/noise/Psrd.h"

#include "curlew/base/Error.h"
#include "curlew/base/Random.h"

#include <fmt/format.h>

#include <algorithm>
#include <numbers>
#include <numeric>

namespace curlew {

namespace {

// The gradient of a hash value, rotated by alpha. The constants are the published ones.

Vec<double, 2> rotatedGradient(int hash, const PsrdOptionsN<2>& options) {
    const double psi = hash * 0.07482 + options.alpha;
    return {{std::cos(psi), std::sin(psi)}};
}

/// Steps 8 and 9b of the paper. (theta, z) is a point s of a spherical Fibonacci spiral. psi selects the plane through
/// s in which the standard rotation turns, and the angle at which the fast rotation starts in the plane perpendicular
/// to s.
Vec3d rotatedGradient(int hash, const PsrdOptions& options) {
    const double theta = hash * 3.883222077, psi = hash * 0.108705628;
    const double z = 0.996539792 - 0.006920415 * hash, radius = std::sqrt(1 - z * z);
    const double ct = std::cos(theta), st = std::sin(theta);
    if (options.rotation == PsrdOptions::Rotation::fast) {
        const Vec3d alongParallel{{st, -ct, 0}}, alongMeridian{{-ct * z, -st * z, radius}};
        return alongMeridian * std::cos(psi + options.alpha) + alongParallel * std::sin(psi + options.alpha);
    }
    const Vec3d p{{ct * radius, st * radius, z}};
    if (options.alpha == 0) return p;
    const double cp = std::cos(psi), sp = std::sin(psi), ctp = st * sp - ct * cp;
    const auto mix = [](double a, double b, double t) { return a * (1 - t) + b * t; };
    const Vec3d q{{mix(ctp * st, sp, z), mix(-ctp * ct, cp, z), -(p[1] * cp + p[0] * sp)}};
    return p * std::cos(options.alpha) + q * std::sin(options.alpha);
}

/// Returns a uniformly distributed random rotation; the identity for seed 0.
template <int N>
Matrix<N, N> seededRotation(uint64_t seed) {
    if (seed == 0) return {};
    const auto draw = [&](uint64_t k) { return randomUniform(seed, k, 3); };
    const double a = 2 * std::numbers::pi * draw(1);
    if constexpr (N == 2) {
        return {{Vec<double, 2>{{std::cos(a), -std::sin(a)}}, Vec<double, 2>{{std::sin(a), std::cos(a)}}}};
    } else { // from a random unit quaternion (Shoemake 1992)
        const double b = 2 * std::numbers::pi * draw(2), r = std::sqrt(1 - draw(0)), t = std::sqrt(draw(0));
        const double x = r * std::sin(a), y = r * std::cos(a), z = t * std::sin(b), w = t * std::cos(b);
        return {{Vec3d{{1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)}},
                 Vec3d{{2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)}},
                 Vec3d{{2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)}}}};
    }
}

/// Draws one of 1088 permutations of the published form (34 h² + 10 h) modulo 289. Larger factors would not be exact in
/// float.
template <class Permutation>
Permutation randomPermutation(uint64_t seed, uint64_t step) {
    const auto draw = [&](uint64_t k, uint64_t below) { return static_cast<int>(randomBits(seed, step, k) % below); };
    constexpr std::array<int, 4> kQuadratic{-34, -17, 17, 34};
    const int k = draw(5, 272), unit = 1 + k + k / 16; // the k-th positive integer that 17 does not divide
    return {static_cast<float>(kQuadratic[static_cast<size_t>(draw(2, 4))]),
            static_cast<float>(unit > 144 ? unit - 289 : unit)};
}

} // namespace

template <int N>
PsrdN<N>::PsrdN(const PsrdOptionsN<N>& options) : mOptions(options) {
    for (int axis = 0; axis < N; ++axis) {
        if (options.period[axis] < 0)
            throw ValueError(fmt::format("period {} along {} is negative; give whole numbers, 0 for no tiling",
                                         options.period[axis], "xyz"[axis]));
        mTiles |= options.period[axis] > 0;
        mPeriod[axis] = onLattice([](auto lattice) { return double(lattice.kUnits); }) * options.period[axis];
        mDivisor[axis] = std::max(mPeriod[axis], 1.0);
    }
    if (!std::isfinite(options.alpha)) throw ValueError(fmt::format("alpha {} must be finite", options.alpha));
    mPermutations.fill({34, 10});
    if (N == 2) mPermutations[0] = {51, 2};
    // A seed shifts the hashed vertices and selects other permutations: with a shift alone, all fields would be
    // translates of one another, and the published permutation on two shifted lattices is far from independent. It also
    // rotates the gradients. Otherwise two seeds would share a gradient at one vertex in 289, and their flow would
    // stagnate around it. Finally it translates the lattice by multiples of 1/4096, never by 0. Gradients are longest
    // at vertices, so the flow of two noises on one lattice would be fastest in a regular grid of spots.
    if (options.seed != 0)
        for (size_t axis = 0; axis < N; ++axis) {
            mShift.c[axis] = static_cast<float>(randomBits(options.seed, axis, 1) % kHashes) - kMaxHash;
            mTranslation.c[axis] = static_cast<double>(1 + randomBits(options.seed, axis, 4) % 4095) / 4096;
            mPermutations[axis] = randomPermutation<Permutation>(options.seed, axis);
        }
    const Matrix<N, N> turn = seededRotation<N>(options.seed);
    for (size_t k = 0; k < kHashes; ++k) {
        // The published hashes are 0 … 288.
        const auto hash = static_cast<int>((k + kHashes - kMaxHash) % kHashes);
        const Vec<double, N> gradient = turn * rotatedGradient(hash, options);
        for (size_t axis = 0; axis < N; ++axis) {
            mGradients[k].c[axis] = gradient.c[axis];
            mGradientsFloat[k].c[axis] = static_cast<float>(gradient.c[axis]);
        }
    }
}

template <int N>
Vec<int64_t, N> PsrdN<N>::tilingPeriod() const {
    const Vec<int, N> own = onLattice([](auto lattice) { return lattice.kRepeat; });
    Vec<int64_t, N> tiling;
    for (int axis = 0; axis < N; ++axis) tiling[axis] = std::lcm(int64_t{mOptions.period[axis]}, int64_t{own[axis]});
    return tiling;
}

template class PsrdN<2>;
template class PsrdN<3>;

} // namespace curlew
