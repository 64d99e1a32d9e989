// SPDX-License-Identifier: Apache-2.0
#include "curlew/shader/FlowShader.h"

#include "StepText.h"
#include "Syntax.h"
#include "curlew/base/Require.h"
#include "curlew/field/Dimensions.h"
#include "curlew/track/StepRule.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace curlew {

namespace {

using S = Symbol<float>;
using Symbols = SymbolModule::Symbols;

/// Records f(arguments…), whose parameters have the types A. It returns a tuple or any one thing that can be appended.
template <class... A, class F>
size_t recordFunction(SymbolModule& module, const char* name, const F& f) {
    std::tuple<A...> arguments;
    Symbols sample;
    std::apply([&](const auto&... each) { (detail::append(sample, each), ...); }, arguments);
    std::vector<SymbolType> types;
    for (const AnySymbol& a : sample) types.push_back(a.type);
    return module.record(name, types, [&](const Symbols& parameters) {
        const AnySymbol* next = parameters.data();
        std::apply([&](auto&... each) { (detail::take(next, each), ...); }, arguments);
        return std::apply(f, arguments);
    });
}

template <class... R>
Symbols listOf(const R&... results) {
    Symbols list;
    (detail::append(list, results), ...);
    return list;
}

/// Records the functions of a flow.
template <int N>
class Recorder {
  public:
    static constexpr size_t kM{N - 1};
    using Position = Vec<S, N>; // relative to the origin
    using Track = Vec<S, N - 1>;
    using Between = Vec<S, 3>; ///< The distances at a quarter, a half and three quarters of a step.

    Recorder(const FlowN<N>& flow, const FlowShaderOptions& options, const Monitor& monitor)
        : mFlow(flow), mOptions(options) {
        if (flow.hasTracks()) {
            const auto rms = rmsOf(flow, monitor);
            for (size_t k = 0; k < kM; ++k) {
                mRms[k] = rms.potentials[k];
                if (!(mRms[k] > 0)) throw ValueError("a potential of the flow is zero everywhere in its box");
            }
        }
        for (int i = 0; i < N; ++i) {
            const double given = options.origin ? (*options.origin)[i] : flow.domain().box.center()[i];
            mOrigin[i] = std::isfinite(given) ? static_cast<double>(static_cast<float>(given)) : 0;
        }
        mHere =
            recordFunction<Position>(mModule, "here", [&](const Position& p) { return resultsOf(recordedHere(p)); });
    }

    /// The parts of a step.
    std::vector<ShaderEntry> entries() {
        using Gradients = Vec<Vec<S, N>, N - 1>;
        using D = Jet<S, N, 1>;
        const ShaderEntry::Parameter p{"p", N}, q{"q", N}, off{"off", kM};
        const bool wall = mFlow.domain().wall.has_value(), tracks = mFlow.hasTracks();
        std::vector<ShaderEntry> all{{mHere, "flowHere", "The potentials, their gradients and the velocity.", {p}}};
        if (wall) {
            all.push_back(
                {recordFunction<Position>(mModule, "wall", [&](const Position& x) { return listOf(distance(x)); }),
                 "flowWall",
                 "The distance from the wall and its gradient.",
                 {p}});
            // One function, because a bounded flow computes the distance, too.
            if (mOptions.parts)
                all.push_back({recordFunction<Position>(mModule, "all",
                                                        [&](const Position& x) {
                                                            Symbols results = resultsOf(recordedHere(x));
                                                            detail::append(results, distance(x));
                                                            return results;
                                                        }),
                               "flowHereAndWall",
                               "What flowHere() and flowWall() return.",
                               {p}});
        }
        if (tracks) {
            ShaderEntry entry{
                recordFunction<Position, Track, Gradients, S>(
                    mModule, "correction",
                    [&](const Position& x, const Track& o, const Gradients& g, const S& limit) {
                        return listOf(corrected(x, o, g.c, limit));
                    }),
                "flowCorrected",
                "p after a correction onto its track, not longer than the limit. off: track - potentials.",
                {p, off}};
            for (size_t k = 0; k < kM; ++k) entry.parameters.push_back({fmt::format("gradient{}", k), N});
            entry.parameters.push_back({"limit", 1});
            all.push_back(std::move(entry));
        }
        all.push_back(
            {recordFunction<Position, Position, Track, D, Between, D>(
                 mModule, "accepts",
                 [&](const Position& from, const Position& to, const Track& o, const D& before, const Between& between,
                     const D& after) {
                     Symbol<bool> accepted = isFinite(to);
                     if (tracks) accepted = accepted & isOnTrack(o);
                     if (wall) accepted = accepted & staysClear(from, to, before, between, after);
                     return listOf(select(accepted, S(1), S(0)));
                 }),
             "flowAccepts",
             "1 if the step from p to q is accepted, else 0. off: track - potentials at q; then the wall at p,\n"
             "the distances at 1/4, 1/2 and 3/4 of the way, and the wall at q.",
             {p, q, off, {"before", N + 1}, {"between", 3}, {"after", N + 1}}});
        return all;
    }

