// SPDX-License-Identifier: Apache-2.0
#include "StepText.h"

#include "Translation.h"
#include "curlew/field/Dimensions.h"
#include "curlew/shader/StageText.h"

#include <fmt/format.h>

namespace curlew {

namespace {

/// The types of GLSL for N dimensions, and the members of what flowHere() returns.
template <int N>
struct Types;
template <>
struct Types<2> {
    static constexpr std::string_view kPlace = "vec2", kTrack = "float", kWall = "vec3", kResult = "vec3",
                                      kHere = "FlowReals5";
    static constexpr std::string_view kPotentials = "here.r0", kGradients = "vec2(here.r1, here.r2)",
                                      kVelocity = "vec2(here.r3, here.r4)";
    static constexpr std::string_view kNoTrack = "0.0", kNoWall = "vec3(0.0, 0.0, 0.0)", kMembers = "xy", kFlag = "z";
};
template <>
struct Types<3> {
    static constexpr std::string_view kPlace = "vec3", kTrack = "vec2", kWall = "vec4", kResult = "vec4",
                                      kHere = "FlowReals11";
    static constexpr std::string_view kPotentials = "vec2(here.r0, here.r1)",
                                      kGradients = "vec3(here.r2, here.r3, here.r4), vec3(here.r5, here.r6, here.r7)",
                                      kVelocity = "vec3(here.r8, here.r9, here.r10)";
    static constexpr std::string_view kNoTrack = "vec2(0.0, 0.0)", kNoWall = "vec4(0.0, 0.0, 0.0, 0.0)",
                                      kMembers = "xyz", kFlag = "w";
};

/// Returns "x * " as text in any dialect; nothing if x is 1.
std::string times(double x) {
    if (x == 1) return "";
    std::string number = fmt::format("{:.9g}", x);
    if (number.find_first_of(".e") == std::string::npos) number += ".0";
    return number + " * ";
}

template <int N>
std::string valueFunctions(bool tracks, bool wall) {
    using T = Types<N>;
    std::string text = fmt::format(R"(
// The velocity, world units per second.
{0} flowVelocity({0} p) {{
    {1} here = flowHere(p);
    return {2};
}}
)",
                                   T::kPlace, T::kHere, T::kVelocity);
    if (wall)
        text += fmt::format(R"(
// The distance from the wall, world units; negative inside the shape.
float flowDistance({} p) {{
    return flowWall(p).x;
}}
)",
                            T::kPlace);
    if (tracks)
        text += fmt::format(R"(
// {4}
{1} flowPotentials({0} p) {{
    {2} here = flowHere(p);
    return {3};
}}
)",
                            T::kPlace, T::kTrack, T::kHere, T::kPotentials,
                            N == 2 ? "The potential. It is constant along each track."
                                   : "The potentials f and g. Both are constant along each track.");
    return text;
}

template <int N>
std::string reprojectFunction(int corrections) {
    using T = Types<N>;
    return fmt::format(R"(
// Moves p back onto the track that has these potentials, by corrections not longer than the limit each.
{0} flowReproject({0} p, {1} track, float limit) {{
    {0} x = p;
    for (int k = 0; k < {5}; ++k) {{
        {2} here = flowHere(x);
        x = flowCorrected(x, track - {3}, {4}, limit);
    }}
    return x;
}}
)",
                       T::kPlace, T::kTrack, T::kHere, T::kPotentials, T::kGradients, corrections);
}

/// The evaluation k of a step of `stages` evaluations: what follows from the flow at x.
std::string stages(const Tableau& tableau) {
    std::string text;
    for (int s = 1; s <= tableau.stages; ++s) {
        const Tableau::Row& row = tableau.rows[static_cast<size_t>(s)];
        text += fmt::format(
            "{0} (k == {1}) {{\n            k{1} = velocity;\n"
            "            x = p + ({2}dt) * ({3});\n",
            s == 1 ? "        if" : " else if", s - 1, times(row.factor), stageText(row.weights, s));
        if (s == tableau.stages) text += "            limit = length(x - p);\n";
        text += "        }";
    }
    return text;
}

