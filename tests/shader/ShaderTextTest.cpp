// SPDX-License-Identifier: Apache-2.0
#include "curlew/base/Error.h"
#include "curlew/field/Algebra.h"
#include "curlew/field/Bound.h"
#include "curlew/field/NoiseField.h"
#include "curlew/field/ParsedFormula.h"
#include "curlew/field/Shapes.h"
#include "curlew/field/Transforms.h"
#include "curlew/shader/ShaderText.h"
#include "support/Points.h"
#include "support/VulkanRunner.h"

#include <fmt/format.h>

using namespace curlew;
using namespace curlew::test;

namespace {

constexpr size_t kCount = 5000;
constexpr const char* kFunctions = "sin(x*y)+exp(-z^2)*atan(x)+tanh(y)*cosh(z/2)+log(2+x^2)+abs(x-y)";
constexpr const char* kMoreFunctions =
    "asin(sin(x)/2)+acos(cos(y)/2)+sinh(z/3)+(1+x^2)^1.5+smoothstep(0,1,y)+tan(sin(z))";

/// Records the value and up to three derivatives of a field as a function of up to seven floats.
template <int N>
ShaderEntry recordEntry(SymbolModule& module, const ScalarFieldN<N>& field) {
    const std::vector types(size_t{N}, SymbolType::real);
    const size_t function = module.record("value", types, [&](const SymbolModule::Symbols& parameters) {
        Vec<Symbol<double>, N> p;
        for (size_t k = 0; k < size_t{N}; ++k) p.c[k] = convertTo<Symbol<double>>(Symbol<float>(parameters[k]));
        SymbolModule::Symbols results;
        detail::append(results, field.template symbols<1>(module, p));
        results.resize(std::min<size_t>(results.size(), 4));
        return results;
    });
    ShaderEntry entry{function, "flowValue", "A field.", {{"p", std::min<size_t>(N, 4)}}};
    if constexpr (N > 4) entry.parameters.push_back({"q", size_t{N - 4}});
    return entry;
}

void replaceAll(std::string& text, const std::string& what, const std::string& by) {
    for (size_t at = 0; (at = text.find(what, at)) != std::string::npos; at += by.size())
        text.replace(at, what.size(), by);
}

/// Makes GLSL ES run as GLSL 4.50: its textures become buffers, its uniform a variable.
std::string fromEs(std::string text, const std::vector<SymbolBuffer>& buffers) {
    for (size_t k = 0; k < buffers.size(); ++k)
        replaceAll(text, fmt::format("uniform highp sampler2D flowData{};", k),
                   fmt::format("layout(std430, binding = {0}) readonly buffer Data{1} {{ {2} flowData{1}[]; }};", k + 2,
                               k, buffers[k].width == 1 ? "float" : "vec4"));
    text = "#define texelFetch(buffer, at, level) vec4(buffer[at.y * 2048 + at.x])\n" + text;
    replaceAll(text, "uniform uint flowZero;", "uint flowZero;");
    return text;
}

template <int N>
void checkShader(const std::string& name, const ScalarFieldN<N>& field, double half = 2.5, double ofValue = 2e-6,
                 Dialect dialect = Dialect::glsl, ShaderCoordinates coordinates = ShaderCoordinates::doubles) {
    CAPTURE(name);
    SymbolModule module;
    const ShaderEntry entry = recordEntry(module, field);
    const size_t outputs = module.functions()[entry.function].results.size();
    const ShaderText shader = shaderText(module, {entry}, dialect, ShaderTables::data, {}, coordinates);
    ShaderRun run{shader.text, "", shader.buffers, {}, kCount, outputs, dialect == Dialect::hlsl};
    if (dialect == Dialect::glsl && coordinates == ShaderCoordinates::pairs)
        run.functions = "#define flowZero (gl_NumWorkGroups.z >> 1u)\n" + shader.text;
    if (dialect == Dialect::glslEs) {
        run.functions = fromEs(shader.text, shader.buffers);
        // 0, which the compiler does not know.
        if (run.functions.find("flowZero") != std::string::npos) run.body = "    flowZero = uint(inputs[0] > 1e30);\n";
    }
    for (size_t k = 0; k < kCount; ++k)
        for (const double x : randomPoint(cube<N>(half), 3, k).c) run.inputs.push_back(static_cast<float>(x));
    std::string arguments;
    for (const auto& [parameter, size] : entry.parameters) {
        arguments += arguments.empty() ? "" : ", ";
        arguments += size == 1 ? "float(" : "vec" + std::to_string(size) + "(";
        for (size_t k = 0; k < size; ++k)
            arguments += std::string(k ? ", " : "") + "inputs[i * " + std::to_string(N) + "u + " +
                         std::to_string(k + (parameter == "q" ? 4 : 0)) + "u]";
        arguments += ")";
    }
    const std::string type = outputs == 1 ? "float" : "vec" + std::to_string(outputs);
    run.body += "    " + type + " v = flowValue(" + arguments + ");\n";
    for (size_t k = 0; k < outputs; ++k)
        run.body += "    outputs[i * " + std::to_string(outputs) + "u + " + std::to_string(k) + "u] = v" +
                    (outputs == 1 ? "" : "[" + std::to_string(k) + "]") + ";\n";
    const std::vector<float> found = runShader(run);

    double value2 = 0, gradient2 = 0, value = 0, gradient = 0;
    for (size_t k = 0; k < kCount; ++k) {
        Vec<double, N> p;
        for (size_t i = 0; i < size_t{N}; ++i) p.c[i] = static_cast<double>(run.inputs[k * N + i]);
        const auto jet = field.template at<1, float>(p);
        const auto off = [&](size_t i, float expected) {
            return std::abs(static_cast<double>(found[k * outputs + i]) - static_cast<double>(expected));
        };
        value = std::max(value, off(0, jet.value));
        value2 += static_cast<double>(jet.value) * static_cast<double>(jet.value);
        for (int axis = 0; axis < N; ++axis) {
            const auto g = static_cast<double>(jet.gradient[axis]);
            gradient2 += g * g;
            if (static_cast<size_t>(axis) + 1 < outputs)
                gradient = std::max(gradient, off(static_cast<size_t>(axis) + 1, jet.gradient[axis]));
        }
    }
    CHECK(value / std::sqrt(value2 / kCount) < ofValue);
    CHECK(gradient / std::sqrt(gradient2 / kCount) < 2e-5);
}

using Noises = std::tuple<Psrd2, Psrd3, ValueNoise<1>, ValueNoise<2>, ValueNoise<3>, PerlinNoise<1>, PerlinNoise<2>,
                          PerlinNoise<3>, GradientNoise<2>, GradientNoise<3>, SimplexNoise<2>, SimplexNoise<3>,
                          SimplexNoise<4>, SimplexNoise<5>, SineNoise<1>, SineNoise<2>, SineNoise<3>, SineNoise<7>>;

/// Bounds of the rounding errors relative to rms. Noises on the integer lattice blend their cells by polynomials with
/// large coefficients (see their headers). The rms of simplex noise is 0.25 in 4D and 0.16 in 5D.
template <class Noise>
constexpr double kOfValue = 2e-6;
template <int N>
constexpr double kOfValue<ValueNoise<N>> = 1e-5;
template <int N>
constexpr double kOfValue<PerlinNoise<N>> = 1e-5;
template <int N>
constexpr double kOfValue<GradientNoise<N>> = 1e-5;
template <int N>
constexpr double kOfValue<SimplexNoise<N>> = N < 4 ? 2e-6 : 4e-6;

} // namespace

