#include "curlew/noise/Psrd.h"

#include "curlew/base/Error.h"
#include "curlew/base/Random.h"

#include <fmt/format.h>

#include <algorithm>
#include <numbers>

namespace curlew {

namespace {

/// The rotated gradient of one hash value: a point of a spherical Fibonacci spiral (theta, z), turned by alpha about an
/// axis perpendicular to it that psi picks (paper, step 8 and 9b; the constants are the published ones).
Vec3d rotatedGradient(int hash, double alpha) {
    const double theta = hash * 3.883222077, psi = hash * 0.108705628;
    const double z = 0.996539792 - 0.006920415 * hash, radius = std::sqrt(1 - z * z);
    const double ct = std::cos(theta), st = std::sin(theta);
    const Vec3d p{{ct * radius, st * radius, z}};
    if (alpha == 0) return p;
    const double cp = std::cos(psi), sp = std::sin(psi), ctp = st * sp - ct * cp;
    const auto mix = [](double a, double b, double t) { return a * (1 - t) + b * t; };
    const Vec3d q{{mix(ctp * st, sp, z), mix(-ctp * ct, cp, z), -(p[1] * cp + p[0] * sp)}};
    return p * std::cos(alpha) + q * std::sin(alpha);
}

/// A rotation, uniform among all (Shoemake 1992, from a random unit quaternion); the identity for seed 0.
Matrix3 seededRotation(uint64_t seed) {
    if (seed == 0) return {};
    const auto draw = [&](uint64_t k) { return randomUniform(seed, k, 3); };
    const double a = 2 * std::numbers::pi * draw(1), b = 2 * std::numbers::pi * draw(2);
    const double r = std::sqrt(1 - draw(0)), t = std::sqrt(draw(0));
    const double x = r * std::sin(a), y = r * std::cos(a), z = t * std::sin(b), w = t * std::cos(b);
    return {{Vec3d{{1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)}},
             Vec3d{{2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)}},
             Vec3d{{2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)}}}};
}

} // namespace

Psrd3::Psrd3(const PsrdOptions& options) : mOptions(options) {
    for (int axis = 0; axis < 3; ++axis) {
        if (options.period[axis] < 0)
            throw ValueError(
                fmt::format("period {} is negative; give whole numbers, 0 for no tiling", options.period[axis]));
        mTiles |= options.period[axis] > 0;
    }
    for (size_t k = 0; k < kHashes; ++k) mPermutation[k] = static_cast<uint16_t>((k * 34 + 10) * k % kHashes);
    // A seed moves the lattice under the hash, and shuffles the hash: a shift alone would give fields that are
    // translates of one another, and the published permutation of two shifted lattices is far from independent. It also
    // turns the gradients: else two seeds would share one at a vertex in 289, and their flow would stand still around
    // it.
    if (options.seed != 0) {
        for (uint64_t axis = 0; axis < 3; ++axis)
            mShift[axis] = static_cast<int>(randomBits(options.seed, axis, 1) % kHashes);
        for (size_t i = kHashes - 1; i > 0; --i)
            std::swap(mPermutation[i], mPermutation[randomBits(options.seed, i, 2) % (i + 1)]);
    }
    std::copy_n(mPermutation.begin(), kHashes, mPermutation.begin() + kHashes);
    const Matrix3 turn = seededRotation(options.seed);
    for (size_t h = 0; h < kHashes; ++h) {
        mGradients[h] = turn * rotatedGradient(static_cast<int>(h), options.alpha);
        for (int axis = 0; axis < 3; ++axis) mGradientsFloat[h][axis] = static_cast<float>(mGradients[h][axis]);
    }
}

} // namespace curlew
