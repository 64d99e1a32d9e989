// SPDX-License-Identifier: Apache-2.0
#include "curlew/noise/PerlinNoise.h"

#include "curlew/base/Error.h"

#include <numbers>

namespace curlew {

namespace {

/// Returns the published gradients times the published scale of the noise, indexed by the lowest bits of the hash.
template <int N>
std::array<Vec<double, N>, 16> scaledGradients(PerlinGradients which) {
    std::array<Vec<double, N>, 16> all;
    if constexpr (N == 1) { // {1, -1}, scale 2
        for (size_t h = 0; h < all.size(); ++h) all[h][0] = h % 2 == 0 ? 2 : -2;
    } else if constexpr (N == 2) { // unit vectors, scale sqrt 2
        constexpr double kLong = std::numbers::sqrt2;
        constexpr std::array<Vec<double, 2>, 8> kGradients{
            {{{kLong, 0}}, {{-kLong, 0}}, {{0, kLong}}, {{0, -kLong}}, {{1, 1}}, {{-1, 1}}, {{1, -1}}, {{-1, -1}}}};
        for (size_t h = 0; h < all.size(); ++h) all[h] = kGradients[h % 8];
    } else {
        constexpr std::array<Vec3d, 12> kEdges{{{{1, 1, 0}},
                                                {{-1, 1, 0}},
                                                {{1, -1, 0}},
                                                {{-1, -1, 0}},
                                                {{1, 0, 1}},
                                                {{-1, 0, 1}},
                                                {{1, 0, -1}},
                                                {{-1, 0, -1}},
                                                {{0, 1, 1}},
                                                {{0, -1, 1}},
                                                {{0, 1, -1}},
                                                {{0, -1, -1}}}};
        std::copy(kEdges.begin(), kEdges.end(), all.begin());
        // Four gradients are repeated to make 16; the two versions order these differently.
        const bool catlike = which == PerlinGradients::catlike;
        all[12] = kEdges[0];
        all[13] = kEdges[catlike ? 1 : 9];
        all[14] = kEdges[catlike ? 9 : 1];
        all[15] = kEdges[11];
    }
    return all;
}

} // namespace

template <int N>
PerlinNoise<N>::PerlinNoise(const PerlinNoiseOptions<N>& options)
    : mLattice(options.period, kOwnPeriod, options.seed), mHash(options.seed) {
    if (N != 3 && options.gradients == PerlinGradients::reference)
        throw ValueError("Perlin noise has reference gradients in 3D only; use catlike");
    const auto gradients = scaledGradients<N>(options.gradients);
    for (size_t place = 0; place < mGradients.size(); ++place) {
        const auto& gradient = gradients[static_cast<size_t>(mHash.at(static_cast<float>(place))) % gradients.size()];
        for (size_t axis = 0; axis < N; ++axis) {
            mGradients[place].c[axis] = gradient.c[axis];
            mGradientsFloat[place].c[axis] = static_cast<float>(gradient.c[axis]);
        }
    }
}

template class PerlinNoise<1>;
template class PerlinNoise<2>;
template class PerlinNoise<3>;

} // namespace curlew
