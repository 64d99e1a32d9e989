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
};

template <class Noise>
struct Octaves {
    std::vector<Octave<Noise>> octaves;

    template <int Order, class T>
    Jet<T, 3, Order> at(const Vec3d& p) const {
        Jet<T, 3, Order> sum;
        for (const auto& o : octaves) {
            auto jet = o.noise.template at<Order, T>(p * o.frequency) * static_cast<T>(o.amplitude);
            const auto frequency = static_cast<T>(o.frequency);
            if constexpr (Order >= 1) jet.gradient *= frequency;
            if constexpr (Order >= 2)
                for (T& h : jet.hessian.c) h *= frequency * frequency;
            sum += jet;
        }
        return sum;
    }
    double bound() const {
        double sum = 0;
        for (const auto& o : octaves) sum += std::abs(o.amplitude) * o.noise.bound();
        return sum;
    }
};

void validate(const OctaveOptions& o) {
    if (!(o.frequency > 0) || !std::isfinite(o.frequency))
        throw ValueError(fmt::format("frequency {} must be positive and finite", o.frequency));
    if (o.octaves < 1 || o.octaves > 32) throw ValueError(fmt::format("{} octaves; give 1 to 32", o.octaves));
    if (!(o.lacunarity > 0) || !std::isfinite(o.lacunarity))
        throw ValueError(fmt::format("lacunarity {} must be positive and finite", o.lacunarity));
    if (!std::isfinite(o.gain) || !std::isfinite(o.amplitude)) throw ValueError("gain and amplitude must be finite");
}

} // namespace

ScalarField psrdField(const PsrdOptions& noise, const OctaveOptions& options) {
    validate(options);
    const bool tiles = noise.period != Vec<int, 3>{};
    if (tiles && options.octaves > 1 && options.lacunarity != std::floor(options.lacunarity))
        throw ValueError(fmt::format("octaves tile only with a whole lacunarity, not {}", options.lacunarity));
    double sum = 0;
    for (int k = 0; k < options.octaves; ++k) sum += std::pow(std::abs(options.gain), k);
    Octaves<Psrd3> field;
    for (int k = 0; k < options.octaves; ++k) {
        const double ratio = std::pow(options.lacunarity, k);
        PsrdOptions octave = noise;
        for (int axis = 0; axis < 3 && tiles; ++axis) {
            const double period = noise.period[axis] * ratio;
            if (period > 0x1p30) throw ValueError("the period of the highest octave is too large; use fewer octaves");
            octave.period[axis] = static_cast<int>(period);
        }
        field.octaves.push_back({Psrd3(octave), options.frequency * ratio,
                                 options.amplitude * std::pow(options.gain, k) / (options.normalize ? sum : 1)});
    }
    return ScalarField(std::move(field));
}

} // namespace curlew
