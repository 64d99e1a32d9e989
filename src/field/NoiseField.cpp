#include "curlew/field/NoiseField.h"

#include "curlew/base/Error.h"

#include <fmt/format.h>

#include <vector>

namespace curlew {

namespace {

template <class Noise>
struct Octave {
    Noise noise;
    double frequency, amplitude;
    double weight; ///< Of its gradient, where that displaces the octaves after it.
};

template <class Noise>
Range rangeOf(const Noise& noise) {
    if constexpr (requires { noise.range(); })
        return noise.range();
    else
        return Range::within(noise.bound());
}

/// The derivatives of f(s x) with respect to x, given those of f at s x.
template <class T, int N, int Order>
Jet<T, N, Order> dilated(Jet<T, N, Order> f, T s) {
    if constexpr (Order >= 1) f.gradient *= s;
    if constexpr (Order >= 2)
        for (T& h : f.hessian.c) h *= s * s;
    if constexpr (Order >= 3)
        for (T& t : f.third.c) t *= s * s * s;
    return f;
}

/// A rounded |n|.
template <class J>
J folded(const J& n, double fold) {
    using T = std::remove_cvref_t<decltype(n.value)>;
    const auto rounding = static_cast<T>(fold);
    return sqrt(n * n + J(rounding * rounding)) - J(rounding);
}

template <class Noise, int N = Noise::kDimension>
struct Octaves {
    std::vector<Octave<Noise>> octaves;
    double turbulence;

    template <int Order, class T>
    Jet<T, N, Order> at(const Vec<double, N>& p) const {
        Jet<T, N, Order> sum;
        for (const auto& o : octaves) {
            auto n = o.noise.template at<Order, T>(p * o.frequency);
            if (turbulence > 0) n = folded(n, turbulence);
            sum += dilated(n * static_cast<T>(o.amplitude), static_cast<T>(o.frequency));
        }
        return sum;
    }
    Range range() const {
        Range sum{0, 0};
        for (const auto& o : octaves) {
            const Range n = rangeOf(o.noise);
            const double most = std::sqrt(n.bound() * n.bound() + turbulence * turbulence) - turbulence;
            sum = sum + o.amplitude * (turbulence > 0 ? Range{0, most} : n);
        }
        return sum;
    }
};

/// Octaves that are displaced by the gradients of those before them. The derivatives of a displacement are those of a
/// gradient, so every octave is asked for one order more, and all of it is carried through in double.
template <class Noise, int N = Noise::kDimension>
struct WarpedOctaves {
    Octaves<Noise> plain;
    double warp;
    Vec<double, N> period; ///< World units, 0: none.

    template <int Order, class T>
    Jet<T, N, Order> at(const Vec<double, N>& p) const {
        if constexpr (Order >= 3) {
            throw ValueError("a noise with warp cannot displace another field: its third derivatives are not known");
        } else {
            using J = Jet<double, N, Order>;
            J sum;
            Vec<J, N> pull; // the sum of gradients so far
            Vec<double, N> tile = p;
            for (int i = 0; i < N; ++i)
                if (period[i] > 0) tile[i] -= period[i] * std::floor(p[i] / period[i]);
            const auto x = J::variables(tile);
            for (const auto& o : plain.octaves) {
                Vec<J, N> y;
                Vec<double, N> position;
                for (int i = 0; i < N; ++i) {
                    y[i] = x[i] * o.frequency + pull[i] * warp;
                    position[i] = y[i].value;
                }
                const auto n = o.noise.template at<Order + 1, double>(position);
                J octave = compose(truncated<Order>(n), y);
                if (plain.turbulence > 0) octave = folded(octave, plain.turbulence);
                sum += octave * o.amplitude;
                for (int i = 0; i < N; ++i) pull[i] += compose(partial(n, i), y) * o.weight;
            }
            Jet<T, N, Order> rounded;
            for (int k = 0; k < sum.kSize; ++k) rounded.component(k) = static_cast<T>(sum.component(k));
            return rounded;
        }
    }
    Range range() const { return plain.range(); }
};

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
