// SPDX-License-Identifier: Apache-2.0
#include "curlew/app/registry/Text.h"
#include "curlew/app/run/Probe.h"
#include "curlew/base/Error.h"
#include "curlew/field/Algebra.h"
#include "curlew/field/Bound.h"
#include "curlew/field/NoiseField.h"
#include "curlew/flow/Flows.h"
#include "support/Catch.h"
#include "support/ProbeCommand.h"
#include "support/Reference.h"

#include <fmt/format.h>

#include <sstream>

using namespace curlew;
using namespace curlew::app;
using Catch::Matchers::ContainsSubstring;
using test::Folder;
using test::store;
using test::Table;
using test::tableOf;
namespace fs = std::filesystem;

namespace {

template <int N>
Positions positionsOf(const std::vector<Vec<double, N>>& points) {
    Positions positions;
    positions.names = split(test::coordinateHeader(N), ',');
    for (const auto& p : points) positions.coordinates.insert(positions.coordinates.end(), p.c.begin(), p.c.end());
    return positions;
}

/// More than one batch, the last one partly filled.
template <int N = 3>
std::vector<Vec<double, N>> points() {
    return test::randomPoints(test::cube<N>(3), 150, 1);
}
template <int N = 3>
Positions positions() {
    return positionsOf(points<N>());
}

template <class T, int Order, int N>
void checkField(const ScalarFieldN<N>& field, const std::string& header, const Folder& folder) {
    probeField<T>(field, positions<N>(), Order, folder / "out.csv");
    const Table table = tableOf(folder / "out.csv");
    CAPTURE(Order, N, sizeof(T));
    CHECK(table.header == header);
    REQUIRE(table.rows.size() == points<N>().size());
    for (size_t k = 0; k < table.rows.size(); ++k) {
        const auto& row = table.rows[k];
        const auto p = points<N>()[k];
        const auto jet = field.template at<Order, T>(p);
        REQUIRE(row.size() == N + jet.kSize);
        CAPTURE(p);
        for (int i = 0; i < N; ++i) REQUIRE(row[static_cast<size_t>(i)] == p[i]);
        // The printed digits identify the numbers exactly.
        for (int i = 0; i < jet.kSize; ++i)
            REQUIRE(static_cast<T>(row[static_cast<size_t>(N + i)]) == jet.component(i));
    }
}

const std::string kOrder2 = "x,y,z,value,dx,dy,dz,dxx,dyy,dzz,dxy,dxz,dyz";

} // namespace

TEST_CASE("probeField: values are exactly those of the library", "[app]") {
    const Folder folder;
    const ScalarField field = bounded(noiseField<Psrd3>({.seed = 3}, {.frequency = 1.3, .octaves = 2}),
                                      {.sdf = sphereSdf(1), .side = Side::both, .width = 0.2});
    checkField<double, 0>(field, "x,y,z,value", folder);
    checkField<double, 1>(field, "x,y,z,value,dx,dy,dz", folder);
    checkField<double, 2>(field, kOrder2, folder);
    checkField<float, 0>(field, "x,y,z,value", folder);
    checkField<float, 1>(field, "x,y,z,value,dx,dy,dz", folder);
}

TEST_CASE("probeField: with precision=float, second derivatives are those in double", "[app]") {
    const Folder folder;
    const ScalarField field = noiseField<Psrd3>({.seed = 3}, {.frequency = 1.3, .octaves = 2});
    probeField<float>(field, positions(), 2, folder / "out.csv");
    const Table table = tableOf(folder / "out.csv");
    CHECK(table.header == kOrder2);
    for (size_t k = 0; k < table.rows.size(); ++k) {
        const auto single = field.at<1, float>(points()[k]);
        const auto exact = field.at<2>(points()[k]);
        std::vector<double> expected;
        for (int i = 0; i < single.kSize; ++i) expected.push_back(static_cast<double>(single.component(i)));
        for (int i = single.kSize; i < exact.kSize; ++i) expected.push_back(exact.component(i));
        REQUIRE(table.rows.at(k).size() == 3 + expected.size());
        REQUIRE(std::equal(expected.begin(), expected.end(), table.rows[k].begin() + 3,
                           [](double a, double b) { return static_cast<float>(a) == static_cast<float>(b); }));
        REQUIRE(table.rows[k].back() == expected.back()); // all digits
    }
}