    const SymbolModule& module() const { return mModule; }
    const Vec<double, N>& origin() const { return mOrigin; }

  private:
    /// The flow at a position.
    struct Here {
        Track potentials; ///< Of the first term.
        std::array<Vec<S, N>, kM> gradients;
        Vec<S, N> velocity;
    };

    Vec<Symbol<double>, N> place(const Position& p) const {
        Vec<Symbol<double>, N> x;
        for (int i = 0; i < N; ++i) x[i] = convertTo<Symbol<double>>(p[i]) + Symbol<double>(mOrigin[i]);
        return x;
    }

    static Symbols resultsOf(const Here& here) {
        Symbols results = listOf(here.potentials);
        for (const auto& gradient : here.gradients) detail::append(results, gradient);
        detail::append(results, here.velocity);
        return results;
    }

    Here recordedHere(const Position& p) {
        const auto x = place(p);
        Here here;
        for (size_t t = 0; t < mFlow.terms().size(); ++t) {
            std::array<Vec<S, N>, kM> gradients;
            for (size_t k = 0; k < kM; ++k) {
                const auto jet = mFlow.terms()[t][k].template symbols<1>(mModule, x);
                gradients[k] = jet.gradient;
                if (t == 0) here.potentials.c[k] = jet.value;
            }
            if (t == 0) here.gradients = gradients;
            here.velocity += cross(gradients);
        }
        for (const auto& components : mFlow.components())
            for (size_t i = 0; i < size_t{N}; ++i)
                here.velocity.c[i] += components[i].template symbols<1>(mModule, x).value;
        const auto divideBy = [&](const Vec<S, N>& v, double factor) {
            const S squared = dot(v, v);
            here.velocity *= select(squared > S(0), S(factor) / sqrt(squared), S(0));
        };
        if (mFlow.uniformSpeed() > 0) divideBy(Vec<S, N>(here.velocity), mFlow.uniformSpeed());
        if (mFlow.preservesArea()) divideBy(here.gradients.back(), 1);
        return here;
    }
    Jet<S, N, 1> distance(const Position& p) {
        return mFlow.domain().wall->sdf.distance.template symbols<1>(mModule, place(p));
    }

    /// Returns p if q is not finite.
    static Position finiteOr(const Position& q, const Position& p) {
        const Symbol<bool> finite = isFinite(q);
        Position r;
        for (int i = 0; i < N; ++i) r[i] = select(finite, q[i], p[i]);
        return r;
    }
    static Symbol<bool> isFinite(const Position& q) {
        Symbol<bool> finite(true);
        for (int i = 0; i < N; ++i) finite = finite & (abs(q[i]) < S(1e30)); // false for NaN
        return finite;
    }

    /// A Gauss-Newton correction of p, where the potentials miss those of the track by `off`.
    Position corrected(const Position& p, const Track& off, const std::array<Vec<S, N>, kM>& gradients,
                       const S& limit) {
        return finiteOr(gaussNewtonMoved(p, gradients, off.c, mRms, limit), p);
    }

    Symbol<bool> isOnTrack(const Track& off) const {
        Symbol<bool> is(true);
        for (size_t k = 0; k < kM; ++k) is = is & (abs(off.c[k]) <= S(mOptions.tolerance * mRms[k]));
        return is;
    }

    static S beyond(Side side, const S& distance) {
        return side == Side::inside ? distance : side == Side::outside ? -distance : -abs(distance);
    }

    /// The conditions of track/StepGuard.h. A step between two sides of a thin part of the wall is rejected without a
    /// search for the wall between them.
    Symbol<bool> staysClear(const Position& p, const Position& q, const Jet<S, N, 1>& before, const Between& between,
                            const Jet<S, N, 1>& after) const {
        const WallN<N>& wall = *mFlow.domain().wall;
        const Symbol<bool> within = before.value < S(0);
        S size(0);
        for (int i = 0; i < N; ++i) size += abs(q[i]) + S(std::abs(mOrigin[i]));
        Symbol<bool> clear = beyond(wall.side, after.value) < size * S(-kPositionRounding);
        clear = clear & ((within & (after.value < S(0))) | (!within & !(after.value < S(0))));
        const S chord = length(q - p);
        Symbol<bool> passes = chord <= S(wall.width);
        for (const S& d : between.c) {
            const S off = wall.side == Side::both ? select(within, d, -d) : beyond(wall.side, d);
            passes = passes & (off <= chord * S(1.0 / 16));
        }
        clear = clear & ((abs(before.value) > chord) | passes);
        const Symbol<bool> near = abs(before.value) + abs(after.value) <= chord * S(wall.sdf.lipschitz);
        return clear & !(near & (dot(before.gradient, after.gradient) < S(0)));
    }

