// SPDX-License-Identifier: Apache-2.0
#include "curlew/app/actions/Actions.h"
#include "curlew/app/language/Program.h"
#include "curlew/app/registry/Expression.h"
#include "curlew/base/Error.h"
#include "curlew/base/Random.h"
#include "support/Catch.h"

#include <cmath>
#include <cstdlib>
#include <numbers>

using namespace curlew;
using namespace curlew::app;
using Catch::Matchers::ContainsSubstring;

namespace {

double valueOf(const std::string& expression, const Moment& moment = {}) {
    const std::string text = expanded("{" + expression + "}", moment);
    char* end = nullptr;
    const double value = std::strtod(text.c_str(), &end);
    CAPTURE(expression, text);
    REQUIRE(*end == 0);
    return value;
}

Graph graphOf(const std::string& scene) { return graphOfScene(scene, "scene", {.registry = registry()}); }

/// Returns the options of an action without inputs.
Arguments given(const std::string& line) { return graphOf(line).nodes.at(0).arguments; }

} // namespace

TEST_CASE("expressions: evaluate to the values of their formulas", "[app]") {
    const Moment moment{.frame = 17, .time = 0.625, .fps = 30};
    CHECK(valueOf("1+2*3") == 7);
    CHECK(valueOf("2^10-24") == 1000);
    CHECK(valueOf("F", moment) == 17);
    CHECK(valueOf("T", moment) == 0.625);
    CHECK(valueOf("fps", moment) == 30);
    CHECK(valueOf("2*pi*T", moment) == 2 * std::numbers::pi * 0.625);
    CHECK(valueOf("sin(pi/6)") == std::sin(std::numbers::pi / 6));
    CHECK(valueOf("exp(1) + log(2) + sqrt(3) + atan2(1, 2)") ==
          std::exp(1.0) + std::log(2.0) + std::sqrt(3.0) + std::atan2(1.0, 2.0));
    CHECK(valueOf("floor(-1.5)") == -2);
    CHECK(valueOf("ceil(-1.5)") == -1);
    CHECK(valueOf("mod(-1, 24)") == 23);
    CHECK(valueOf("clamp(F, 0, 10)", moment) == 10);
    CHECK(valueOf("min(F, 3) + max(1, 2)", moment) == 5);
    CHECK(valueOf("F < 20 ? 1 : 0", moment) == 1);
    // The values in a first frame 1.
    CHECK(expanded("{F} {T} {fps}", {}) == "1 0 24");
}

TEST_CASE("expressions: a value converted to text and back is unchanged", "[app]") {
    for (uint64_t k = 0; k < 1000; ++k) {
        const double time = (randomUniform(1, k) - 0.5) * std::exp2(200 * (randomUniform(2, k) - 0.5));
        CAPTURE(k, time);
        REQUIRE(valueOf("T", {.time = time}) == time);
    }
}

TEST_CASE("expressions: may appear anywhere in a text together with frame numbers", "[app]") {
    const Moment moment{.frame = 42, .time = 0.5};
    CHECK(expanded("{0.3*T},0,{-T}", moment) == "0.15,0,-0.5");
    CHECK(expanded("out/smoke.$F4.vdb", moment) == "out/smoke.0042.vdb");
    CHECK(expanded("$F_$F1_$F3", moment) == "42_42_042");
    CHECK(expanded("$F40", moment) == "00420"); // a single digit is the width
    CHECK(expanded("a{F+1}b{F-1}c", moment) == "a43b41c");
    CHECK(expanded("$$F4 {{F}", moment) == "$F4 {F}");
    CHECK(expanded("", moment).empty());
    CHECK(expanded("a } b", moment) == "a } b");
    // The name has the number of the frame that contains the time.
    CHECK(expanded("$F {F} {FF}", {.frame = 6.25}) == "7 7 6.25");
    CHECK(expanded("$F {F}", {.frame = 7 - 1e-12}) == "7 7");
    CHECK(expanded("$F {F}", {.frame = 7 + 1e-12}) == "7 7");
    CHECK(expanded("$F {F}", {.frame = 7.01}) == "8 8");
}