TEST_CASE("probeField: works in every dimension and names columns after coordinates", "[app]") {
    const Folder folder;
    checkField<double, 2>(noiseField<PerlinNoise<1>>(), "x,value,dx,dxx", folder);
    checkField<double, 2>(noiseField<Psrd2>(), "x,y,value,dx,dy,dxx,dyy,dxy", folder);
    checkField<double, 1>(noiseField<SimplexNoise<4>>(), "x0,x1,x2,x3,value,dx0,dx1,dx2,dx3", folder);
    checkField<double, 2>(noiseField<SimplexNoise<4>>(),
                          "x0,x1,x2,x3,value,dx0,dx1,dx2,dx3,dx0x0,dx1x1,dx2x2,dx3x3,"
                          "dx0x1,dx0x2,dx0x3,dx1x2,dx1x3,dx2x3",
                          folder);
    checkField<float, 1>(noiseField<SimplexNoise<7>>(), "x0,x1,x2,x3,x4,x5,x6,value,dx0,dx1,dx2,dx3,dx4,dx5,dx6",
                         folder);
    CHECK_THROWS_WITH(probeField<double>(noiseField<Psrd2>(), positions<3>(), 0, folder / "no.csv"),
                      ContainsSubstring("2 dimensions") && ContainsSubstring("x,y,z"));
}

TEST_CASE("probeFlow: works in every dimension and omits potentials without tracks", "[app]") {
    const Folder folder;
    const ScalarFieldN<2> f = noiseField<Psrd2>();
    probeFlow<double>(FlowN<2>({f}), positions<2>(), 1, folder / "2.csv");
    const Table table = tableOf(folder / "2.csv");
    CHECK(table.header == "x,y,vx,vy,f");
    for (size_t k = 0; k < table.rows.size(); ++k) {
        const auto jet = f.at<1>(points<2>()[k]);
        CAPTURE(k);
        REQUIRE(std::vector<double>(table.rows[k].begin() + 2, table.rows[k].end()) ==
                std::vector<double>{jet.gradient[1], -jet.gradient[0], jet.value});
    }
    const auto noise = [](uint64_t seed) { return noiseField<SimplexNoise<4>>({.seed = seed}); };
    probeFlow<double>(FlowN<4>({noise(1), noise(2), noise(3)}), positions<4>(), 2, folder / "4.csv");
    CHECK(tableOf(folder / "4.csv").header ==
          "x0,x1,x2,x3,v0,v1,v2,v3,f0,f1,f2,dv0_dx0,dv0_dx1,dv0_dx2,dv0_dx3,dv1_dx0,dv1_dx1,dv1_dx2,dv1_dx3,"
          "dv2_dx0,dv2_dx1,dv2_dx2,dv2_dx3,dv3_dx0,dv3_dx1,dv3_dx2,dv3_dx3");
    probeFlow<double>(curlFlow(std::array{noiseField<Psrd3>(), noiseField<Psrd3>(), noiseField<Psrd3>()}), positions(),
                      1, folder / "3.csv");
    CHECK(tableOf(folder / "3.csv").header == "x,y,z,vx,vy,vz");
}

