// SPDX-License-Identifier: Apache-2.0
#include "curlew/base/Error.h"
#include "curlew/picture/Plot.h"
#include "support/Files.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <regex>

using namespace curlew;
using namespace curlew::test;

namespace {

constexpr double kMissing = std::numeric_limits<double>::quiet_NaN();

size_t count(const std::string& text, const std::string& part) {
    size_t found = 0;
    for (size_t at = text.find(part); at != text.npos; at = text.find(part, at + 1)) ++found;
    return found;
}

/// Returns the centres of the markers, in order.
std::vector<std::pair<double, double>> markers(const std::string& svg) {
    std::vector<std::pair<double, double>> found;
    const std::regex circle("<circle cx=\"([-0-9.]+)\" cy=\"([-0-9.]+)\"");
    for (std::sregex_iterator it(svg.begin(), svg.end(), circle), end; it != end; ++it)
        found.emplace_back(std::stod((*it)[1]), std::stod((*it)[2]));
    return found;
}

} // namespace

TEST_CASE("readPlotData: reads a table by header and rows", "[picture]") {
    const ScratchFolder folder;
    const PlotData data = readPlotData(store(folder / "a.csv", "r, \"our rdf\" ,theirs\r\n0,1,2.5\n\n0.5,,-3e-2\n"));
    CHECK(data.xName == "r");
    REQUIRE(data.curves.size() == 2);
    CHECK(data.curves[0].name == "our rdf");
    CHECK(data.x == std::vector<double>{0, 0.5});
    CHECK(std::isnan(data.curves[0].y[1]));
    CHECK(data.curves[1].y == std::vector<double>{2.5, -0.03});

    CHECK_THROWS_WITH(readPlotData(folder / "none.csv"), Catch::ContainsSubstring("none.csv"));
    CHECK_THROWS_WITH(readPlotData(store(folder / "b.csv", "x,y\n1,2\n3\n")), Catch::ContainsSubstring("line 3"));
    CHECK_THROWS_WITH(readPlotData(store(folder / "c.csv", "x,y\n1,two\n")),
                      Catch::ContainsSubstring("'two' is not a number"));
    CHECK_THROWS_AS(readPlotData(store(folder / "d.csv", "x\n1\n")), FileError);
    CHECK_THROWS_AS(readPlotData(store(folder / "e.csv", "x,y\n")), FileError);
    CHECK_THROWS_AS(readPlotData(store(folder / "f.csv", "")), FileError);
}

TEST_CASE("plotSvg: markers are placed according to the axes", "[picture]") {
    const bool logarithmic = GENERATE(false, true);
    const PlotData data{.xName = "n", .x = {1, 10, 100}, .curves = {{"error", {100, 10, 1}}}};
    const std::string svg = plotSvg(data, {.logX = logarithmic, .logY = logarithmic});
    const auto at = markers(svg);
    CAPTURE(logarithmic, svg);
    REQUIRE(at.size() == 3);
    const double partX = (at[1].first - at[0].first) / (at[2].first - at[0].first);
    const double partY = (at[1].second - at[2].second) / (at[0].second - at[2].second);
    CHECK(partX == Approx(logarithmic ? 0.5 : 9.0 / 99).margin(1e-3));
    CHECK(partY == Approx(logarithmic ? 0.5 : 9.0 / 99).margin(1e-3));
    CHECK(at[0].first < at[2].first);
    CHECK(at[0].second < at[2].second); // larger values are higher up
    CHECK_THAT(svg, Catch::ContainsSubstring(">100<") && Catch::EndsWith("</svg>\n"));
    CHECK(plotSvg(data, {.logX = logarithmic, .logY = logarithmic}) == svg);
}

TEST_CASE("plotSvg: curves that follow one another keep their markers, and more than seven differ by dashes",
          "[picture]") {
    PlotData data;
    constexpr size_t kCurves = 8, kPoints = 6;
    for (size_t k = 0; k < kCurves; ++k) {
        data.curves.push_back({fmt::format("curve {}", k), std::vector<double>(kCurves * kPoints, kMissing)});
        for (size_t n = 0; n < kPoints; ++n) {
            data.x.push_back(static_cast<double>(n));
            data.curves[k].y[k * kPoints + n] = static_cast<double>(k + n);
        }
    }
    const std::string svg = plotSvg(data);
    CHECK(markers(svg).size() == kCurves * kPoints);
    CHECK(count(svg, "stroke-dasharray") == 2); // the eighth curve and its line in the legend
}

TEST_CASE("plotSvg: names are escaped and missing values leave gaps", "[picture]") {
    PlotData data{.xName = "x", .x = {0, 1, 2, 3, 4}, .curves = {{"a<b & c", {1, 2, kMissing, 4, 5}}}};
    const std::string one = plotSvg(data, {.title = "T", .yLabel = "why"});
    CHECK(count(one, "<circle") == 4);
    CHECK(std::regex_search(one, std::regex("M[0-9. ]+L[0-9. ]+M[0-9. ]+L[0-9. ]+\"")));
    CHECK_THAT(one,
               Catch::ContainsSubstring(">T<") && Catch::ContainsSubstring(">why<") && Catch::ContainsSubstring(">x<"));
    CHECK_THAT(one, !Catch::ContainsSubstring("a&lt;b")); // a single curve has no legend
    data.curves.push_back({"other", {0, 0, 0, 0, 0}});
    CHECK_THAT(plotSvg(data), Catch::ContainsSubstring("a&lt;b &amp; c") && Catch::ContainsSubstring("other"));
    data.x.assign(500, 0);
    for (size_t k = 0; k < 500; ++k) data.x[k] = static_cast<double>(k);
    data.curves = {{"many", std::vector<double>(500, 3)}};
    CHECK(count(plotSvg(data), "<circle") == 0);
}

TEST_CASE("plotSvg: invalid data and options are refused", "[picture]") {
    const PlotData data{.xName = "x", .x = {0, 1}, .curves = {{"y", {-1, 0}}}};
    CHECK_NOTHROW(plotSvg(data));
    CHECK_THROWS_WITH(plotSvg(data, {.logY = true}), Catch::ContainsSubstring("logarithmic"));
    CHECK_THROWS_AS(plotSvg({.xName = "x", .x = {1}, .curves = {{"y", {kMissing}}}}), ValueError);
    CHECK_THROWS_AS(plotSvg({.xName = "x", .x = {1}, .curves = {{"y", {1, 2}}}}), ValueError);
    CHECK_THROWS_AS(plotSvg(data, {.width = 10}), ValueError);
}

TEST_CASE("plotSvg: values that differ by rounding errors are constant", "[picture]") {
    for (const double value : {1.0, -3e200, 1e-200}) {
        CAPTURE(value);
        const double next = std::nextafter(value, 2 * value);
        const PlotData data{.xName = "x", .x = {0, 1, 2}, .curves = {{"y", {value, next, value}}}};
        const std::string svg = plotSvg(data);
        CHECK(markers(svg).size() == 3);
        CHECK(count(svg, "<text") < 30);
    }
}

TEST_CASE("plotSvg: a point between missing values has a marker", "[picture]") {
    PlotData data{.xName = "x", .x = {}, .curves = {{"y", {}}}};
    for (int k = 0; k < 200; ++k) {
        data.x.push_back(k);
        // Lone points, then a line with one gap around a point.
        data.curves[0].y.push_back((k < 100 ? k % 2 == 1 : k == 150 || k == 152) ? kMissing : k);
    }
    const auto found = markers(plotSvg(data));
    CHECK(found.size() == 50 + 1);
    CHECK(std::is_sorted(found.begin(), found.end()));
}