TEMPLATE_LIST_TEST_CASE("shaderText: a shader computes the values and gradients of a noise", "[shader]", Noises) {
    if (skippedWithoutVulkan()) return;
    checkShader("plain", noiseField<TestType>(), 2.5, kOfValue<TestType>);
    checkShader("seed", noiseField<TestType>({.seed = 3}, {.frequency = 1.7, .octaves = 2}), 2.5, kOfValue<TestType>);
}

TEST_CASE("shaderText: a shader computes shapes", "[shader]") {
    if (skippedWithoutVulkan()) return;
    checkShader("sphere", sphereSdf(0.7).distance);
    checkShader("box", boxSdf({{1, 0.8, 1.2}}, 0.1).distance);
    checkShader("torus", torusSdf(0.6, 0.2).distance);
    checkShader("capsule", capsuleSdf(0.6, 0.3).distance);
    checkShader("gyroid", gyroidSdf(1.7, 0.1).distance);
    checkShader("plane", planeSdf<3>({{1, 2, 3}}, 0.3).distance);
}

TEST_CASE("shaderText: a shader computes combinations and transforms of fields", "[shader]") {
    if (skippedWithoutVulkan()) return;
    const ScalarField noise = noiseField<Psrd3>({.seed = 3}, {.frequency = 1.3, .octaves = 2});
    checkShader("bounded", bounded(noise, {.sdf = sphereSdf(1.4), .side = Side::outside, .width = 0.4}));
    checkShader("smooth minimum", smoothMin(noise, sphereSdf(0.6).distance, 0.3));
    checkShader("formula", parsedFormula<3>(kFunctions).field);
    checkShader("more functions", parsedFormula<3>(kMoreFunctions).field);
    checkShader("placed", placed(noise, {.offset = {{1, 2, 3}}, .rotate = {{10, 20, 30}}, .scale = {{1, 2, 0.5}}}));
    checkShader("lifted", lifted<3>(noiseField<SimplexNoise<4>>(), {noise}), 2.5, 6e-6);
    checkShader("displaced", displaced(noise, noiseField<SimplexNoise<3>>(), 0.05), 2.5, 4e-6);
    checkShader("tiling", noiseField<Psrd3>({.period = {{3, 4, 5}}}, {.octaves = 2}), 8);
    checkShader("far from the origin", noiseField<Psrd3>(), 1e4);
}