template <int N>
std::string stepFunctions(bool tracks, bool wall, Scheme scheme, int corrections) {
    using T = Types<N>;
    const Tableau& tableau = tableauOf(scheme);
    // The evaluation after the last correction is that of the residuals.
    const int evaluations = tableau.stages + (tracks ? corrections + 1 : 0);
    const std::string parameter = tracks ? fmt::format("{} track, ", T::kTrack) : "";
    std::string text =
        tracks ? "\n// A step of dt seconds along the track, and 1; or p, and 0 if the step would leave the track or "
                 "not stay\n"
                 "// clear of the wall.\n"
               : "\n// A step of dt seconds, and 1; or p, and 0 if the step would not stay clear of the wall.\n";
    text += fmt::format("{} flowTry({} p, {}float dt) {{\n    {} x = p;\n    float limit = 0.0;\n    {} off = {};\n",
                        T::kResult, T::kPlace, parameter, T::kPlace, T::kTrack, T::kNoTrack);
    for (int s = 0; s < tableau.stages; ++s) text += fmt::format("    {} k{} = p;\n", T::kPlace, s);
    text +=
        fmt::format("    for (int k = 0; k < {}; ++k) {{\n        {} here = flowHere(x);\n        {} velocity = {};\n",
                    evaluations, T::kHere, T::kPlace, T::kVelocity);
    if (tracks) text += fmt::format("        off = track - {};\n", T::kPotentials);
    text += stages(tableau);
    if (tracks)
        text += fmt::format(" else if (k < {}) {{\n            x = flowCorrected(x, off, {}, limit);\n        }}",
                            evaluations - 1, T::kGradients);
    text +=
        fmt::format("\n    }}\n    {0} before = {1};\n    {0} after = {1};\n    vec3 between = vec3(0.0, 0.0, 0.0);\n",
                    T::kWall, T::kNoWall);
    if (wall)
        text += fmt::format(R"(    for (int k = 0; k < 5; ++k) {{
        {0} place = p + (0.25 * float(k)) * (x - p);
        if (k == 4) {{
            place = x;
        }}
        {1} here = flowWall(place);
        if (k == 0) {{
            before = here;
        }} else if (k == 1) {{
            between.x = here.x;
        }} else if (k == 2) {{
            between.y = here.x;
        }} else if (k == 3) {{
            between.z = here.x;
        }} else {{
            after = here;
        }}
    }}
)",
                            T::kPlace, T::kWall);
    return text + fmt::format(R"(    float accepted = flowAccepts(p, x, off, before, between, after);
    if (!(accepted > 0.0)) {{
        x = p;
    }}
    return {0}(x, accepted);
}}

// A step of dt seconds; p itself if the step is rejected (flowTry).
{1} flowStep({1} p, {2}float dt) {{
    return flowTry(p, {3}dt).{4};
}}

// Moves p by dt seconds. A step that is rejected is halved, up to eight times; then p stays there.
{1} flowAdvance({1} p, {2}float dt) {{
    {1} q = p;
    float left = 1.0;
    float part = 1.0;
    for (int k = 0; k < 64 && left > 0.0 && part > 0.003; ++k) {{
        part = min(part, left);
        {0} next = flowTry(q, {3}dt * part);
        q = next.{4};
        left = left - next.{5} * part;
        if (next.{5} > 0.0) {{
            part = 2.0 * part;
        }} else {{
            part = 0.5 * part;
        }}
    }}
    return q;
}}
)",
                              T::kResult, T::kPlace, parameter, tracks ? "track, " : "", T::kMembers, T::kFlag);
}

} // namespace

std::string stageText(const std::array<double, Tableau::kMaxStages>& weights, int count, const std::string& last) {
    std::string sum;
    for (int j = 0; j < count; ++j) {
        const double weight = weights[static_cast<size_t>(j)];
        if (weight == 0) continue;
        const std::string name = j + 1 == count && !last.empty() ? last : fmt::format("k{}", j);
        sum += (sum.empty() ? "" : " + ") + times(weight) + name;
    }
    return sum;
}

template <int N>
std::string stepText(const FlowN<N>& flow, const FlowShaderOptions& options) {
    const bool tracks = flow.hasTracks(), wall = flow.domain().wall.has_value();
    std::string text = valueFunctions<N>(tracks, wall);
    if (tracks) text += reprojectFunction<N>(options.corrections);
    return translated(text + stepFunctions<N>(tracks, wall, options.scheme, options.corrections), options.dialect);
}
template std::string stepText(const FlowN<2>&, const FlowShaderOptions&);
template std::string stepText(const FlowN<3>&, const FlowShaderOptions&);

} // namespace curlew