TEST_CASE("expressions: an escaped text expands to the text", "[app]") {
    for (const char* text : {"plain", "a{F}b", "$F4.####.%04d", "{{$$", "50% #1"}) {
        CAPTURE(text);
        CHECK(expanded(escaped(text), {.frame = 3}) == text);
        CHECK_FALSE(variablesOf(escaped(text)).any);
    }
}

TEST_CASE("expressions: variablesOf reports the variables of a text", "[app]") {
    CHECK_FALSE(variablesOf("plain").any);
    CHECK_FALSE(variablesOf("{2*pi}").any);
    CHECK(variablesOf("{fps}").any);
    CHECK_FALSE(variablesOf("{fps}").time);
    for (const char* text : {"{T}", "{1/F}", "{FF}", "a.$F4.vdb", "{fps}{sin(T)}"}) {
        CAPTURE(text);
        CHECK(variablesOf(text).time);
    }
    CHECK_FALSE(variablesOf("$$F {{T}").any);
}

TEST_CASE("expressions: an error names the expression and the cause", "[app]") {
    const auto complaint = [](const std::string& text) -> std::string {
        try {
            variablesOf(text);
        } catch (const ValueError& e) {
            return e.what();
        }
        return "nothing was wrong with " + text;
    };
    CHECK_THAT(complaint("{2*piT}"),
               ContainsSubstring("{2*piT}") && ContainsSubstring("piT") && ContainsSubstring("variables are F, T"));
    CHECK_THAT(complaint("{sin(1}"), ContainsSubstring("{sin(1}"));
    CHECK_THAT(complaint("{}"), ContainsSubstring("{}"));
    CHECK_THAT(complaint("{1+}"), ContainsSubstring("{1+}"));
    CHECK_THAT(complaint("{a=1}"), ContainsSubstring("{a=1}"));
    CHECK_THAT(complaint("{1,2"), ContainsSubstring("without a }"));
    CHECK_THAT(complaint("{1/0}"), ContainsSubstring("{1/0} is inf") && ContainsSubstring("finite"));
    CHECK_THAT(complaint("a.$4.vdb"), ContainsSubstring("$4") && ContainsSubstring("$F4") && ContainsSubstring("$$"));
    CHECK_THAT(complaint("price$"), ContainsSubstring("price$"));
    // 1 / T is invalid at T = 0 only.
    CHECK_NOTHROW(variablesOf("{1/T}"));
    CHECK_THROWS_WITH(expanded("{1/T}", {}), ContainsSubstring("T=0") && ContainsSubstring("finite"));
    CHECK(expanded("{1/T}", {.time = 2}) == "0.5");
    CHECK_THROWS_WITH(expanded("{F=3}", {}), ContainsSubstring("assignments are not possible"));
    CHECK_THROWS_WITH(expanded("{F+=3}", {}), ContainsSubstring("assignments are not possible"));
    CHECK_THROWS_WITH(expanded("{1,2,3}", {}), ContainsSubstring("has 3 values"));
    for (const char* comparison : {"{1==1}", "{1<=2}", "{2>=1}", "{1!=2}"}) CHECK(expanded(comparison, {}) == "1");
    const std::string parentheses(100000, '(');
    CHECK_THAT(complaint("{" + parentheses + "}"), ContainsSubstring("{(("));
}

TEST_CASE("expressions: options and words are evaluated at a moment", "[app]") {
    const Arguments line = given("noise alpha={2*pi*T} seed={F} translate={T},0,1 frequency={1+2}");
    CHECK(line.changes());
    CHECK(line.real("frequency") == 3); // does not depend on the moment
    const Arguments now = line.at({.frame = 5, .time = 0.25});
    CHECK(now.real("alpha") == 0.5 * std::numbers::pi);
    CHECK(now.integer("seed") == 5);
    CHECK(now.coordinates<3>("translate") == Vec3d{{0.25, 0, 1}});
    CHECK(now.at({.frame = 6, .time = 0}).integer("seed") == 6);
    CHECK(given("report a.$F4.json").at({.frame = 5}).words() == std::vector<std::string>{"a.0005.json"});
    CHECK(given("report b.{F}.json").at({.frame = 5}).words() == std::vector<std::string>{"b.5.json"});
    CHECK_FALSE(given("noise alpha={2*pi} seed={7}").changes());
    CHECK_FALSE(given("noise alpha={fps}").changes());
    CHECK(given("report a.$F.json").changes());
}

