// SPDX-License-Identifier: Apache-2.0
#include "Actions.h"
#include "curlew/app/registry/Bind.h"
#include "curlew/app/registry/Text.h"
#include "curlew/field/Algebra.h"
#include "curlew/field/NoiseField.h"
#include "curlew/field/Transforms.h"

#include <numbers>

namespace curlew::app {

namespace {

using namespace options;

/// How a noise depends on time.
enum class Animate { automatic, alpha, slice, offset };

/// A type of noise.
struct NoiseType {
    std::string name, summary;
    std::vector<Option> options;
    Animate animate; ///< The default.
    int lowest, highest;
    AnyField (*make)(Context&, const Arguments&);
};

const std::vector<NoiseType>& noiseTypes();

const NoiseType& typeOf(const Arguments& a) { return noiseTypes()[a.choice("type")]; }
int dimension(const Arguments& a) { return a.integer<int>("dimensions"); }

bool has(const std::vector<Option>& options, const std::string& name) {
    return std::any_of(options.begin(), options.end(), [&](const Option& option) { return option.name == name; });
}

/// Throws ValueError if the type of noise does not have the dimension or an option that was given.
void requireOptionsOfType(const Arguments& a) {
    const NoiseType& type = typeOf(a);
    if (dimension(a) < type.lowest || dimension(a) > type.highest)
        throw ValueError(fmt::format("type={} supports {} to {} dimensions, not {}", type.name, type.lowest,
                                     type.highest, dimension(a)));
    std::vector<std::string> names;
    for (const Option& option : type.options) names.push_back(option.name);
    for (const auto& other : noiseTypes())
        for (const Option& option : other.options)
            if (a.given(option.name) && !has(type.options, option.name))
                throw ValueError(
                    fmt::format("type={} has no option '{}'; it has {}", type.name, option.name, join(names, ", ")));
}

/// Binds an option to a member that only some noises' Options have.
template <class Options, class Get>
void bindIfThere(Binding<Options>& own, Option option, const Get& get) {
    if constexpr (requires(Options & o) { get(o); }) own.add(std::move(option), get);
}

/// Returns the options that only some noises have. Add the options of a new noise here.
template <class Options>
Binding<Options> ownOptions() {
    Binding<Options> own;
    bindIfThere(own,
                real("alpha", "", "radians",
                     "psrd: rotation angle of the first octave's gradients (flow noise); a full turn is 6.2832"),
                [](auto& o) -> decltype((o.alpha)) { return o.alpha; });
    bindIfThere(own,
                choice("rotation", {"default", "fast"},
                       "psrd 3D: method by which alpha= rotates the gradients; fast is a different noise"),
                [](auto& o) -> decltype((o.rotation)) { return o.rotation; });
    bindIfThere(
        own,
        formerly(
            {"grid"},
            choice("lattice", {"axis", "perlin"},
                   "psrd 3D: axis tiles with any period but shows its lattice in axis-parallel slices; perlin tiles "
                   "only with multiples of 3 but does not")),
        [](auto& o) -> decltype((o.grid)) { return o.grid; });
    bindIfThere(own,
                choice("gradients", {"catlike", "reference"},
                       "perlin 3D: order of the gradients, as in Catlike Coding's tutorial or in Perlin's reference"),
                [](auto& o) -> decltype((o.gradients)) { return o.gradients; });
    bindIfThere(own, integer("power", "", 3, 4, "simplex: power of the kernel; 3 is C², 4 is C³"),
                [](auto& o) -> decltype((o.power)) { return o.power; });
    bindIfThere(own,
                choice("kernel", {"smooth", "corners", "published", "published-continuous"},
                       "simplex: smooth has no empty regions, corners has some in 6D and 7D; the published kernels are "
                       "Macomber's, with his radius (discontinuous) or with r² = 1/2"),
                [](auto& o) -> decltype((o.kernel)) { return o.kernel; });
    bindIfThere(own, integer("waves", "", 1, SineNoise<3>::kMaxWaves, "sine: number of waves"),
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
    if constexpr (kHasPeriod<Options>) { // for the first N axes
        const auto period = a.coordinates<N>("period");
        for (int axis = 0; axis < N; ++axis) {
            if (period[axis] != std::floor(period[axis]) || std::abs(period[axis]) > 1e6)
                throw ValueError(
                    fmt::format("period={} must be a whole number of cells; 0: not periodic", period[axis]));
            o.period[axis] = static_cast<int>(period[axis]);
        }
    }
    if (Noise::kDimension == 2 && (a.given("rotation") || a.given("lattice")))
        throw ValueError("rotation= and lattice= are only for 3D; in 2D there is only one of each");
    return o;
}

const Binding<OctaveOptions>& octaveBinding() {
    static const auto binding =
        Binding<OctaveOptions>()
            .add(
                positive("frequency", "", "1 / world unit", "cells per world unit in the first octave"),
                [](auto& o) -> auto& { return o.frequency; })
            .add(
                integer("octaves", "", 1, 32, "number of octaves (fBm)"), [](auto& o) -> auto& { return o.octaves; })
            .add(
                positive("lacunarity", "", "", "ratio of each octave's frequency to that of the octave before"),
                [](auto& o) -> auto& { return o.lacunarity; })
            .add(
                real("gain", "", "",
                     "ratio of each octave's amplitude to that of the octave before; for Kolmogorov's spectrum 0.397 "
                     "(-curl) or about 0.37 (-dfvn)"),
                [](auto& o) -> auto& { return o.gain; })
            .add(
                real("amplitude", "", "", "factor by which the noise is multiplied"),
                [](auto& o) -> auto& { return o.amplitude; })
            .add(
                flag("normalize", "", "1: divide by the sum of the octaves' amplitudes"),
                [](auto& o) -> auto& { return o.normalize; })
            .add(
                formerly({"turbulence"},
                         notNegative("billow", "", "",
                                     "above 0: billow noise (turbulence), the sum of |n| over the octaves, with the "
                                     "crease rounded where |n| is below about this value (C²)")),
                [](auto& o) -> auto& { return o.billow; })
            .add(
                real("warp", "", "cells",
                     "domain warp (gradient advection): each octave is displaced by this factor times the gradient "
                     "of the octaves before it"),
                [](auto& o) -> auto& { return o.warp; });
    return binding;
}

OctaveOptions octaveOptions(const Arguments& a) {
    OctaveOptions octaves = octaveBinding().read(a);
    octaves.octaveAlpha = a.real("octaveAlpha"); // declared by the noises that rotate
    return octaves;
}

/// Reports the axes on which the noise tiles with another period than requested.
template <class Noise>
void tellTiling([[maybe_unused]] Context& c, [[maybe_unused]] const typename Noise::Options& options) {
    if constexpr (requires(const Noise& n) { n.tilingPeriod(); }) {
        const auto tiling = Noise(options).tilingPeriod();
        for (int axis = 0; axis < Noise::kDimension; ++axis)
            if (options.period[axis] > 0 && tiling[axis] != options.period[axis])
                c.info(fmt::format("noise: a period of {} along {} tiles only after {}", options.period[axis],
                                   "xyz"[axis], tiling[axis]));
    }
}

/// A slice through a noise of more dimensions: its last coordinates are functions of time, along a straight line or,
/// for a loop, a circle, at one unit per second. The unit is a cell, so time does not scale with the frequency.
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

/// Returns the noise of N dimensions at a time, as a slice of a noise of N + 1 dimensions or, in a loop, N + 2.
template <template <int> class Noise, int N, int Lowest, int Highest>
ScalarFieldN<N> sliced(const Arguments& a, double time) {
    const bool loops = a.given("loop");
    if constexpr (N + 1 <= Highest && N + 1 >= Lowest)
        if (!loops) return sliceAt<N, Noise<N + 1>>(a, time, 0);
    if constexpr (N + 2 <= Highest && N + 2 >= Lowest)
        if (loops) return sliceAt<N, Noise<N + 2>>(a, time, a.real("loop"));
    throw ValueError(fmt::format(
        "animate=slice{} needs {} dimensions, but type={} has at most {}; use another animate=, or type=simplex",
        loops ? " with loop=" : "", N + (loops ? 2 : 1), typeOf(a).name, Highest));
}

/// Returns the offset of the noise along its last axis: one unit per second, or one period per loop.
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
                "loop= with animate=offset needs a period along the last axis; give period=, or use another animate=");
        return period / a.real("frequency") * (time / a.real("loop"));
    }
    return period > 0 ? std::fmod(time, period / a.real("frequency")) : time;
}

