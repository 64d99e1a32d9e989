// SPDX-License-Identifier: Apache-2.0
#include "curlew/base/Error.h"
#include "curlew/field/Algebra.h"
#include "curlew/field/Bound.h"
#include "curlew/field/NoiseField.h"
#include "curlew/field/ParsedFormula.h"
#include "curlew/field/ShapeModels.h"
#include "curlew/field/Transforms.h"
#include "support/Points.h"
#include "support/SymbolInterpreter.h"

using namespace curlew;
using namespace curlew::test;

namespace {

constexpr size_t kCount = 2000;

/// Checks that the recorded functions of a field compute its values and gradients. In double, only the order of some
/// roundings differs. In float, the noises' own rounding errors (their headers) bound the differences; the limits here
/// are those of the shaders' documentation. Simplex noise in 6 and 7 dimensions has errors of 1e-7 that are large
/// relative to its rms of 0.1.
template <int N>
void checkRecorded(const std::string& name, const ScalarFieldN<N>& field, double half = 2.5,
                   double ofValue = N >= 6 ? 6e-6 : 2e-6) {
    CAPTURE(name);
    const SymbolErrors exact = symbolErrors<double>(field, cube<N>(half), kCount, 1);
    CHECK(exact.value < 1e-12);
    CHECK(exact.gradient < 1e-12);
    const SymbolErrors rounded = symbolErrors<float>(field, cube<N>(half), kCount, 2);
    CHECK(rounded.value < ofValue);
    CHECK(rounded.gradient < 2e-5);
}

struct Opaque {
    static constexpr std::string_view kNotSymbolic = "a picture";
    template <int Order, class T>
    Jet<T, 3, Order> at(const Vec3d& p) const {
        return Jet<T, 3, Order>(static_cast<T>(p[0]));
    }
};

using Noises = std::tuple<Psrd2, Psrd3, ValueNoise<1>, ValueNoise<2>, ValueNoise<3>, PerlinNoise<1>, PerlinNoise<2>,
                          PerlinNoise<3>, GradientNoise<2>, GradientNoise<3>, SimplexNoise<2>, SimplexNoise<3>,
                          SimplexNoise<4>, SimplexNoise<5>, SimplexNoise<6>, SimplexNoise<7>, SineNoise<1>,
                          SineNoise<2>, SineNoise<3>, SineNoise<7>>;

} // namespace

TEMPLATE_LIST_TEST_CASE("Symbols: a recorded noise computes its values and gradients", "[field]", Noises) {
    checkRecorded("plain", noiseField<TestType>());
    checkRecorded("seed", noiseField<TestType>({.seed = 3}, {.frequency = 1.7, .octaves = 2}));
}

TEST_CASE("Symbols: recorded shapes compute their values and gradients", "[field]") {
    checkRecorded("sphere", sphereSdf(0.7).distance);
    checkRecorded("circle", sphereSdf<2>(0.7).distance);
    checkRecorded("box", boxSdf({{1, 0.8, 1.2}}, 0.1).distance);
    checkRecorded("rectangle", boxSdf<2>({{1, 0.8}}, 0).distance);
    checkRecorded("torus", torusSdf(0.6, 0.2).distance);
    checkRecorded("capsule", capsuleSdf(0.6, 0.3).distance);
    checkRecorded("cylinder", sdfOf(shapes::Cylinder{1, 0.4, 0.1}).distance);
    checkRecorded("gyroid", gyroidSdf(1.7, 0.1).distance);
    checkRecorded("plane", planeSdf<3>({{1, 2, 3}}, 0.3).distance);
    checkRecorded("union", unite(sphereSdf(0.7), boxSdf({{1, 0.8, 1.2}}, 0.1), 0.3).distance);
    checkRecorded("placed", placed(torusSdf(0.6, 0.2), {.offset = {{0.2, 0, 0.1}}, .rotate = {{10, 20, 30}}}).distance);
}

