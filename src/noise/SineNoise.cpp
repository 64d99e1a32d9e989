// SPDX-License-Identifier: Apache-2.0
#include "curlew/noise/SineNoise.h"

#include "curlew/base/Error.h"
#include "curlew/base/Random.h"

#include <fmt/format.h>

namespace curlew {

namespace {

/// The streams of random numbers.
enum Stream : uint64_t { kDirection, kLength, kPhase };

/// Returns candidate k, uniform on the sphere: a point of the ball, by rejection from the cube, normalised.
template <int N>
Vec<double, N> randomDirection(uint64_t seed, uint64_t k) {
    for (uint64_t attempt = 0;; ++attempt) {
        Vec<double, N> v;
        for (int axis = 0; axis < N; ++axis)
            v[axis] = 2 * randomUniform(randomBits(seed, k, kDirection), attempt, static_cast<uint64_t>(axis)) - 1;
        if (const double square = dot(v, v); square > 1e-4 && square <= 1) return normalized(v);
    }
}

/// Spreads `count` directions as undirected lines, because sin(k·x) and sin(-k·x) look alike.
template <int N, size_t Most>
void spreadDirections(std::array<Vec<double, N>, Most>& u, size_t count, uint64_t seed) {
    constexpr uint64_t kCandidates = 32;
    for (size_t m = 0; m < count; ++m) {
        double least = 2;
        for (uint64_t k = 0; k < kCandidates; ++k) {
            const Vec<double, N> candidate = randomDirection<N>(seed, m * kCandidates + k);
            double nearest = 0;
            for (size_t i = 0; i < m; ++i) nearest = std::max(nearest, std::abs(dot(u[i], candidate)));
            if (nearest < least) {
                least = nearest;
                u[m] = candidate;
            }
        }
    }
    // Among many evenly spread directions, the force on one is 3 count / (N (N + 2)) times that direction. Half the
    // inverse of this factor is a stable step.
    const double step = 0.5 / std::max(1.0, 3.0 * static_cast<double>(count) / (N * (N + 2)));
    for (int sweep = 0; sweep < 100; ++sweep)
        for (size_t m = 0; m < count; ++m) {
            Vec<double, N> force;
            for (size_t i = 0; i < count; ++i) {
                const double cosine = dot(u[m], u[i]);
                force += u[i] * (cosine * cosine * cosine);
            }
            u[m] = normalized(u[m] - force * step);
        }
}

/// Returns nu rounded to a wave vector that tiles. It is never zero, which would be a constant.
template <int N>
Vec<double, N> tiling(Vec<double, N> nu, const Vec<int, N>& period) {
    int strongest = 0;
    double most = 0, size = 0;
    for (int axis = 0; axis < N; ++axis) {
        if (const int p = period[axis]; p > 0) {
            const double cycles = nu[axis] * p;
            if (std::abs(cycles) > std::abs(most)) {
                most = cycles;
                strongest = axis;
            }
            nu[axis] = std::floor(cycles + 0.5) / p;
        }
        size += std::abs(nu[axis]);
    }
    if (size == 0) nu[strongest] = std::copysign(1.0 / period[strongest], most);
    return nu;
}

} // namespace

template <int N>
SineNoise<N>::SineNoise(const SineNoiseOptions<N>& options) : mOptions(options) {
    if (options.waves < 1 || options.waves > kMaxWaves)
        throw ValueError(fmt::format("{} waves are out of range; give 1 to {}", options.waves, kMaxWaves));
    for (const int period : options.period.c) requirePeriod(period);
    const auto count = static_cast<size_t>(options.waves);
    spreadDirections(mWaves, count, options.seed);
    for (size_t m = 0; m < count; ++m) {
        const double r = randomUniform(options.seed, m, kLength);
        const double waveNumber = 0.75 + 0.5 * (static_cast<double>(m) + r) / static_cast<double>(count);
        mWaves[m] = tiling(mWaves[m] * waveNumber, options.period);
        mPhases[m] = randomUniform(options.seed, m, kPhase);
    }
}

template class SineNoise<1>;
template class SineNoise<2>;
template class SineNoise<3>;
template class SineNoise<4>;
template class SineNoise<5>;
template class SineNoise<6>;
template class SineNoise<7>;

} // namespace curlew
