// SPDX-License-Identifier: Apache-2.0
#include "curlew/noise/GradientNoise.h"

#include "curlew/base/Random.h"

namespace curlew {

template <int N>
GradientNoise<N>::GradientNoise(const GradientNoiseOptions<N>& options)
    : mLattice(options.period, 0x1p32, options.seed) {
    // Added after the reduction to the period, so any offset tiles.
    if (options.seed != 0)
        for (size_t axis = 0; axis < N; ++axis)
            mOffset[axis] = static_cast<uint32_t>(randomBits(options.seed, axis, 2) >> 32);
}

template class GradientNoise<2>;
template class GradientNoise<3>;

} // namespace curlew
