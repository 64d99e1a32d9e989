// SPDX-License-Identifier: Apache-2.0
#include "curlew/base/Error.h"
#include "curlew/field/Algebra.h"
#include "curlew/field/NoiseField.h"
#include "curlew/field/ParsedFormula.h"
#include "support/FiniteDifference.h"
#include "support/Formula.h"

#include <numbers>

using namespace curlew;
using namespace curlew::test;
using Catch::Matchers::ContainsSubstring;

namespace {

const ScalarField kNoise = noiseField<PsrdN<3>>({}, {.frequency = 2});

ScalarField fieldOf(const std::string& text) { return parsedFormula<3>(text, {{"noise", kNoise}}).field; }

double valueAt(const std::string& text, const Vec3d& p) { return fieldOf(text).at<0>(p).value; }

} // namespace

TEST_CASE("parsedFormula: values are those of the C library", "[field]") {
    const Vec3d p{{0.3, -0.7, 1.9}};
    const double x = p[0], y = p[1], z = p[2], n = kNoise.at<0>(p).value;
    const std::vector<std::pair<std::string, double>> expected{
        {"1 + 2*3 - 4/2", 5},
        {"2^3^2", 512},
        {"-2^2", -4},
        {"2^-1", 0.5},
        {"-x^2 + y", -x * x + y},
        {"(x - 1)*(x - 1)", (x - 1) * (x - 1)},
        {"x*y - z/4 + pi", x * y - z / 4 + std::numbers::pi},
        {"sin(2*x) + cos(y)", std::sin(2 * x) + std::cos(y)},
        {"tan(noise/4)", std::tan(n / 4)},
        {"asin(noise/4) + acos(noise/4)", std::numbers::pi / 2},
        {"atan(3*x)", std::atan(3 * x)},
        {"sinh(x) - cosh(y) + tanh(z)", std::sinh(x) - std::cosh(y) + std::tanh(z)},
        {"exp(x + noise)", std::exp(x + n)},
        {"log(x^2 + 1) - ln(y^2 + 2)", std::log(x * x + 1) - std::log(y * y + 2)},
        {"log2(z^2 + 1) + log10(z^4 + 1)", std::log2(z * z + 1) + std::log10(z * z * z * z + 1)},
        {"sqrt(1 + x^2)", std::sqrt(1 + x * x)},
        {"abs(y)", -y},
        {"(noise + 2)^0.5", std::sqrt(n + 2)},
        {"(noise + 2)^noise", std::pow(n + 2, n)},
        {"1/(2 + noise)^3", 1 / std::pow(n + 2, 3)},
        {"noise/(3 - noise)", n / (3 - n)},
        {"length(x, y)", std::hypot(x, y)},
        {"length(p - (1, 2, 3))", std::sqrt((x - 1) * (x - 1) + (y - 2) * (y - 2) + (z - 3) * (z - 3))},
        {"dot(p, (1, 2, 3))", x + 2 * y + 3 * z},
        {"dot(2*p/4, -p)", -(x * x + y * y + z * z) / 2},
        {"min(x, y, z)", y},
        {"max(x, 2, noise)", 2},
        {"clamp(z, -1, 1.5)", 1.5},
        {"sum(x, y, 1) + avg(x, y, z, 0)", x + y + 1 + (x + y + z) / 4},
        {"smin(x, z, 0.1) + smax(x, z, 0.1)", x + z},
        {"smoothstep(0, 1, x)", x * x * x * (x * (6 * x - 15) + 10)},
        {"smoothstep(0, 1, z) + smoothstep(3, 2, z)", 2},
        {"x1 + 10*x2 + 100*x3", x + 10 * y + 100 * z},
        {"noise*noise", n * n},
        {".5e1 + 1.e-1", 5.1},
    };
    for (const auto& [text, value] : expected) {
        CAPTURE(text);
        CHECK(valueAt(text, p) == Approx(value).epsilon(1e-13));
    }
}

TEST_CASE("parsedFormula: derivatives agree with finite differences at their order", "[field]") {
    for (const std::string text :
         {"sin(2*pi*x)*noise + 0.3*z^2", "tan(noise/4)", "asin(noise/4)", "acos(noise/4)", "atan(3*x*y)",
          "sinh(x)*cosh(y) + tanh(2*z)", "exp(x*noise)", "log(x^2 + y^2 + 1)", "sqrt(2 + noise)", "(noise + 2)^2.5",
          "(noise + 2)^-3", "1/(1 + exp(noise))", "smoothstep(-1, 1, x + noise/4)", "length(p - (9, 9, 9))",
          "smin(x, y, 0.4)", "cos(x)^5", "abs(noise + 3)"}) {
        CAPTURE(text);
        const ScalarField field = fieldOf(text);
        for (const Vec3d& p : randomPoints(cube(0.8), 20, 7)) {
            CAPTURE(p);
            const auto jet = field.at<2>(p);
            const auto derivative = [&](double h, int i) {
                return (field.at<1>(p + unit(i) * h).value - field.at<1>(p - unit(i) * h).value) / (2 * h);
            };
            const auto second = [&](double h, int i, int j) {
                return (field.at<1>(p + unit(j) * h).gradient[i] - field.at<1>(p - unit(j) * h).gradient[i]) / (2 * h);
            };
            for (int i = 0; i < 3; ++i) {
                CHECK(derivative(1e-5, i) == Approx(jet.gradient[i]).margin(1e-7).epsilon(1e-6));
                for (int j = i; j < 3; ++j)
                    CHECK(second(1e-5, i, j) == Approx(jet.hessian(i, j)).margin(1e-4).epsilon(1e-4));
            }
            // Third derivatives, by differences of the Hessian.
            const auto third = field.at<3>(p);
            const auto ahead = field.at<2>(p + unit(0) * 1e-5), behind = field.at<2>(p - unit(0) * 1e-5);
            if (text.find("noise") == std::string::npos && text.find("smin") == std::string::npos)
                for (int i = 0; i < 3; ++i)
                    CHECK((ahead.hessian(i, i) - behind.hessian(i, i)) / 2e-5 ==
                          Approx(third.third(0, i, i)).margin(1e-3).epsilon(1e-3));
        }
    }
}