TEST_CASE("Symbols: recorded combinations of fields compute their values and gradients", "[field]") {
    const ScalarField noise = noiseField<Psrd3>({.seed = 3}, {.frequency = 1.3, .octaves = 2});
    const WallN<3> wall{.sdf = sphereSdf(1.4), .side = Side::inside, .width = 0.4};
    checkRecorded("sum", noise + rampField({{1, 2, 3}}));
    checkRecorded("difference and quotient", (noise - rampField({{1, 2, 3}})) / (noise + constantField(2)));
    checkRecorded("product", noise * sphereSdf(0.7).distance);
    checkRecorded("scaled", -0.3 * noise);
    checkRecorded("smooth minimum", smoothMin(noise, sphereSdf(0.6).distance, 0.3));
    checkRecorded("smooth maximum", smoothMax(noise, sphereSdf(0.6).distance, 0.3));
    checkRecorded("clipped", clipped(noise, 0.5));
    for (const Side side : {Side::inside, Side::outside, Side::both})
        checkRecorded("bounded", bounded(noise, {.sdf = sphereSdf(1.4), .side = side, .width = 0.4}));
    checkRecorded("product bounded", productBounded(noise, sphereSdf(0.8), 0.3));
    checkRecorded("layer fade", layerFade(wall));
    checkRecorded("layer ramp", layerRamp(wall));
    checkRecorded("billow", noiseField<GradientNoise<3>>({}, {.frequency = 1.3, .billow = 0.1}));
    checkRecorded(
        "formula",
        parsedFormula<3>("sin(x*y)+exp(-z^2)*atan(x)+tanh(y)*cosh(z/2)+log(2+x^2)+(1+x^2)^1.5+abs(x-y)").field);
    checkRecorded(
        "more functions",
        parsedFormula<3>("asin(sin(x)/2)+acos(cos(y)/2)+sinh(z/3)+sqrt(x^2+1)+smoothstep(0,1,y)+tan(sin(z))").field);
}

TEST_CASE("Symbols: recorded transforms compute their values and gradients", "[field]") {
    const ScalarField noise = noiseField<Psrd3>({.seed = 3});
    checkRecorded("placed", placed(noise, {.offset = {{1, 2, 3}}, .rotate = {{10, 20, 30}}, .scale = {{1, 2, 0.5}}}));
    checkRecorded("projected", projected(noiseField<Psrd2>(), Matrix<2, 3>{{Vec3d{{0, 0.3, 1}}, Vec3d{{1, 0, 0.7}}}}));
    // Recorded heights have the precision of values, on the processor they are double.
    checkRecorded("lifted", lifted<3>(noiseField<SimplexNoise<4>>(), {noise}), 2.5, 6e-6);
    checkRecorded("lifted twice", lifted<3>(noiseField<SineNoise<5>>(), {noise, rampField({{1, 0, 1}})}), 2.5, 6e-6);
    checkRecorded("height", heightField<3>(noiseField<Psrd2>()));
    checkRecorded("displaced", displaced(noise, noiseField<SimplexNoise<3>>(), 0.05));
    checkRecorded("warped octaves", noiseField<SimplexNoise<3>>({}, {.octaves = 3, .warp = 0.05}));
    checkRecorded("tiling", noiseField<Psrd3>({.period = {{3, 4, 5}}}, {.octaves = 2}), 8);
    checkRecorded("tiling and warped", noiseField<SineNoise<3>>({.period = {{3, 4, 5}}}, {.octaves = 2, .warp = 0.05}));
    checkRecorded("Perlin's grid", noiseField<Psrd3>({.grid = PsrdOptions::Grid::perlin}));
    checkRecorded("corners in 6D", noiseField<SimplexNoise<6>>({.kernel = SimplexKernel::corners}));
    checkRecorded("published simplex", noiseField<SimplexNoise<3>>({.kernel = SimplexKernel::published}));
}

TEST_CASE("Symbols: fields that cannot be recorded are errors that name them", "[field]") {
    SymbolModule module;
    CHECK_THROWS_WITH(recordField<1>(module, 2.0 * ScalarField(Opaque{})), "a picture cannot be written as a shader");
}

TEST_CASE("Symbols: octaves that differ in frequency and amplitude only share one function", "[field]") {
    SymbolModule one, six;
    recordField<1>(one, noiseField<Psrd3>());
    recordField<1>(six, noiseField<Psrd3>({}, {.octaves = 6}));
    CHECK(six.functions().size() == one.functions().size());
    CHECK(six.tables().size() == one.tables().size());
}