TEST_CASE("probeField: writes 17 digits for double and 9 for float", "[app]") {
    const Folder folder;
    const ScalarField field = constantField(0.1);
    const Positions p = positionsOf<3>({Vec3d{{0.1, 1 / 3.0, 2}}});
    probeField<double>(field, p, 0, folder / "d.csv");
    CHECK(test::bytesOf(folder / "d.csv") ==
          "x,y,z,value\n0.10000000000000001,0.33333333333333331,2,0.10000000000000001\n");
    probeField<float>(field, p, 0, folder / "f.csv");
    CHECK(test::bytesOf(folder / "f.csv") == "x,y,z,value\n0.10000000000000001,0.33333333333333331,2,0.100000001\n");
}

TEST_CASE("probeFlow: writes velocity and potentials and Jacobian", "[app]") {
    const Folder folder;
    const Flow flow(noiseField<Psrd3>({.seed = 1}), noiseField<Psrd3>({.seed = 2}));
    probeFlow<double>(flow, positions(), 0, folder / "0.csv");
    CHECK(tableOf(folder / "0.csv").header == "x,y,z,vx,vy,vz,f,g");
    probeFlow<double>(flow, positions(), 1, folder / "1.csv");
    CHECK(tableOf(folder / "1.csv").header == "x,y,z,vx,vy,vz,f,g");
    probeFlow<double>(flow, positions(), 2, folder / "2.csv");
    const Table table = tableOf(folder / "2.csv");
    CHECK(table.header == "x,y,z,vx,vy,vz,f,g,dvx_dx,dvx_dy,dvx_dz,dvy_dx,dvy_dy,dvy_dz,dvz_dx,dvz_dy,dvz_dz");
    REQUIRE(table.rows.size() == points().size());
    for (size_t k = 0; k < table.rows.size(); ++k) {
        const FlowSample sample = flow.at(points()[k]);
        std::vector<double> expected{sample.velocity[0], sample.velocity[1], sample.velocity[2], sample.potentials[0],
                                     sample.potentials[1]};
        for (const auto& row : sample.derivative.rows) expected.insert(expected.end(), row.c.begin(), row.c.end());
        CAPTURE(k);
        REQUIRE(std::vector<double>(table.rows[k].begin() + 3, table.rows[k].end()) == expected);
    }
    probeFlow<float>(flow, positions(), 0, folder / "f.csv");
    const Table single = tableOf(folder / "f.csv");
    for (size_t k = 0; k < single.rows.size(); ++k) {
        CAPTURE(k);
        // The tolerances are those that the header of the noise states for float: 1e-4 for values, 5e-4 for gradients
        // below 6.
        REQUIRE(std::abs(single.rows[k][6] - table.rows[k][6]) < 1e-4);
        REQUIRE(std::abs(single.rows[k][3] - table.rows[k][3]) < 4 * 6 * 5e-4);
    }
}

TEST_CASE("readPositions: reads a table of positions", "[app]") {
    const Folder folder;
    store(folder / "a.csv", "x,y,z\r\n1,-2.5,1e3\r\n\r\n+.5,0,-0\n3,4,5");
    const auto read = readPositions(folder / "a.csv");
    REQUIRE(read.size() == 3);
    CHECK(read.at<3>(0) == Vec3d{{1, -2.5, 1000}});
    CHECK(read.at<3>(1) == Vec3d{{0.5, 0, 0}});
    CHECK(read.at<3>(2) == Vec3d{{3, 4, 5}});
    store(folder / "b.csv", "x0,x1,x2,x3,x4,x5,x6\n1,2,3,4,5,6,7\n");
    CHECK(readPositions(folder / "b.csv").at<7>(0)[6] == 7);
    store(folder / "c.csv", "x\n1\n2\n");
    CHECK(readPositions(folder / "c.csv").size() == 2);
    store(folder / "d.csv", "x,y,z,id,vx\n1,2,3,7,0\n4,5,6,8,0\n"); // points
    const auto points = readPositions(folder / "d.csv");
    REQUIRE(points.size() == 2);
    CHECK(points.at<3>(1) == Vec3d{{4, 5, 6}});
}