TEST_CASE("parsedFormula: floats and batches agree with single points in double", "[field]") {
    const ScalarField field = fieldOf("exp(sin(x)*noise) + length(p)*atan(y) - (noise + 2)^1.5");
    PointBatchN<3> points;
    for (const Vec3d& p : randomPoints(cube(2), kBatch, 3)) points.push(p);
    JetBatchN<float, 3, 1> single;
    JetBatchN<double, 3, 1> several;
    field.eval(points, single);
    field.eval(points, several);
    for (int i = 0; i < points.size; ++i) {
        const auto exact = field.at<1>(points[i]);
        CHECK(several[i].value == exact.value);
        CHECK(several[i].gradient == exact.gradient);
        CHECK(single[i].value == Approx(exact.value).epsilon(1e-5).margin(1e-5));
    }
}

TEST_CASE("parsedFormula: ranges contain the values", "[field]") {
    for (const std::string text : {"sin(x)", "noise^2", "noise^3", "abs(noise)", "exp(noise)", "1/(noise + 2)",
                                   "smoothstep(0, 1, x)", "cosh(noise)", "(noise + 2)^-0.5", "clamp(x, -1, 2)",
                                   "sqrt(noise + 1.5)", "noise^2 - 2*noise", "acos(noise/4)"}) {
        CAPTURE(text);
        const ScalarField field = fieldOf(text);
        const Interval range = field.range();
        for (const Vec3d& p : randomPoints(cube(5), 300, 4)) {
            CHECK(range.contains(field.at<0>(p).value));
        }
    }
    CHECK(fieldOf("noise^2").range().lower == 0);
    CHECK(fieldOf("clamp(x, -1, 2)").range() == Interval{-1, 2});
}

TEST_CASE("parsedFormula: length is zero with zero derivatives at its centre", "[field]") {
    const auto jet = fieldOf("length(p)").at<2>({});
    CHECK(jet.value == 0);
    CHECK(jet.gradient == Vec3d{});
    for (const double h : jet.hessian.c) CHECK(h == 0);
}

TEST_CASE("parsedFormula: coordinates in dimensions other than three", "[field]") {
    CHECK(parsedFormula<1>("2*x + 1").field.at<1>({{3}}).gradient[0] == 2);
    CHECK(parsedFormula<7>("x7 * w + length(p)^2").field.at<0>({{1, 0, 0, 2, 0, 0, 3}}).value == Approx(6 + 14));
    CHECK(lastCoordinateIn("x*sin(w)") == 4);
    CHECK(lastCoordinateIn("swirl + 2") == 0);
    CHECK(namesInFormula("b + sin(a)*x + b*p - pi") == std::vector<std::string>{"b", "a"});
}

TEST_CASE("parsedFormula: kinks are named", "[field]") {
    using Kinks = std::vector<std::string>;
    CHECK(parsedFormula<3>("abs(x) + max(y, sin(z)) - min(1, 2)").kinks == Kinks{"abs(x)", "max(y, sin(z))"});
    CHECK(parsedFormula<3>("smin(x, y, 0.1)").kinks.empty());
}

TEST_CASE("parsedFormula: errors name the column and the reason", "[field]") {
    const std::vector<std::pair<std::string, std::string>> wrong{
        {"", "empty"},
        {"x +", "column 4"},
        {"(x", "the '(' in column 1 is not closed"},
        {"x)", "column 2: ')' is not expected"},
        {"x y", "column 3"},
        {"sni(x)", "did you mean 'sin'?"},
        {"nois", "did you mean 'noise'?"},
        {"noise(x)", "is a field, not a function"},
        {"sin", "arguments are missing"},
        {"sin(x, y)", "takes 1 argument, not 2"},
        {"min(x)", "takes at least 2 arguments, not 1"},
        {"w", "no coordinate 'w' in 3 dimensions"},
        {"1/x", "may be zero"},
        {"x/noise", "may be zero"},
        {"log(noise)", "the argument of a logarithm"},
        {"sqrt(x)", "must not be negative"},
        {"noise^0.5", "must be positive"},
        {"tan(x)", "between -pi/2 and pi/2"},
        {"1/0", "division by zero"},
        {"1e999", "not a number"},
        {"10^999", "the result is inf"},
        {"x $ y", "'$' has no meaning"},
        {"p", "a vector of 3"},
        {"p + 1", "'+' between a vector of 3 and a number"},
        {"x/p", "a vector cannot be a divisor"},
        {"smin(x, y, z)", "must be a number"},
        {"dot(p, (1, 2))", "same size"},
        {"smoothstep(1, 1, x)", "must differ"},
        {std::string(5000, '('), "parentheses are nested"},
        {"x\n", "\\x0a"},
    };
    for (const auto& [text, message] : wrong) {
        CAPTURE(text.substr(0, 40));
        CHECK_THROWS_AS(fieldOf(text), ValueError);
        CHECK_THROWS_WITH(fieldOf(text), ContainsSubstring(message));
    }
}