TEST_CASE("shaderText: pairs of floats are as accurate as doubles", "[shader]") {
    if (skippedWithoutVulkan()) return;
    const Dialect dialect = GENERATE(Dialect::glsl, Dialect::glslEs, Dialect::hlsl);
    CAPTURE(kDialectNames.at(static_cast<size_t>(dialect)));
    const auto check = [&](const std::string& name, const auto& field, double half, double ofValue = 2e-6) {
        checkShader(name, field, half, ofValue, dialect, ShaderCoordinates::pairs);
    };
    check("psrd near the origin", noiseField<Psrd3>({.seed = 3}), 2.5);
    // Floats of this size are 0.001 apart.
    constexpr double kFar = 1e4;
    check("psrd", noiseField<Psrd3>({.seed = 3}), kFar);
    check("functions", parsedFormula<3>(kFunctions).field, 2.5);
    check("Perlin", noiseField<PerlinNoise<3>>(), kFar, 1e-5);
    // Dialects differ in how operations, functions and tables are written; those above use all three.
    if (dialect != Dialect::glsl) return;
    check("psrd in the plane", noiseField<Psrd2>(), kFar);
    check("tiling", noiseField<Psrd3>({.period = {{3, 4, 5}}}), kFar);
    check("Perlin's grid", noiseField<Psrd3>({.grid = PsrdOptions::Grid::perlin}), kFar);
    check("gradient", noiseField<GradientNoise<3>>({.seed = 3}), kFar, 1e-5);
    check("simplex", noiseField<SimplexNoise<3>>({.seed = 3}), kFar);
    check("published simplex", noiseField<SimplexNoise<4>>(), kFar, 4e-6); // its rms is a quarter
    check("sine", noiseField<SineNoise<3>>(), kFar);
    check("more functions", parsedFormula<3>(kMoreFunctions).field, 2.5);
}

TEST_CASE("shaderText: a text that compilers cannot cope with is an error that names its size", "[shader]") {
    SymbolModule module;
    ScalarField field = noiseField<Psrd3>();
    for (int k = 0; k < 10; ++k)
        field = placed(field, {.offset = {{0.1, 0, 0}}}) + placed(field, {.offset = {{0, 0.1, 0}}});
    CHECK_THROWS_AS(shaderText(module, {recordEntry(module, field)}, Dialect::glsl), ValueError);
}