TEST_CASE("readPositions: an invalid table is refused with its name and line", "[app]") {
    struct Case {
        std::string content, says;
    };
    const auto c = GENERATE(
        Case{"", "empty"}, Case{"x,y,z\n", "no positions"}, Case{"x,y,z", "no positions"},
        Case{"1,2,3\n4,5,6\n", "x,y,z"}, Case{"x;y;z\n1;2;3\n", "x,y,z"}, Case{"x, y, z\n1,2,3\n", "x,y,z"},
        Case{"x,y,z\n1,2,3\nnan,0,0\n", "line 3"}, Case{"x,y,z\n1,2,inf\n", "line 2"}, Case{"x,y,z\n1,2\n", "line 2"},
        Case{"x,y,z\n\n1,2,3,4\n", "line 3"}, Case{"x,y,z\n1,2,1e999\n", "line 2"}, Case{"x,y,z\n1,2,\n", "line 2"},
        Case{"x,y,z\n1,2,3\n4,5", "line 3"}, Case{"y,x\n1,2\n", "x,y,z"}, Case{"x0,x2\n1,2\n", "x,y,z"},
        Case{"x0,x1,x2,x3,x4,x5,x6,x7\n1,2,3,4,5,6,7,8\n", "up to x6"}, Case{"\x89PNG\r\n\x1a\n", "x,y,z"});
    CAPTURE(c.content);
    const Folder folder;
    store(folder / "bad.csv", c.content);
    CHECK_THROWS_AS(readPositions(folder / "bad.csv"), FileError);
    CHECK_THROWS_WITH(readPositions(folder / "bad.csv"), ContainsSubstring("bad.csv") && ContainsSubstring(c.says));
}

TEST_CASE("readPositions: a missing file or a folder is refused", "[app]") {
    const Folder folder;
    CHECK_THROWS_WITH(readPositions(folder / "none.csv"),
                      ContainsSubstring("none.csv") && ContainsSubstring("no such file"));
    CHECK_THROWS_WITH(readPositions(folder / ""), ContainsSubstring("folder"));
}

TEST_CASE("probeField: cancellation leaves no file", "[app]") {
    const Folder folder;
    CHECK_THROWS_AS(probeField<double>(constantField(1), positions(), 0, folder / "out.csv",
                                       {.report = {}, .cancelled = [] { return true; }}),
                    Interrupted);
    CHECK(folder.names().empty());
}

namespace {

/// Returns the greatest difference between the command's -probe and reference rows, at the positions of these rows.
/// Coordinates begin at column `at`, expected values at column `expected`.
double worstOf(const Folder& folder, const std::string& options, int dimensions,
               const std::vector<nlohmann::json>& rows, size_t at, size_t expected, size_t columns, int order) {
    std::string text = test::coordinateHeader(dimensions) + '\n';
    for (const auto& row : rows) {
        for (size_t i = 0; i < static_cast<size_t>(dimensions); ++i)
            text += fmt::format("{}{:.17g}", i ? "," : "", row.at(at + i).get<double>());
        text += '\n';
    }
    store(folder / "in.csv", text);
    folder.mustRun(fmt::format("-noise {} dimensions={} -probe in.csv out.csv order={}", options, dimensions, order));
    const Table table = tableOf(folder / "out.csv");
    REQUIRE(table.rows.size() == rows.size());
    double worst = 0;
    for (size_t k = 0; k < rows.size(); ++k)
        for (size_t i = 0; i < columns; ++i)
            worst = std::max(worst, std::abs(table.rows[k].at(static_cast<size_t>(dimensions) + i) -
                                             rows[k].at(expected + i).get<double>()));
    return worst;
}

/// Returns the rows with a given number in a column, or all rows.
std::vector<nlohmann::json> rowsOf(const nlohmann::json& file, size_t column = 0, std::optional<double> value = {}) {
    std::vector<nlohmann::json> rows;
    for (const auto& row : file.at("rows"))
        if (!value || row.at(column).get<double>() == *value) rows.push_back(row);
    REQUIRE_FALSE(rows.empty());
    return rows;
}

constexpr double kTolerance = 1e-11; // as in PsrdTest: a few hundred rounding errors of arguments up to 1118

} // namespace

