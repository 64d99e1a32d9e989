#include "curlew/app/Probe.h"
#include "curlew/app/Text.h"
#include "curlew/base/Error.h"
#include "curlew/field/Algebra.h"
#include "curlew/field/Bound.h"
#include "curlew/field/NoiseField.h"
#include "support/Command.h"
#include "support/Points.h"
#include "support/Reference.h"

#include <catch2/catch.hpp>
#include <fmt/format.h>

#include <sstream>

using namespace curlew;
using namespace curlew::app;
using Catch::Matchers::Contains;
using test::Folder;
using test::store;
namespace fs = std::filesystem;

namespace {

struct Table {
    std::string header;
    std::vector<std::vector<double>> rows;
};

Table tableOf(const fs::path& path) {
    std::istringstream lines(test::bytesOf(path));
    Table table;
    std::getline(lines, table.header);
    for (std::string line; std::getline(lines, line);) {
        auto& row = table.rows.emplace_back();
        for (const auto& cell : split(line, ',')) REQUIRE(parseReal(cell, row.emplace_back()));
    }
    return table;
}

/// More than one batch, and the last one not full.
std::vector<Vec3d> positions() { return test::randomPoints(test::cube(3), 150, 1); }

const std::array<std::string, 3> kHeaders{"x,y,z,value", "x,y,z,value,dx,dy,dz",
                                          "x,y,z,value,dx,dy,dz,dxx,dyy,dzz,dxy,dxz,dyz"};

template <class T, int Order>
void checkField(const ScalarField& field, const Folder& folder) {
    probeField<T>(field, positions(), Order, folder / "out.csv");
    const Table table = tableOf(folder / "out.csv");
    CAPTURE(Order, sizeof(T));
    CHECK(table.header == kHeaders[Order]);
    REQUIRE(table.rows.size() == positions().size());
    for (size_t k = 0; k < table.rows.size(); ++k) {
        const auto& row = table.rows[k];
        const Vec3d p = positions()[k];
        const auto jet = field.at<Order, T>(p);
        REQUIRE(row.size() == 3 + jet.kSize);
        CAPTURE(p);
        for (int i = 0; i < 3; ++i) REQUIRE(row[static_cast<size_t>(i)] == p[i]);
        // The digits tell the numbers apart: they come back as they were.
        for (int i = 0; i < jet.kSize; ++i)
            REQUIRE(static_cast<T>(row[static_cast<size_t>(3 + i)]) == jet.component(i));
    }
}

} // namespace

TEST_CASE("probing a field gives the library's own values, to the last bit", "[app]") {
    const Folder folder;
    const ScalarField field = bounded(psrdField({.seed = 3}, {.frequency = 1.3, .octaves = 2}),
                                      {.sdf = sphereSdf(1), .side = Side::both, .width = 0.2});
    checkField<double, 0>(field, folder);
    checkField<double, 1>(field, folder);
    checkField<double, 2>(field, folder);
    checkField<float, 0>(field, folder);
    checkField<float, 1>(field, folder);
    checkField<float, 2>(field, folder);
}

TEST_CASE("a probe has 17 digits in double, 9 in float, and positions always 17", "[app]") {
    const Folder folder;
    const ScalarField field = constantField(0.1);
    const std::vector<Vec3d> p{{{0.1, 1 / 3.0, 2}}};
    probeField<double>(field, p, 0, folder / "d.csv");
    CHECK(test::bytesOf(folder / "d.csv") ==
          "x,y,z,value\n0.10000000000000001,0.33333333333333331,2,0.10000000000000001\n");
    probeField<float>(field, p, 0, folder / "f.csv");
    CHECK(test::bytesOf(folder / "f.csv") == "x,y,z,value\n0.10000000000000001,0.33333333333333331,2,0.100000001\n");
}

TEST_CASE("probing a flow gives velocity, potentials and Jacobian", "[app]") {
    const Folder folder;
    const Dfvn flow(psrdField({.seed = 1}), psrdField({.seed = 2}));
    probeFlow<double>(flow, positions(), 0, folder / "0.csv");
    CHECK(tableOf(folder / "0.csv").header == "x,y,z,vx,vy,vz,f,g");
    probeFlow<double>(flow, positions(), 1, folder / "1.csv");
    CHECK(tableOf(folder / "1.csv").header == "x,y,z,vx,vy,vz,f,g");
    probeFlow<double>(flow, positions(), 2, folder / "2.csv");
    const Table table = tableOf(folder / "2.csv");
    CHECK(table.header == "x,y,z,vx,vy,vz,f,g,dvx_dx,dvx_dy,dvx_dz,dvy_dx,dvy_dy,dvy_dz,dvz_dx,dvz_dy,dvz_dz");
    REQUIRE(table.rows.size() == positions().size());
    for (size_t k = 0; k < table.rows.size(); ++k) {
        const FlowSample sample = flow.at(positions()[k]);
        std::vector<double> expected{sample.velocity[0], sample.velocity[1], sample.velocity[2], sample.f, sample.g};
        for (const auto& row : sample.derivative.rows) expected.insert(expected.end(), row.c.begin(), row.c.end());
        CAPTURE(k);
        REQUIRE(std::vector<double>(table.rows[k].begin() + 3, table.rows[k].end()) == expected);
    }
    probeFlow<float>(flow, positions(), 0, folder / "f.csv");
    const Table single = tableOf(folder / "f.csv");
    for (size_t k = 0; k < single.rows.size(); ++k) {
        CAPTURE(k);
        // As the header of the noise promises for float: 1e-4 of the value, 5e-4 of gradients below 6.
        REQUIRE(std::abs(single.rows[k][6] - table.rows[k][6]) < 1e-4);
        REQUIRE(std::abs(single.rows[k][3] - table.rows[k][3]) < 4 * 6 * 5e-4);
    }
}

