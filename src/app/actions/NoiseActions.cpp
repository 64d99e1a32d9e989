// SPDX-License-Identifier: Apache-2.0
#include "Actions.h"
#include "curlew/app/registry/Bind.h"
#include "curlew/app/registry/Text.h"
#include "curlew/field/Algebra.h"
#include "curlew/field/Map.h"
#include "curlew/field/NoiseField.h"

#include <numbers>

namespace curlew::app {

namespace {

using namespace options;

/// How time enters a noise.
enum class Animate { automatic, alpha, slice, offset };

/// A type of noise: its name, its dimensions, the options that only some types have, and its maker.
struct NoiseType {
    std::string name, summary;
    std::vector<Option> options;
    Animate animate; ///< The default.
    int lowest, highest;
    AnyField (*make)(Context&, const Arguments&);
};

const std::vector<NoiseType>& noiseTypes();

const NoiseType& typeOf(const Arguments& a) { return noiseTypes()[a.choice("type")]; }
int dimension(const Arguments& a) { return a.integer<int>("dim"); }

bool has(const std::vector<Option>& options, const std::string& name) {
    return std::any_of(options.begin(), options.end(), [&](const Option& option) { return option.name == name; });
}

/// Refuses options that the type of noise does not have.
void requireOptionsOfType(const Arguments& a) {
    const NoiseType& type = typeOf(a);
    if (dimension(a) < type.lowest || dimension(a) > type.highest)
        throw ValueError(
            fmt::format("type={} has {} to {} dimensions, not {}", type.name, type.lowest, type.highest, dimension(a)));
    std::vector<std::string> names;
    for (const Option& option : type.options) names.push_back(option.name);
    for (const auto& other : noiseTypes())
        for (const Option& option : other.options)
            if (a.given(option.name) && !has(type.options, option.name))
                throw ValueError(
                    fmt::format("type={} has no option '{}'; it has {}", type.name, option.name, join(names, ", ")));
}

/// Binds an option to a member that only the Options of some noises have.
template <class Options, class Get>
void bindIfThere(Binding<Options>& own, Option option, const Get& get) {
    if constexpr (requires(Options & o) { get(o); }) own.add(std::move(option), get);
}

/// The options that only some noises have. An option of a new noise is added here.
template <class Options>
Binding<Options> ownOptions() {
    Binding<Options> own;
    bindIfThere(own,
                real("alpha", "", "radians",
                     "psrd: rotation of the first octave's gradients (flow noise); a full turn is 6.2832"),
                [](auto& o) -> decltype((o.alpha)) { return o.alpha; });
    bindIfThere(own, choice("rotation", {"default", "fast"}, "psrd 3D: how alpha turns them; fast is another noise"),
                [](auto& o) -> decltype((o.rotation)) { return o.rotation; });
    bindIfThere(own,
                choice("grid", {"axis", "perlin"},
                       "psrd 3D: axis tiles with any period, and shows its grid in axis-parallel slices; perlin tiles "
                       "with multiples of 3, and does not"),
                [](auto& o) -> decltype((o.grid)) { return o.grid; });
    bindIfThere(
        own, choice("gradients", {"catlike", "reference"}, "perlin 3D: the tutorial's order of gradients, or Perlin's"),
        [](auto& o) -> decltype((o.gradients)) { return o.gradients; });
    bindIfThere(own, integer("power", "", 3, 4, "simplex: of the kernel; 3 is C², 4 is C³"),
                [](auto& o) -> decltype((o.power)) { return o.power; });
    bindIfThere(own,
                choice("kernel", {"smooth", "corners", "published", "published-continuous"},
                       "simplex: smooth has no empty regions, corners has some in 6D and 7D; the published ones are "
                       "Macomber's, with his radius (which jumps) or with r² = 1/2"),
                [](auto& o) -> decltype((o.kernel)) { return o.kernel; });
    bindIfThere(own, integer("waves", "", 1, SineNoise<3>::kMostWaves, "sine: how many"),
                [](auto& o) -> decltype((o.waves)) { return o.waves; });
    return own;
}

template <class Options>
constexpr bool kHasPeriod = requires(Options o) {
    o.period;
};

template <class Noise, int N>
typename Noise::Options optionsOf(const Arguments& a) {
    using Options = typename Noise::Options;
    static const Binding<Options> own = ownOptions<Options>();
    Options o = own.read(a);
    o.seed = a.integer<uint64_t>("seed");
    if constexpr (kHasPeriod<Options>) { // of the first N axes
        const auto period = a.coordinates<N>("period");
        for (int axis = 0; axis < N; ++axis) {
            if (period[axis] != std::floor(period[axis]) || std::abs(period[axis]) > 1e6)
                throw ValueError(fmt::format("period={} must be whole numbers of cells, 0 for none", period[axis]));
            o.period[axis] = static_cast<int>(period[axis]);
        }
    }
    if (Noise::kDimension == 2 && (a.given("rotation") || a.given("grid")))
        throw ValueError("rotation and grid are choices in 3D; in 2D there is only one of each");
    return o;
}

OctaveOptions octaveOptions(const Arguments& a) {
    return {.frequency = a.real("frequency"),
            .octaves = a.integer<int>("octaves"),
            .lacunarity = a.real("lacunarity"),
            .gain = a.real("gain"),
            .amplitude = a.real("amplitude"),
            .normalize = a.flag("normalize"),
            .turbulence = a.real("turbulence"),
            .warp = a.real("warp"),
            .octaveAlpha = a.real("octaveAlpha")};
}

/// Says where the noise tiles with another period than was asked for.
template <class Noise>
void tellTiling([[maybe_unused]] Context& c, [[maybe_unused]] const typename Noise::Options& options) {
    if constexpr (requires(const Noise& n) { n.tilingPeriod(); }) {
        const auto tiling = Noise(options).tilingPeriod();
        for (int axis = 0; axis < Noise::kDimension; ++axis)
            if (options.period[axis] > 0 && tiling[axis] != options.period[axis])
                c.say(fmt::format("noise: a period of {} along {} tiles only after {}", options.period[axis],
                                  "xyz"[axis], tiling[axis]));
    }
}

/// The last coordinates of a noise of more dimensions, as functions of time: a straight line, or for a loop a circle,
/// passed at one unit a second. In cells, so time is not scaled with the frequency.
template <int N, class Noise>
ScalarFieldN<N> sliceAt(const Arguments& a, double time, double loop) {
    constexpr int kExtra = Noise::kDimension - N;
    const OctaveOptions octaves = octaveOptions(a);
    const auto field = noiseField<Noise>(optionsOf<Noise, N>(a), octaves);
    const auto constant = [&](double cells) { return constantField<N>(cells / octaves.frequency); };
    if constexpr (kExtra == 1) {
        return lifted<N>(field, {constant(time)});
    } else {
        const double radius = loop / (2 * std::numbers::pi), angle = time / radius;
        return lifted<N>(field, {constant(radius * std::cos(angle)), constant(radius * std::sin(angle))});
    }
}

/// The noise of N dimensions at a time, where that is one of N + 1 or N + 2.
template <template <int> class Noise, int N, int Lowest, int Highest>
ScalarFieldN<N> sliced(const Arguments& a, double time) {
    const bool loops = a.given("loop");
    if constexpr (N + 1 <= Highest && N + 1 >= Lowest)
        if (!loops) return sliceAt<N, Noise<N + 1>>(a, time, 0);
    if constexpr (N + 2 <= Highest && N + 2 >= Lowest)
        if (loops) return sliceAt<N, Noise<N + 2>>(a, time, a.real("loop"));
    throw ValueError(
        fmt::format("time as a slice{} needs {} dimensions, and type={} has {} at most; choose another "
                    "animate=, or type=simplex",
                    loops ? " that loops" : "", N + (loops ? 2 : 1), typeOf(a).name, Highest));
}

/// The noise, moved along its last axis by one unit a second, or in a loop by one period.
template <class Noise>
double movedBy(const Arguments& a, const typename Noise::Options& options, double time) {
    double period = 0; // cells
    if constexpr (requires { options.period; }) {
        period = options.period[Noise::kDimension - 1];
        if constexpr (requires(const Noise& n) { n.tilingPeriod(); })
            period = static_cast<double>(Noise(options).tilingPeriod()[Noise::kDimension - 1]);
        if constexpr (requires { Noise::kOwnPeriod; })
            if (period == 0) period = Noise::kOwnPeriod;
    }
    if (a.given("loop")) {
        if (!(period > 0))
            throw ValueError(
                "a loop by an offset needs a period along the last axis; give period=, or another animate=");
        return period / a.real("frequency") * (time / a.real("loop"));
    }
    return period > 0 ? std::fmod(time, period / a.real("frequency")) : time;
}

/// How far the gradients have turned by `time`; in a loop, by its end, the whole number of turns that closes it.
double turnedBy(const Arguments& a, double time) {
    if (!a.given("loop")) return time;
    const double ratio = a.real("octaveAlpha");
    if (a.integer("octaves") > 1 && ratio != std::floor(ratio))
        throw ValueError(fmt::format(
            "a loop does not close with octaveAlpha={}: when the first octave is back, the others are not; give a "
            "whole number",
            ratio));
    return 2 * std::numbers::pi * time / a.real("loop");
}

/// The noise of N dimensions with all its options.
template <template <int> class Noise, int N, int Lowest, int Highest>
AnyField makeInDimension(Context& c, const Arguments& a) {
    auto options = optionsOf<Noise<N>, N>(a);
    tellTiling<Noise<N>>(c, options);
    PlacementN<N> placement{.offset = a.coordinates<N>("offset"), .rotate = a.vector("rotate")};
    if (a.given("loop") && !a.given("time")) throw ValueError("loop= needs time=, the place in the loop in seconds");
    if (!a.given("time")) {
        if (a.given("animate")) throw ValueError("animate= needs time=, in seconds");
        return placed(noiseField<Noise<N>>(options, octaveOptions(a)), placement);
    }
    double time = a.real("time");
    if (a.given("loop")) time -= a.real("loop") * std::floor(time / a.real("loop")); // so that it closes to the bit
    auto how = a.choice<Animate>("animate");
    if (how == Animate::automatic) how = typeOf(a).animate;
    switch (how) {
        case Animate::automatic:
        case Animate::alpha:
            if constexpr (requires { options.alpha; })
                options.alpha += turnedBy(a, time);
            else
                throw ValueError(
                    fmt::format("type={} has no gradients that turn; animate=alpha is for psrd", typeOf(a).name));
            break;
        case Animate::slice:
            return placed(sliced<Noise, N, Lowest, Highest>(a, time), placement);
        case Animate::offset:
            placement.offset[N - 1] -= movedBy<Noise<N>>(a, options, time);
            break;
    }
    return placed(noiseField<Noise<N>>(options, octaveOptions(a)), placement);
}

template <template <int> class Noise, int Lowest, int Highest, int N = Lowest>
AnyField make(Context& c, const Arguments& a) {
    if constexpr (N < Highest)
        if (dimension(a) != N) return make<Noise, Lowest, Highest, N + 1>(c, a);
    return makeInDimension<Noise, N, Lowest, Highest>(c, a);
}

template <template <int> class Noise, int Lowest, int Highest>
NoiseType noiseType(std::string name, std::string summary) {
    using Options = typename Noise<Highest>::Options;
    std::vector<Option> own;
    if constexpr (kHasPeriod<Options>)
        own.push_back(coordinates("period", "0", "cells",
                                  "tile after so many cells of the first octave along each axis; 0: never (value and "
                                  "perlin: 256)"));
    const Binding<Options> bound = ownOptions<Options>();
    own.insert(own.end(), bound.options().begin(), bound.options().end());
    if (has(own, "alpha"))
        own.push_back(
            real("octaveAlpha", fmt::format("{}", OctaveOptions{}.octaveAlpha), "",
                 "psrd: each octave's rotation over that of the one before; in a loop it must be a whole number"));
    const Animate animate = has(own, "alpha") ? Animate::alpha : Highest > 3 ? Animate::slice : Animate::offset;
    return {std::move(name),
            std::move(summary),
            std::move(own),
            animate,
            Lowest,
            Highest,
            [](Context& c, const Arguments& a) { return make<Noise, Lowest, Highest>(c, a); }};
}

const std::vector<NoiseType>& noiseTypes() {
#define CURLEW_NOISE(name, Noise, lowest, highest, summary) noiseType<Noise, lowest, highest>(name, summary),
    static const std::vector<NoiseType> types{CURLEW_NOISES(CURLEW_NOISE)};
#undef CURLEW_NOISE
    return types;
}

AnyField makeNoise(Context& c, const Arguments& a) {
    requireOptionsOfType(a);
    return typeOf(a).make(c, a);
}

Option typeOption() {
    std::vector<std::string> names;
    std::string help;
    for (const auto& type : noiseTypes()) {
        names.push_back(type.name);
        help += fmt::format("{}{} ({}D to {}D): {}", help.empty() ? "" : "; ", type.name, type.lowest, type.highest,
                            type.summary);
    }
    return choice("type", names, help);
}

std::vector<Option> noiseOptions() {
    std::vector<Option> all{
        typeOption(),
        integer("dim", "3", 1, 7, "its dimensions"),
        positive("frequency", "1", "1 / world unit", "cells per world unit of the first octave"),
        integer("octaves", "1", 1, 32, "copies at rising frequency that are summed"),
        positive("lacunarity", "2", "", "each octave's frequency over the one before"),
        real("gain", "0.5", "",
             "each octave's amplitude over the one before; for Kolmogorov's spectrum 0.397 (-curl) or about 0.37 "
             "(-dfvn)"),
        integer("seed", "0", 0, 0x1p53 - 1,
                "0 is the published function; others are independent of it and of each other"),
        coordinates("offset", "0", "world units", "where the origin of the noise goes"),
        vector("rotate", "0,0,0", "degrees", "turn about x, then y, then z; in 2D about z"),
        real("amplitude", "1", "", "factor on the whole"),
        flag("normalize", "1", "divide by the sum of the octaves' amplitudes"),
        notNegative("turbulence", "0", "",
                    "above 0: sum |n| of each octave, its crease rounded where |n| is below about this value, so that "
                    "it stays C²"),
        real("warp", "0", "cells",
             "gradient advection: displace each octave by so much times the gradient of the octaves before it"),
        real("time", "", "s", "a moment of an animation of the noise"),
        positive("loop", "", "s", "the animation is back where it began after this time"),
        choice("animate", {"auto", "alpha", "slice", "offset"},
               "time turns the gradients, those of the first octave by a radian a second (alpha; psrd's default); or "
               "is one more coordinate (slice; simplex and sine), for a loop two on a circle; or moves the noise along "
               "its last axis (offset; the others)")};
    for (const NoiseType& type : noiseTypes())
        for (const Option& option : type.options)
            if (!has(all, option.name)) all.push_back(option);
    return all;
}

} // namespace

Registry noiseActions() {
    return {{.name = "noise",
             .group = "fields",
             .summary = "a noise with exact derivatives",
             .makes = {made("field", {Kind::field})},
             .options = noiseOptions(),
             .examples = {"curlew -noise frequency=2 octaves=3 seed=7 -slice box=-2,-2,-2,2,2,2 -write noise.png",
                          "curlew -noise type=simplex dim=4 -probe in.csv out.csv",
                          "curlew -noise dim=2 period=4 octaves=4 warp=-0.3 time=0.5 loop=2 -slice -write loop.png"},
             .evaluation = Evaluation::anyTime,
             .run = [](Context& c, const Arguments& a) { c.give(FieldValue{makeNoise(c, a)}); },
             .makesWith =
                 [](const Arguments& a, const auto&, const World&) {
                     return std::vector{Object{.kind = Kind::noise, .dimension = dimension(a), .name = "field"}};
                 }}};
}

} // namespace curlew::app