TEST_CASE("probe action: psrdnoise in 3D matches published values for every option", "[app][command]") {
    struct Case {
        std::string file, options;
    };
    const auto c =
        GENERATE(Case{"psrdnoise3_axisgrid_rot_p0-0-0_a0.json", ""},
                 Case{"psrdnoise3_axisgrid_rot_p4-6-3_a0.7.json", "period=4,6,3 alpha=0.7"},
                 Case{"psrdnoise3_axisgrid_fastrot_p4-6-3_a0.7.json", "period=4,6,3 alpha=0.7 rotation=fast"},
                 Case{"psrdnoise3_perlingrid_rot_p3-6-9_a2.5.json", "period=3,6,9 alpha=2.5 lattice=perlin"},
                 Case{"psrdnoise3_perlingrid_rot_p4-6-3_a0.7.json", "period=4,6,3 alpha=0.7 lattice=perlin"});
    const Folder folder;
    const auto rows = rowsOf(test::reference(c.file));
    CAPTURE(c.file);
    CHECK(worstOf(folder, c.options, 3, rows, 1, 4, 10, 2) <= kTolerance);
}

TEST_CASE("probe action: psrdnoise in 2D matches published values and an odd period is reported", "[app][command]") {
    const auto file = test::reference("psrdnoise2_p5-4.json");
    const Folder folder;
    for (const double alpha : {0.0, 0.7, 2.5}) {
        std::vector<nlohmann::json> rows;
        for (const auto& row : file.at("rows"))
            if (std::abs(row.at(1).get<double>() - alpha) < 1e-12) rows.push_back(row);
        if (rows.empty()) continue;
        CAPTURE(alpha);
        CHECK(worstOf(folder, fmt::format("alpha={} period=5,4", alpha), 2, rows, 2, 4, 6, 2) <= kTolerance);
    }
    const auto run = folder.run("-noise dimensions=2 period=3,5 -print");
    CHECK(run.status == 0);
    CHECK_THAT(run.err, ContainsSubstring("period of 5 along y tiles only after 10"));
}

TEST_CASE("probe action: value and Perlin noise match published values in every dimension", "[app][command]") {
    const std::string type = GENERATE("value", "perlin");
    const int dimensions = GENERATE(1, 2, 3);
    CAPTURE(type, dimensions);
    const auto file = test::reference(fmt::format("catlike_{}{}.json", type, dimensions));
    const Folder folder;
    const auto n = static_cast<size_t>(dimensions);
    for (const double frequency : {0.375, 1.0, 2.5})
        CHECK(worstOf(folder, fmt::format("type={} frequency={}", type, frequency), dimensions,
                      rowsOf(file, 1, frequency), 2, 2 + n, 1 + n, 1) <= kTolerance);
    if (type == "perlin" && dimensions == 3)
        CHECK(worstOf(folder, "type=perlin gradients=reference", 3,
                      rowsOf(test::reference("perlin_improved_reference3.json")), 1, 4, 4, 1) <= kTolerance);
}

TEST_CASE("probe action: simplex noise matches published values in every dimension", "[app][command]") {
    const int dimensions = GENERATE(2, 3, 4, 5, 6, 7);
    CAPTURE(dimensions);
    const auto file = test::reference(fmt::format("macomber_simplex{}.json", dimensions));
    const Folder folder;
    const auto n = static_cast<size_t>(dimensions);
    const auto rows = rowsOf(file);
    CHECK(worstOf(folder, "type=simplex kernel=published", dimensions, rows, 1, 1 + n, 1 + n, 1) <= kTolerance);
    CHECK(worstOf(folder, "type=simplex kernel=published-continuous", dimensions, rows, 1, 2 + 2 * n, 1 + n, 1) <=
          kTolerance);
}