/// Returns the rotation of the gradients at `time`. In a loop, they make the whole number of turns that closes it.
double turnedBy(const Arguments& a, double time) {
    if (!a.given("loop")) return time;
    const double ratio = a.real("octaveAlpha");
    if (a.integer("octaves") > 1 && ratio != std::floor(ratio))
        throw ValueError(
            fmt::format("the loop does not close with octaveAlpha={}: the first octave returns to its start, but the "
                        "others do not; use a whole number",
                        ratio));
    return 2 * std::numbers::pi * time / a.real("loop");
}

/// Returns the noise of N dimensions with all its options.
template <template <int> class Noise, int N, int Lowest, int Highest>
AnyField makeInDimension(Context& c, const Arguments& a) {
    auto options = optionsOf<Noise<N>, N>(a);
    tellTiling<Noise<N>>(c, options);
    PlacementN<N> placement{.offset = a.coordinates<N>("translate"), .rotate = a.vector("rotate")};
    if (a.given("loop") && !a.given("time")) throw ValueError("loop= needs time=, the time in the loop in seconds");
    if (!a.given("time")) {
        if (a.given("animate")) throw ValueError("animate= needs time=, in seconds");
        return placed(noiseField<Noise<N>>(options, octaveOptions(a)), placement);
    }
    double time = a.real("time");
    if (a.given("loop"))
        time -= a.real("loop") * std::floor(time / a.real("loop")); // so that the loop closes bit for bit
    auto how = a.choice<Animate>("animate");
    if (how == Animate::automatic) how = typeOf(a).animate;
    switch (how) {
        case Animate::automatic:
        case Animate::alpha:
            if constexpr (requires { options.alpha; })
                options.alpha += turnedBy(a, time);
            else
                throw ValueError(
                    fmt::format("type={} has no rotating gradients; animate=alpha is for psrd", typeOf(a).name));
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
                                  "period of the tiling along each axis, in cells of the first octave; 0: not periodic "
                                  "(value and perlin: 256)"));
    const Binding<Options> bound = ownOptions<Options>();
    own.insert(own.end(), bound.options().begin(), bound.options().end());
    if (has(own, "alpha"))
        own.push_back(
            real("octaveAlpha", fmt::format("{}", OctaveOptions{}.octaveAlpha), "",
                 "psrd: ratio of each octave's rotation to that of the octave before; with loop=, a whole number"));
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
    std::vector<Option> all{typeOption(), formerly({"dim"}, integer("dimensions", "3", 1, 7, "number of dimensions"))};
    const auto& octaves = octaveBinding().options();
    all.insert(all.end(), octaves.begin(), octaves.end());
    const std::vector<Option> others{
        integer("seed", "0", 0, 0x1p53 - 1,
                "random seed; 0 is the published function, the others are independent of it and of each other"),
        formerly({"offset"}, coordinates("translate", "0", "world units", "translation of the noise")),
        vector("rotate", "0,0,0", "degrees", "rotation about x, then y, then z; in 2D about z"),
        real("time", "", "s", "time of an animation of the noise"),
        positive("loop", "", "s", "period after which the animation repeats"),
        choice("animate", {"auto", "alpha", "slice", "offset"},
               "effect of time=: alpha rotates the gradients, those of the first octave by one radian per second (auto "
               "for psrd); slice is an additional coordinate, for a loop two on a circle (auto for simplex and sine); "
               "offset moves the noise along its last axis (auto for the others)")};
    all.insert(all.end(), others.begin(), others.end());
    for (const NoiseType& type : noiseTypes())
        for (const Option& option : type.options)
            if (!has(all, option.name)) all.push_back(option);
    return all;
}

} // namespace

Registry noiseActions() {
    return {
        {.name = "noise",
         .group = "fields",
         .summary =
             "noise with exact derivatives: Perlin, simplex, psrd (flow noise), value, …; fBm, billow, domain warp",
         .makes = {made("field", {Kind::field})},
         .options = noiseOptions(),
         .examples = {"curlew -noise frequency=2 octaves=3 seed=7 -slice box=-2,-2,-2,2,2,2 -write noise.png",
                      "curlew -noise type=simplex dimensions=4 -probe in.csv out.csv",
                      "curlew -noise dimensions=2 period=4 octaves=4 warp=-0.3 time=0.5 loop=2 -slice -write loop.png"},
         .evaluation = Evaluation::anyTime,
         .run = [](Context& c, const Arguments& a) { c.give(FieldValue{makeNoise(c, a)}); },
         .makesWith =
             [](const Arguments& a, const auto&, const World&) {
                 return std::vector{Object{.kind = Kind::noise, .dimension = dimension(a), .name = "field"}};
             }}};
}

} // namespace curlew::app
