// SPDX-License-Identifier: Apache-2.0
#include "curlew/noise/CubicLattice.h"

#include "curlew/base/Error.h"
#include "curlew/base/Random.h"

#include <fmt/format.h>

#include <utility>

namespace curlew {

namespace {

/// The permutation of Ken Perlin's reference implementation of improved noise (2002).
constexpr std::array<uint8_t, PermutationHash::kSize> kPermutation{
    151, 160, 137, 91,  90,  15,  131, 13,  201, 95,  96,  53,  194, 233, 7,   225, 140, 36,  103, 30,  69,  142,
    8,   99,  37,  240, 21,  10,  23,  190, 6,   148, 247, 120, 234, 75,  0,   26,  197, 62,  94,  252, 219, 203,
    117, 35,  11,  32,  57,  177, 33,  88,  237, 149, 56,  87,  174, 20,  125, 136, 171, 168, 68,  175, 74,  165,
    71,  134, 139, 48,  27,  166, 77,  146, 158, 231, 83,  111, 229, 122, 60,  211, 133, 230, 220, 105, 92,  41,
    55,  46,  245, 40,  244, 102, 143, 54,  65,  25,  63,  161, 1,   216, 80,  73,  209, 76,  132, 187, 208, 89,
    18,  169, 200, 196, 135, 130, 116, 188, 159, 86,  164, 100, 109, 198, 173, 186, 3,   64,  52,  217, 226, 250,
    124, 123, 5,   202, 38,  147, 118, 126, 255, 82,  85,  212, 207, 206, 59,  227, 47,  16,  58,  17,  182, 189,
    28,  42,  223, 183, 170, 213, 119, 248, 152, 2,   44,  154, 163, 70,  221, 153, 101, 155, 167, 43,  172, 9,
    129, 22,  39,  253, 19,  98,  108, 110, 79,  113, 224, 232, 178, 185, 112, 104, 218, 246, 97,  228, 251, 34,
    242, 193, 238, 210, 144, 12,  191, 179, 162, 241, 81,  51,  145, 235, 249, 14,  239, 107, 49,  192, 214, 31,
    181, 199, 106, 157, 184, 84,  204, 176, 115, 121, 50,  45,  127, 4,   150, 254, 138, 236, 205, 93,  222, 114,
    67,  29,  24,  72,  243, 141, 128, 195, 78,  66,  215, 61,  156, 180};

} // namespace

void requirePeriod(int period) {
    if (period < 0) throw ValueError(fmt::format("period {} is negative; give whole numbers, 0 for no tiling", period));
}

template <int N>
CubicLattice<N>::CubicLattice(const Vec<int, N>& period, double natural, uint64_t seed) {
    for (int axis = 0; axis < N; ++axis) {
        requirePeriod(period[axis]);
        mPeriod[axis] = period[axis] > 0 ? period[axis] : natural;
        mInverse[axis] = 1 / mPeriod[axis];
        // Never 0, because then planes of vertices could coincide with those of seed 0.
        if (seed != 0)
            mShift[axis] = static_cast<double>(1 + randomBits(seed, static_cast<uint64_t>(axis), 1) % 4095) / 4096;
    }
}

template class CubicLattice<1>;
template class CubicLattice<2>;
template class CubicLattice<3>;

PermutationHash::PermutationHash(uint64_t seed) {
    std::array<uint8_t, kSize> permutation = kPermutation;
    if (seed != 0)
        for (size_t i = permutation.size() - 1; i > 0; --i)
            std::swap(permutation[i], permutation[randomBits(seed, i, 2) % (i + 1)]);
    std::copy(permutation.begin(), permutation.end(), mPermutation.begin());
}

} // namespace curlew
