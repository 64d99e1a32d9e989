// SPDX-License-Identifier: Apache-2.0
#include "curlew/app/run/AnyField.h"
#include "curlew/field/Algebra.h"
#include "curlew/field/NoiseField.h"
#include "support/Points.h"

using namespace curlew;
using namespace curlew::app;
using namespace curlew::test;
using Catch::Matchers::ContainsSubstring;

TEST_CASE("dimensionOf: reports the dimension of fields and flows", "[app]") {
    CHECK(dimensionOf(AnyField(noiseField<ValueNoise<1>>())) == 1);
    CHECK(dimensionOf(AnyField(noiseField<SimplexNoise<7>>())) == 7);
    CHECK(dimensionOf(AnyFlow(FlowN<2>({noiseField<Psrd2>()}))) == 2);
}

TEST_CASE("inSpace: a field of fewer dimensions is constant along the other axes", "[app]") {
    const ScalarFieldN<1> line = noiseField<PerlinNoise<1>>({.seed = 1});
    const ScalarFieldN<2> plane = noiseField<Psrd2>({.seed = 1});
    for (const Vec3d& p : randomPoints(cube(3), 50, 1)) {
        CAPTURE(p);
        const auto a = inSpace(AnyField(line)).at<1>(p), b = inSpace(AnyField(plane)).at<1>(p);
        const auto jetA = line.at<1>(Vec<double, 1>{{p[0]}});
        const auto jetB = plane.at<1>(Vec<double, 2>{{p[0], p[1]}});
        REQUIRE(a.value == jetA.value);
        REQUIRE(a.gradient == Vec3d{{jetA.gradient[0], 0, 0}});
        REQUIRE(b.value == jetB.value);
        REQUIRE(b.gradient == Vec3d{{jetB.gradient[0], jetB.gradient[1], 0}});
    }
    CHECK_THROWS_WITH(inSpace(AnyField(noiseField<SimplexNoise<4>>())),
                      ContainsSubstring("4 dimensions") && ContainsSubstring("-lift"));
}

TEST_CASE("inSpace: a 2D flow is the same in every plane of space", "[app]") {
    const FlowN<2> plane({noiseField<Psrd2>({.seed = 3})}, {.box = {{{-2, -1}}, {{2, 1}}}, .wall = {}});
    const Flow flow = inSpace(AnyFlow(plane)), even = inSpace(AnyFlow(plane.normalized(2)));
    CHECK(flow.hasTracks());
    CHECK(flow.domain().box.lower == Vec3d{{-2, -1, -0.25}});
    CHECK(flow.domain().box.upper == Vec3d{{2, 1, 0.25}});
    CHECK_FALSE(even.divergenceFree());
    for (const Vec3d& p : randomPoints(cube(3), 50, 2)) {
        const auto c = plane.at({{p[0], p[1]}}).velocity;
        CAPTURE(p);
        REQUIRE(flow.at(p).velocity == Vec3d{{c[0], c[1], 0}});
        REQUIRE(length(even.at(p).velocity) == Approx(2));
    }
    const auto f = noiseField<SimplexNoise<4>>();
    CHECK_THROWS_WITH(inSpace(AnyFlow(FlowN<4>({f, f, f}))),
                      ContainsSubstring("flow") && ContainsSubstring("4 dimensions"));
}

TEST_CASE("combined: fields are combined in their own dimension or in 3D", "[app]") {
    const auto sum = [](const auto& a, const auto& b) { return a + b; };
    const AnyField plane = noiseField<Psrd2>(), space = noiseField<Psrd3>(), high = noiseField<SimplexNoise<5>>();
    CHECK(dimensionOf(combined(plane, plane, sum)) == 2);
    CHECK(dimensionOf(combined(high, high, sum)) == 5);
    CHECK(dimensionOf(combined(plane, space, sum)) == 3);
    CHECK_THROWS_WITH(combined(space, high, sum),
                      ContainsSubstring("3 and 5 dimensions") && ContainsSubstring("-lift"));
    CHECK_THROWS_WITH(combined(AnyField(noiseField<ValueNoise<1>>()), plane, sum), ContainsSubstring("1 and 2"));
}