TEST_CASE("expressions: a value is checked as soon as it is known", "[app]") {
    // At once, if the value does not depend on the moment.
    CHECK_THROWS_WITH(given("sphere radius={1-1}"), ContainsSubstring("radius={1-1}, which is 0, must be above 0"));
    CHECK_THROWS_WITH(given("noise seed={1/2}"), ContainsSubstring("seed={1/2}") && ContainsSubstring("whole number"));
    CHECK_THROWS_WITH(given("noise alpha={2*piT}"), ContainsSubstring("alpha={2*piT}") && ContainsSubstring("piT"));
    // Otherwise, as soon as the moment is known.
    const Arguments sphere = given("sphere radius={1-T}");
    CHECK_NOTHROW(sphere.at({.time = 0.5}));
    CHECK_THROWS_WITH(sphere.at({.time = 1}), ContainsSubstring("radius={1-T}, which is 0, must be above 0"));
    CHECK_THROWS_WITH(given("noise seed={T}").at({.time = 0.5}), ContainsSubstring("seed={T}, which is 0.5"));
}

TEST_CASE("expressions: a scene keeps them as written", "[app]") {
    const std::string text = "noise alpha={2*pi*T} seed={F}\nreport out.$F4.json\n";
    Graph graph = graphOf(text);
    CHECK(sceneOf(graph) == text);
    for (Node& node : graph.nodes) node.arguments = node.arguments.at({.frame = 3, .time = 3});
    CHECK(sceneOf(graph) == text);
}

TEST_CASE("expressions: constants replace their names inside braces only", "[app]") {
    const Constants constants{{"scale", 0.25}, {"e3", 7}, {"n", -2}};
    CHECK(withConstants("scale{scale*2}", constants) == "scale{(0.25)*2}");
    CHECK(withConstants("{2e3 + 1.e3 + .5e3 + e3}", constants) == "{2e3 + 1.e3 + .5e3 + (7)}");
    CHECK(withConstants("{2-n^2}", constants) == "{2-(-2)^2}");
    CHECK(withConstants("{{scale}", constants) == "{{scale}");
    CHECK(withConstants("{scales+sin(nn)}", constants) == "{scales+sin(nn)}");
    CHECK(withConstants("$F {", constants) == "$F {");
    CHECK(constantOf("scale=0.5") == std::pair<std::string, double>("scale", 0.5));
    CHECK(constantOf("_n1={2^3}").second == 8);
    for (const char* wrong : {"scale", "=1", "2n=1", "a b=1", "n=", "n=x", "n={T}", "T=1", "pi=3", "FF=1", "n={1/0}",
                              "max=1", "sin=1", "clamp=1"}) {
        CAPTURE(wrong);
        CHECK_THROWS_AS(constantOf(wrong), ValueError);
    }
}

TEST_CASE("expressions: a constant is not taken for a coordinate of a formula", "[app]") {
    CHECK_THROWS_WITH(formulaWithConstants("x + y", {{"x", 3}}), ContainsSubstring("'x' has a meaning in formulas"));
    CHECK(formulaWithConstants("k * x + {x}", {{"k", 3}}) == "(3) * x + {x}");
    CHECK(withConstants("{x}", {{"x", 3}}) == "{(3)}");
}

TEST_CASE("expressions: the first value of a constant wins and the stored graph has values only", "[app]") {
    const Graph graph = graphOf("sphere\nset n=3\nset n=5 m={n+1}\nscatter count={n*m}\nscatter count={T+n}\n");
    REQUIRE(graph.nodes.size() == 3);
    CHECK(graph.nodes[1].arguments.integer("count") == 12);
    CHECK(graph.nodes[2].arguments.at({.frame = 25, .time = 2}).integer("count") == 5);
    CHECK(sceneOf(graph) == "sphere\nscatter count={(3)*(4)}\nscatter count={T+(3)}\n");
    CHECK_THROWS_WITH(graphOf("scatter count={k}\n"), ContainsSubstring("scene:1") && ContainsSubstring("{k}"));
    CHECK_THROWS_WITH(graphOf("set\n"), ContainsSubstring("NAME=VALUE"));
}