    FlowN<N> mFlow;
    FlowShaderOptions mOptions;
    SymbolModule mModule;
    Vec<double, N> mOrigin;
    std::array<double, kM> mRms{};
    size_t mHere = 0;
};

/// What a dialect is, where its text goes, and how it is given the arrays of the data file.
struct About {
    std::string_view language, place, arrays;
};

About aboutOf(Dialect dialect) {
    switch (dialect) {
        case Dialect::glsl:
            return {
                "GLSL 4.50, for OpenGL and Vulkan", "Include it in a shader, after the #version line.",
                "Bind them as storage buffers, in this order, from FLOW_BINDING on; in Vulkan in the set FLOW_SET."};
        case Dialect::glslEs:
            return {"GLSL ES 3.00 (WebGL 2)",
                    "Include it in a shader, after the #version line and `precision highp float;`.",
                    "Put each into a texture of width 2048 (uint: R32UI, float: R32F, vec4: RGBA32F), row by row."};
        case Dialect::hlsl:
            return {"HLSL, shader model 5 or later", "Include it in a shader.",
                    "Each is a StructuredBuffer (of uint, float or float4); for Vulkan define VULKAN, the first "
                    "FLOW_BINDING and FLOW_SET."};
        case Dialect::wgsl:
            break;
    }
    return {"WGSL (WebGPU)", "Put it before the text of a shader.",
            "Each is a storage buffer with its group and binding below."};
}

/// The first lines of the text.
template <int N>
std::string header(const FlowN<N>& flow, const FlowShaderOptions& options, const Vec<double, N>& origin,
                   const ShaderText& shader) {
    const About about = aboutOf(options.dialect);
    std::string text = fmt::format("// A flow, written by Curlew.\n// {}. {}\n//\n", about.language, about.place);
    text += fmt::format(
        "// p is a position relative to ({:.9g}), world units. Velocities are in world units per second, times in\n"
        "// seconds. At the same p, values agree with Curlew's to a few millionths of their root mean square, "
        "velocities\n"
        "// to a few hundred-thousandths (docs/shaders.md).\n",
        fmt::join(origin.c, ", "));
    if (flow.hasTracks())
        text += fmt::format(
            "// To move a particle that starts at p: store track = flowPotentials(p), {}, then each frame\n"
            "// p = flowAdvance(p, track, dt).\n",
            N == 3 ? "two floats" : "a float");
    else
        text += "// The flow is a sum, so it has no tracks. To move a particle: p = flowAdvance(p, dt).\n";
    if (shader.buffers.empty()) return text;
    text += fmt::format("//\n// The data of level sets and tables are in {} (little-endian):\n", options.dataFile);
    size_t begin = 0;
    for (const SymbolBuffer& buffer : shader.buffers) {
        text += fmt::format("//   {}: {} {}, from byte {}\n", buffer.name, buffer.data->size() / buffer.width,
                            elementOf(buffer), begin);
        begin += 4 * buffer.data->size();
    }
    return text + fmt::format("// {}\n", about.arrays);
}

} // namespace

template <int N>
ShaderText flowShader(const FlowN<N>& flow, const FlowShaderOptions& options, const Monitor& monitor) {
    if constexpr (N > 3) {
        throw ValueError(fmt::format("a flow with {} dimensions cannot be written as a shader; use -lift", N));
    } else {
        requirePositive(options.tolerance, "tolerance");
        if (options.corrections < 1 || options.corrections > 10)
            throw ValueError(fmt::format("{} corrections; give 1 to 10", options.corrections));
        Recorder<N> recorder(flow, options, monitor);
        const auto entries = recorder.entries();
        ShaderText shader = shaderText(recorder.module(), entries, options.dialect, options.tables, options.bindings,
                                       options.coordinates);
        if (options.parts) return shader;
        shader.text = header(flow, options, recorder.origin(), shader) + "\n" + shader.text + stepText(flow, options);
        return shader;
    }
}

#define CURLEW_INSTANTIATE(N) template ShaderText flowShader(const FlowN<N>&, const FlowShaderOptions&, const Monitor&);
CURLEW_FOR_FLOW_DIMENSIONS(CURLEW_INSTANTIATE)
#undef CURLEW_INSTANTIATE

} // namespace curlew
