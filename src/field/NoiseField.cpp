// SPDX-License-Identifier: Apache-2.0
#include "curlew/field/NoiseField.h"

#include "NoiseModels.h"
#include "curlew/base/Error.h"

#include <fmt/format.h>

namespace curlew {

using namespace detail;

namespace {

void validate(const OctaveOptions& o) {
    if (!(o.frequency > 0) || !std::isfinite(o.frequency))
        throw ValueError(fmt::format("frequency {} must be positive and finite", o.frequency));
    if (o.octaves < 1 || o.octaves > 32) throw ValueError(fmt::format("{} octaves; give 1 to 32", o.octaves));
    if (!(o.lacunarity > 0) || !std::isfinite(o.lacunarity))
        throw ValueError(fmt::format("lacunarity {} must be positive and finite", o.lacunarity));
    if (!std::isfinite(o.gain) || !std::isfinite(o.amplitude) || !std::isfinite(o.warp))
        throw ValueError("gain, amplitude and warp must be finite");
    if (!std::isfinite(o.octaveAlpha)) throw ValueError("octaveAlpha must be finite");
    // Beyond these limits, its square in float would overflow or vanish.
    if (o.billow != 0 && !(o.billow >= 1e-9 && o.billow <= 1e9))
        throw ValueError(fmt::format("billow {} must be 0, or between 1e-9 and 1e9", o.billow));
}

/// Returns the options of an octave with `ratio` times the frequency and `turns` times the alpha of the first octave.
template <class Options>
Options octaveOf(Options options, double ratio, double turns) {
    if constexpr (requires { options.alpha; }) options.alpha *= turns;
    if constexpr (requires { options.period; })
        for (int& p : options.period.c) {
            const double period = p * ratio;
            if (period > 0x1p30) throw ValueError("the period of the highest octave is too large; use fewer octaves");
            p = static_cast<int>(period);
        }
    return options;
}

template <class Options>
bool tiles(const Options& options) {
    if constexpr (requires { options.period; })
        return options.period != decltype(options.period){};
    else
        return false;
}

} // namespace

template <class Noise>
ScalarFieldN<Noise::kDimension> noiseField(const typename Noise::Options& noise, const OctaveOptions& options) {
    constexpr int kN = Noise::kDimension;
    validate(options);
    if (tiles(noise) && options.octaves > 1 && options.lacunarity != std::floor(options.lacunarity))
        throw ValueError(
            fmt::format("octaves tile only if the lacunarity is a whole number, not {}", options.lacunarity));
    double sum = 0;
    for (int k = 0; k < options.octaves; ++k) sum += std::pow(std::abs(options.gain), k);
    Octaves<Noise> octaves{{}, options.billow};
    for (int k = 0; k < options.octaves; ++k) {
        const double ratio = std::pow(options.lacunarity, k), weight = std::pow(options.gain, k);
        const double frequency = options.frequency * ratio;
        const double amplitude = options.amplitude * weight / (options.normalize ? sum : 1);
        if (!std::isfinite(frequency) || !std::isfinite(weight) || !std::isfinite(amplitude))
            throw ValueError(fmt::format("octave {} would have frequency {} and amplitude {}; use fewer octaves", k + 1,
                                         frequency, amplitude));
        const double turns = std::pow(options.octaveAlpha, k);
        octaves.octaves.push_back({Noise(octaveOf(noise, ratio, turns)), frequency, amplitude, weight});
    }
    if (options.warp == 0 || options.octaves == 1) return ScalarFieldN<kN>(std::move(octaves));
    Vec<double, kN> period;
    if constexpr (requires { Noise(noise).tilingPeriod(); })
        for (int i = 0; i < kN; ++i)
            period[i] = static_cast<double>(Noise(noise).tilingPeriod()[i]) / options.frequency;
    else if constexpr (requires { noise.period; })
        for (int i = 0; i < kN; ++i) period[i] = noise.period[i] / options.frequency;
    return ScalarFieldN<kN>(WarpedOctaves<Noise>{std::move(octaves), options.warp, period});
}

// NOLINTBEGIN(bugprone-macro-parentheses): the arguments are template arguments
#define CURLEW_INSTANTIATE(...)                                                                         \
    template ScalarFieldN<__VA_ARGS__::kDimension> noiseField<__VA_ARGS__>(const __VA_ARGS__::Options&, \
                                                                           const OctaveOptions&);
#define CURLEW_NOISE(name, Noise, lowest, highest, summary) \
    CURLEW_NOISE_DIMENSIONS(CURLEW_INSTANTIATE, Noise, lowest, highest)
// NOLINTEND(bugprone-macro-parentheses)
CURLEW_NOISES(CURLEW_NOISE)

} // namespace curlew
