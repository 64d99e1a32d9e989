#include "curlew/noise/Psrd.h"

#include "curlew/base/Error.h"
#include "curlew/base/Random.h"

#include <fmt/format.h>

#include <algorithm>

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

} // namespace

Psrd3::Psrd3(const PsrdOptions& options) : mOptions(options), mTiles(false) {
    for (int axis = 0; axis < 3; ++axis) {
        if (options.period[axis] < 0)
            throw ValueError(
                fmt::format("period {} is negative; give whole numbers, 0 for no tiling", options.period[axis]));
        mTiles |= options.period[axis] > 0;
    }
    for (size_t k = 0; k < kHashes; ++k) mPermutation[k] = static_cast<uint16_t>((k * 34 + 10) * k % kHashes);
    // A seed moves the lattice under the hash, and shuffles the hash: a shift alone would give fields that are
    // translates of one another, and the published permutation of two shifted lattices is far from independent.
    if (options.seed != 0) {
        for (uint64_t axis = 0; axis < 3; ++axis)
            mShift[axis] = static_cast<int>(randomBits(options.seed, axis, 1) % kHashes);
        for (size_t i = kHashes - 1; i > 0; --i)
            std::swap(mPermutation[i], mPermutation[randomBits(options.seed, i, 2) % (i + 1)]);
    }
    std::copy_n(mPermutation.begin(), kHashes, mPermutation.begin() + kHashes);
    for (size_t h = 0; h < kHashes; ++h) {
        mGradients[h] = rotatedGradient(static_cast<int>(h), options.alpha);
        for (int axis = 0; axis < 3; ++axis) mGradientsFloat[h][axis] = static_cast<float>(mGradients[h][axis]);
    }
}

} // namespace curlew