TEST_CASE("positions are read from a table", "[app]") {
    const Folder folder;
    store(folder / "a.csv", "x,y,z\r\n1,-2.5,1e3\r\n\r\n+.5,0,-0\n3,4,5");
    const auto read = readPositions(folder / "a.csv");
    REQUIRE(read.size() == 3);
    CHECK(read[0] == Vec3d{{1, -2.5, 1000}});
    CHECK(read[1] == Vec3d{{0.5, 0, 0}});
    CHECK(read[2] == Vec3d{{3, 4, 5}});
}

TEST_CASE("a table that is no list of positions is refused with its name and line", "[app]") {
    struct Case {
        std::string content, says;
    };
    const auto c = GENERATE(
        Case{"", "empty"}, Case{"x,y,z\n", "no positions"}, Case{"x,y,z", "no positions"},
        Case{"1,2,3\n4,5,6\n", "x,y,z"}, Case{"x;y;z\n1;2;3\n", "x,y,z"}, Case{"x, y, z\n1,2,3\n", "x,y,z"},
        Case{"x,y,z\n1,2,3\nnan,0,0\n", "line 3"}, Case{"x,y,z\n1,2,inf\n", "line 2"}, Case{"x,y,z\n1,2\n", "line 2"},
        Case{"x,y,z\n\n1,2,3,4\n", "line 3"}, Case{"x,y,z\n1,2,1e999\n", "line 2"}, Case{"x,y,z\n1,2,\n", "line 2"},
        Case{"x,y,z\n1,2,3\n4,5", "line 3"}, Case{"\x89PNG\r\n\x1a\n", "x,y,z"});
    CAPTURE(c.content);
    const Folder folder;
    store(folder / "bad.csv", c.content);
    CHECK_THROWS_AS(readPositions(folder / "bad.csv"), FileError);
    CHECK_THROWS_WITH(readPositions(folder / "bad.csv"), Contains("bad.csv") && Contains(c.says));
}

TEST_CASE("positions that are not there, or a folder, are refused", "[app]") {
    const Folder folder;
    CHECK_THROWS_WITH(readPositions(folder / "none.csv"), Contains("none.csv") && Contains("no such file"));
    CHECK_THROWS_WITH(readPositions(folder / ""), Contains("folder"));
}

TEST_CASE("a probe that is cancelled leaves nothing behind", "[app]") {
    const Folder folder;
    CHECK_THROWS_AS(probeField<double>(constantField(1), positions(), 0, folder / "out.csv",
                                       {.report = {}, .cancelled = [] { return true; }}),
                    Interrupted);
    CHECK(folder.names().empty());
}

TEST_CASE("the command's probe agrees with the reference values of psrdnoise", "[app][command]") {
    struct Case {
        std::string file, options;
    };
    const auto c =
        GENERATE(Case{"psrdnoise3_p0-0-0_a0.json", ""}, Case{"psrdnoise3_p4-6-3_a0.7.json", "period=4,6,3 alpha=0.7"});
    const auto reference = test::ownData(c.file);
    const Folder folder;
    std::string text = "x,y,z\n";
    for (const auto& row : reference.at("rows"))
        text +=
            fmt::format("{:.17g},{:.17g},{:.17g}\n", row[1].get<double>(), row[2].get<double>(), row[3].get<double>());
    store(folder / "in.csv", text);
    // As in PsrdTest: 1e-11 in double; in float 1e-4, 5e-4, 3e-3 by order.
    const std::string precision = GENERATE("double", "float");
    folder.mustRun("-noise " + c.options + " -probe in.csv out.csv order=2 precision=" + precision);
    const Table table = tableOf(folder / "out.csv");
    CHECK(table.header == kHeaders[2]);
    REQUIRE(table.rows.size() == reference.at("rows").size());
    for (size_t k = 0; k < table.rows.size(); ++k)
        for (size_t i = 0; i < 10; ++i) {
            CAPTURE(c.file, precision, k, i);
            const double tolerance = precision == "double" ? 1e-11 : i == 0 ? 1e-4 : i < 4 ? 5e-4 : 3e-3;
            REQUIRE(std::abs(table.rows[k][3 + i] - reference.at("rows")[k][4 + i].get<double>()) <= tolerance);
        }
}
