// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "RadialDistribution.h"
#include "curlew/base/Random.h"

#include <boost/random/sobol.hpp>

#include <bit>

namespace curlew::paper {

/// Returns the first 2^power points of the Sobol sequence in the unit cube, scrambled with random lower triangular bit
/// matrices and a random shift (Matousek 1998), as SciPy does by default.
template <int N>
Positions<N> sobolPoints(int power, uint64_t seed) {
    constexpr int kBits = 32;
    std::array<std::array<uint32_t, kBits>, size_t{N}> matrix;
    std::array<uint32_t, size_t{N}> shift;
    for (uint64_t axis = 0; axis < N; ++axis) {
        shift[axis] = static_cast<uint32_t>(randomBits(seed, axis, kBits));
        for (uint64_t row = 0; row < kBits; ++row) { // bit 31 is the most significant: it stands for one half
            const uint32_t diagonal = 1U << (kBits - 1 - row), above = ~(2 * diagonal - 1);
            matrix[axis][row] = diagonal | (above & static_cast<uint32_t>(randomBits(seed, axis, row)));
        }
    }
    boost::random::sobol engine(N);
    Positions<N> points(size_t{1} << power);
    for (size_t k = 0; k < points.size(); ++k)
        for (size_t axis = 0; axis < N; ++axis) {
            // Boost skips the first point, 0.
            const auto bits = k == 0 ? 0 : static_cast<uint32_t>(engine() >> (64 - kBits));
            uint32_t scrambled = shift[axis];
            for (uint64_t row = 0; row < kBits; ++row)
                scrambled ^= static_cast<uint32_t>(std::popcount(matrix[axis][row] & bits) & 1) << (kBits - 1 - row);
            points[k].c[axis] = (scrambled + 0.5) * 0x1p-32;
        }
    return points;
}

} // namespace curlew::paper
