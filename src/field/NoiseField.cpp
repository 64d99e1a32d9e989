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
    // Further out its square, in float, would not be there.
    if (o.turbulence != 0 && !(o.turbulence >= 1e-9 && o.turbulence <= 1e9))
        throw ValueError(fmt::format("turbulence {} must be 0, or between 1e-9 and 1e9", o.turbulence));
}

/// The options for an octave whose frequency is `ratio` times that of the first.
template <class Options>
Options octaveOf(Options options, double ratio) {
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
        throw ValueError(fmt::format("octaves tile only with a whole lacunarity, not {}", options.lacunarity));
    double sum = 0;
    for (int k = 0; k < options.octaves; ++k) sum += std::pow(std::abs(options.gain), k);
    Octaves<Noise> octaves{{}, options.turbulence};
    for (int k = 0; k < options.octaves; ++k) {
        const double ratio = std::pow(options.lacunarity, k), weight = std::pow(options.gain, k);
        const double frequency = options.frequency * ratio;
        const double amplitude = options.amplitude * weight / (options.normalize ? sum : 1);
        if (!std::isfinite(frequency) || !std::isfinite(weight) || !std::isfinite(amplitude))
            throw ValueError(fmt::format("octave {} has the frequency {} and the amplitude {}; use fewer octaves",
                                         k + 1, frequency, amplitude));
        octaves.octaves.push_back({Noise(octaveOf(noise, ratio)), frequency, amplitude, weight});
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

#define CURLEW_INSTANTIATE(Noise) \
    template ScalarFieldN<Noise::kDimension> noiseField<Noise>(const Noise::Options&, const OctaveOptions&);
CURLEW_INSTANTIATE(Psrd2)
CURLEW_INSTANTIATE(Psrd3)
CURLEW_INSTANTIATE(ValueNoise<1>)
CURLEW_INSTANTIATE(ValueNoise<2>)
CURLEW_INSTANTIATE(ValueNoise<3>)
CURLEW_INSTANTIATE(PerlinNoise<1>)
CURLEW_INSTANTIATE(PerlinNoise<2>)
CURLEW_INSTANTIATE(PerlinNoise<3>)
CURLEW_INSTANTIATE(GradientNoise<2>)
CURLEW_INSTANTIATE(GradientNoise<3>)
CURLEW_INSTANTIATE(SimplexNoise<2>)
CURLEW_INSTANTIATE(SimplexNoise<3>)
CURLEW_INSTANTIATE(SimplexNoise<4>)
CURLEW_INSTANTIATE(SimplexNoise<5>)
CURLEW_INSTANTIATE(SimplexNoise<6>)
CURLEW_INSTANTIATE(SimplexNoise<7>)
CURLEW_INSTANTIATE(SineNoise<1>)
CURLEW_INSTANTIATE(SineNoise<2>)
CURLEW_INSTANTIATE(SineNoise<3>)
CURLEW_INSTANTIATE(SineNoise<4>)
CURLEW_INSTANTIATE(SineNoise<5>)
CURLEW_INSTANTIATE(SineNoise<6>)
CURLEW_INSTANTIATE(SineNoise<7>)
#undef CURLEW_INSTANTIATE

} // namespace curlew
