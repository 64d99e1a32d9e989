// SPDX-License-Identifier: Apache-2.0
#include "curlew/base/Error.h"
#include "curlew/base/Parallel.h"
#include "curlew/base/Random.h"
#include "curlew/vdb/CurveFile.h"
#include "curlew/vdb/Openvdb.h"
#include "curlew/vdb/PointFile.h"
#include "curlew/vdb/VdbFile.h"
#include "support/Catch.h"
#include "support/Files.h"

#include <openvdb/points/PointAttribute.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>
#include <limits>
#include <sstream>
#include <string_view>

using namespace curlew;
using Catch::Matchers::ContainsSubstring;
using test::bytesOf;
using Folder = test::ScratchFolder;

namespace {

/// Returns curves with the given numbers of vertices at random positions. Every other curve is closed.
Curves curvesOf(const std::vector<size_t>& sizes, bool track = true) {
    Curves c;
    const auto number = [&](uint64_t stream) { return 2 * randomUniform(5, c.x.size(), stream) - 1; };
    for (const size_t size : sizes) {
        const size_t k = c.size();
        for (size_t v = 0; v < size; ++v) {
            c.vx.push_back(static_cast<float>(number(3)));
            c.vy.push_back(static_cast<float>(number(4)));
            c.vz.push_back(static_cast<float>(number(5)));
            if (track) c.f.push_back(number(6)), c.g.push_back(number(7));
            c.along.push_back(0.25 * static_cast<double>(v));
            c.y.push_back(number(1)), c.z.push_back(number(2)), c.x.push_back(number(0));
        }
        c.start.push_back(c.x.size());
        c.id.push_back(static_cast<int64_t>(1000 - 7 * k));
        const auto end = k % 2 ? CurveEnd::closed : CurveEnd::limit;
        c.upstream.push_back(end), c.downstream.push_back(end);
        c.length.push_back(1), c.gap.push_back(0);
    }
    return c;
}

/// A few curves of each kind: open, closed, empty, and with a single vertex.
Curves few(bool track = true) { return curvesOf({4, 3, 0, 0, 1, 5}, track); }

template <class T>
T valueAt(const std::string& bytes, size_t offset) {
    T value;
    std::memcpy(&value, &bytes.at(offset), sizeof value);
    return value;
}

} // namespace

TEST_CASE("CurveFile: PLY stores vertices with attributes and edges", "[vdb]") {
    const Folder folder;
    const bool track = GENERATE(true, false);
    Curves c = few(track);
    if (!track) c.by = StepBy::time;
    writePly(folder / "a.ply", c);
    const std::string bytes = bytesOf(folder / "a.ply"), end = "end_header\n";
    const size_t body = bytes.find(end) + end.size();
    CHECK(bytes.substr(0, body) ==
          std::string("ply\nformat binary_little_endian 1.0\nelement vertex 13\nproperty float x\nproperty float y\n"
                      "property float z\nproperty float speed\n") +
              (track ? "property float f\nproperty float g\nproperty float length\n" : "property float time\n") +
              "property int curve\nelement edge 11\nproperty int vertex1\nproperty int vertex2\nend_header\n");
    const size_t record = track ? 32 : 24;
    REQUIRE(bytes.size() == body + 13 * record + 11 * 8);
    for (size_t k = 0, v = 0; k < c.size(); ++k)
        for (; v < c.start[k + 1]; ++v) {
            CAPTURE(k, v);
            std::vector<double> values{c.x[v], c.y[v], c.z[v], std::hypot(c.vx[v], c.vy[v], c.vz[v])};
            if (track) values.insert(values.end(), {c.f[v], c.g[v]});
            values.push_back(c.along[v]);
            for (size_t n = 0; n < values.size(); ++n)
                CHECK(valueAt<float>(bytes, body + v * record + 4 * n) == Approx(values[n]).epsilon(1e-6));
            CHECK(valueAt<int32_t>(bytes, body + (v + 1) * record - 4) == c.id[k]);
        }
    const std::vector<std::pair<int, int>> edges{{0, 1}, {1, 2},  {2, 3},   {4, 5},   {5, 6}, {6, 4},
                                                 {8, 9}, {9, 10}, {10, 11}, {11, 12}, {12, 8}};
    for (size_t e = 0; e < edges.size(); ++e) {
        CAPTURE(e);
        CHECK(valueAt<int32_t>(bytes, body + 13 * record + 8 * e) == edges[e].first);
        CHECK(valueAt<int32_t>(bytes, body + 13 * record + 8 * e + 4) == edges[e].second);
    }
}

TEST_CASE("CurveFile: OBJ stores polylines", "[vdb]") {
    const Folder folder;
    const Curves c = few();
    writeObj(folder / "a.obj", c);
    std::istringstream lines(bytesOf(folder / "a.obj"));
    std::string line, rest;
    for (size_t v = 0; v < c.vertices(); ++v) {
        std::getline(lines, line);
        std::istringstream words(line);
        std::string key;
        double x = 0, y = 0, z = 0;
        words >> key >> x >> y >> z;
        CHECK(key == "v");
        CHECK(x == Approx(c.x[v]).margin(1e-9));
        CHECK(y == Approx(c.y[v]).margin(1e-9));
        CHECK(z == Approx(c.z[v]).margin(1e-9));
    }
    while (std::getline(lines, line)) rest += line + "\n";
    CHECK(rest == "l 1 2 3 4\nl 5 6 7 5\np 8\nl 9 10 11 12 13 9\n");
}

TEST_CASE("readCurves: the edges of a PLY give back the curves that were written", "[vdb]") {
    const Folder folder;
    const Curves c = curvesOf({4, 3, 6, 2, 7}); // every other one is closed; that of two vertices is read as open
    writePly(folder / "a.ply", c);
    CHECK(contentOfPly(folder / "a.ply") == PlyContent::curves);
    CHECK(holdsCurves(folder / "a.ply"));
    const Curves back = readCurves(folder / "a.ply");
    // Open curves come first.
    std::vector<size_t> order;
    for (const bool closed : {false, true})
        for (size_t k = 0; k < c.size(); ++k)
            if (c.closed(k) == closed) order.push_back(k);
    REQUIRE(back.size() == order.size());
    for (size_t n = 0; n < order.size(); ++n) {
        const size_t k = order[n], size = c.start[k + 1] - c.start[k];
        CAPTURE(n, k);
        CHECK(back.id[n] == c.id[k]);
        CHECK(back.closed(n) == (c.closed(k) && size > 2));
        REQUIRE(back.start[n + 1] - back.start[n] == size);
        for (size_t v = 0; v < size; ++v) {
            CHECK(back.x[back.start[n] + v] == static_cast<double>(static_cast<float>(c.x[c.start[k] + v])));
            CHECK(back.z[back.start[n] + v] == static_cast<double>(static_cast<float>(c.z[c.start[k] + v])));
        }
    }
}

TEST_CASE("readCurves: edges of a PLY in any order are joined where two meet", "[vdb]") {
    const Folder folder;
    const auto file = [&](const std::string& edges) {
        const auto count = std::count(edges.begin(), edges.end(), '\n');
        std::ofstream(folder / "a.ply") << "ply\nformat ascii 1.0\nelement edge " << count
                                        << "\nproperty int vertex2\nproperty int vertex1\nproperty uchar sharp\n"
                                           "element vertex 7\nproperty float x\nproperty float y\nproperty float z\n"
                                           "end_header\n"
                                        << edges << "0 0 0\n1 0 0\n2 0 0\n3 0 0\n4 0 0\n5 0 0\n6 0 0\n";
        return folder / "a.ply";
    };
    const auto xs = [&](const std::string& edges) {
        const Curves c = readCurves(file(edges));
        std::string text;
        for (size_t k = 0; k < c.size(); ++k) {
            for (size_t v = c.start[k]; v < c.start[k + 1]; ++v) text += std::to_string(int(c.x[v])) + ' ';
            text += c.closed(k) ? "closed, " : "open, ";
        }
        return text;
    };
    // A line of the file gives vertex2 and vertex1.
    CHECK(xs("3 2 0\n1 0 0\n2 1 0\n") == "0 1 2 3 open, ");
    CHECK(xs("0 1 0\n2 3 0\n1 2 0\n") == "3 2 1 0 open, "); // against the vertices' order, as the edges run
    CHECK(xs("1 0 0\n1 2 0\n") == "0 1 2 open, ");          // the edges disagree: from the end of the first
    CHECK(xs("2 1 0\n1 3 0\n3 2 0\n") == "1 2 3 closed, ");
    CHECK(xs("1 0 0\n2 1 0\n3 1 0\n5 4 0\n") == "0 1 open, 1 2 open, 1 3 open, 4 5 open, ");
    CHECK(xs("1 0 0\n2 1 0\n3 2 0\n1 3 0\n") == "0 1 open, 1 2 3 closed, "); // a loop at a branching
    CHECK(xs("1 0 0\n0 1 0\n") == "0 1 open, ");                             // the same edge twice
    CHECK_THROWS_WITH(readCurves(file("2 2 0\n")), ContainsSubstring("edge 0 joins vertex 2 to itself"));
    CHECK_THROWS_WITH(
        readCurves(file("7 2 0\n")),
        ContainsSubstring("as curves") && ContainsSubstring("an edge with vertex 7, but only points 0 to 6"));
    CHECK_THROWS_WITH(readCurves(file("")), ContainsSubstring("no curves"));
    std::string damaged = bytesOf(file("1 0 0\n"));
    std::ofstream(folder / "b.ply") << damaged.replace(damaged.rfind("6 0 0"), 1, "nan");
    CHECK(readCurves(folder / "b.ply").size() == 1); // no edge uses that vertex
    std::ofstream(folder / "b.ply") << damaged.replace(damaged.rfind("1 0 0"), 1, "nan");
    CHECK_THROWS_WITH(readCurves(folder / "b.ply"), ContainsSubstring("vertex 1") && ContainsSubstring("finite"));
    std::ofstream(folder / "c.ply") << "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n"
                                       "property float z\nelement edge 1\nproperty int vertex1\nend_header\n0 0 0\n0\n";
    CHECK_THROWS_WITH(readCurves(folder / "c.ply"), ContainsSubstring("no edge property vertex2"));
}

TEST_CASE("CurveFile: CSV stores every number exactly", "[vdb]") {
    const Folder folder;
    const bool track = GENERATE(true, false);
    const Curves c = few(track);
    writeCsv(folder / "a.csv", c);
    std::istringstream lines(bytesOf(folder / "a.csv"));
    std::string line;
    std::getline(lines, line);
    CHECK(line == (track ? "curve,vertex,closed,x,y,z,vx,vy,vz,speed,f,g,length"
                         : "curve,vertex,closed,x,y,z,vx,vy,vz,speed,length"));
    for (size_t k = 0, v = 0; k < c.size(); ++k)
        for (; v < c.start[k + 1]; ++v) {
            REQUIRE(std::getline(lines, line));
            CAPTURE(k, v, line);
            std::istringstream cells(line);
            std::vector<double> values;
            for (std::string cell; std::getline(cells, cell, ',');) values.push_back(std::stod(cell));
            REQUIRE(values.size() == (track ? 13 : 11));
            CHECK(values[0] == static_cast<double>(c.id[k]));
            CHECK(values[1] == static_cast<double>(v - c.start[k]));
            CHECK(values[2] == c.closed(k));
            CHECK(values[3] == c.x[v]);
            CHECK(values[5] == c.z[v]);
            CHECK(static_cast<float>(values[7]) == c.vy[v]);
            CHECK(static_cast<float>(values[9]) == c.speed(v));
            if (track) CHECK(values[11] == c.g[v]);
            CHECK(values.back() == c.along[v]);
        }
    CHECK_FALSE(std::getline(lines, line));
}

TEST_CASE("CurveFile: vdb points carry the attributes of curve vertices", "[vdb]") {
    namespace points = openvdb::points;
    const Folder folder;
    const Curves c = curvesOf({3000, 1, 0, 2000});
    writeVdb(folder / "a.vdb", {pointGrid(c, {.name = "lines"})});
    const auto grid = openvdb::gridPtrCast<points::PointDataGrid>(readVdb(folder / "a.vdb").at(0));
    REQUIRE(grid);
    CHECK(grid->getName() == "lines");
    const Points back = pointsOf(*grid); // sorted by id, which is the index of the vertex
    REQUIRE(back.size() == c.vertices());
    std::vector<size_t> owner(c.vertices());
    for (size_t k = 0; k < c.size(); ++k)
        for (size_t v = c.start[k]; v < c.start[k + 1]; ++v) owner[v] = k;
    const double tolerance = grid->voxelSize()[0] * 0x1p-25 + 1e-15;
    for (size_t v = 0; v < back.size(); ++v) {
        CAPTURE(v);
        REQUIRE(back.id[v] == static_cast<int64_t>(v));
        REQUIRE(std::abs(back.x[v] - c.x[v]) <= tolerance);
        REQUIRE(back.vz[v] == c.vz[v]);
    }
    size_t seen = 0, wrong = 0;
    for (auto leaf = grid->tree().cbeginLeaf(); leaf; ++leaf) {
        const points::AttributeHandle<int32_t> id(leaf->constAttributeArray("id")),
            curve(leaf->constAttributeArray("curve")), vertex(leaf->constAttributeArray("vertex")),
            closed(leaf->constAttributeArray("closed"));
        const points::AttributeHandle<float> speed(leaf->constAttributeArray("speed")),
            f(leaf->constAttributeArray("f")), g(leaf->constAttributeArray("g")),
            length(leaf->constAttributeArray("length"));
        for (openvdb::Index n = 0; n < id.size(); ++n, ++seen) {
            const auto v = static_cast<size_t>(id.get(n));
            const size_t k = owner[v];
            wrong += curve.get(n) != c.id[k] || vertex.get(n) != static_cast<int32_t>(v - c.start[k]) ||
                     closed.get(n) != c.closed(k) || speed.get(n) != c.speed(v) ||
                     f.get(n) != static_cast<float>(c.f[v]) || g.get(n) != static_cast<float>(c.g[v]) ||
                     length.get(n) != static_cast<float>(c.along[v]);
        }
    }
    CHECK(seen == c.vertices());
    CHECK(wrong == 0);
}

TEST_CASE("CurveFile: every format accepts empty curves", "[vdb]") {
    const Folder folder;
    const Curves none;
    writePly(folder / "a.ply", none);
    CHECK_THAT(bytesOf(folder / "a.ply"),
               ContainsSubstring("element vertex 0\n") && ContainsSubstring("element edge 0\n"));
    writeObj(folder / "a.obj", none);
    CHECK(bytesOf(folder / "a.obj").empty());
    writeCsv(folder / "a.csv", none);
    CHECK(test::bytesOf(folder / "a.csv") == "curve,vertex,closed,x,y,z,vx,vy,vz,speed,length\n");
    CHECK(pointsOf(*pointGrid(none)).size() == 0);
}

TEST_CASE("CurveFile: bytes do not depend on the number of threads", "[vdb]") {
    const Folder folder;
    const Curves c = curvesOf({70000, 3, 30000});
    for (const int threads : {1, 2, 7}) {
        const ThreadLimit limit(threads);
        const std::string name = std::to_string(threads);
        writePly(folder / (name + ".ply"), c);
        writeObj(folder / (name + ".obj"), c);
        writeCsv(folder / (name + ".csv"), c);
        writeVdb(folder / (name + ".vdb"), {pointGrid(c)});
    }
    for (const std::string extension : {".ply", ".obj", ".csv", ".vdb"}) {
        CAPTURE(extension);
        const std::string one = bytesOf(folder / ("1" + extension));
        CHECK((one == bytesOf(folder / ("2" + extension))));
        CHECK((one == bytesOf(folder / ("7" + extension))));
    }
}

TEST_CASE("CurveFile: invalid curves are refused and leave no file", "[vdb]") {
    const Folder folder;
    Curves big = few();
    big.id[1] = int64_t(1) << 31;
    CHECK_THROWS_WITH(writePly(folder / "a.ply", big), ContainsSubstring("2147483648"));
    CHECK_THROWS_AS(pointGrid(big), ValueError);
    Curves ragged = few();
    ragged.g.pop_back();
    CHECK_THROWS_AS(writePly(folder / "a.ply", ragged), ValueError);
    CHECK_THROWS_AS(writeObj(folder / "a.obj", ragged), ValueError);
    CHECK_THROWS_AS(writeCsv(folder / "a.csv", ragged), ValueError);
    CHECK_THROWS_AS(pointGrid(ragged), ValueError);
    Curves torn = few();
    torn.start[2] = 99;
    CHECK_THROWS_AS(writeObj(folder / "a.obj", torn), ValueError);
    Curves bad = few();
    bad.y[2] = std::numeric_limits<double>::quiet_NaN();
    CHECK_THROWS_AS(pointGrid(bad), ValueError);
    CHECK_THROWS_AS(writePly(folder / "none" / "a.ply", few()), FileError);
    CHECK(folder.files() == 0);
    writeCsv(folder / "a.csv", big); // CSV has no limit for ids
    CHECK_THAT(bytesOf(folder / "a.csv"), ContainsSubstring("\n2147483648,2,1,"));
}

TEST_CASE("readCurves: an OBJ may have continued lines and any line ends", "[vdb]") {
    const Folder folder;
    const std::string points = "v 0 0 0\nv 1 0 0\nv 2 0 0\n";
    for (const std::string lines : {"l 1 2 3\n", "l 1 \\\n2\\\n 3\n", "# a folder\\\nl 1 2 3\n"})
        for (const char* end : {"\n", "\r\n", "\r"}) {
            std::string text = points + lines;
            if (end == std::string_view("\r") && lines.find('\\') != std::string::npos) continue;
            for (size_t at = text.find('\n'); at != std::string::npos; at = text.find('\n', at + std::strlen(end)))
                text.replace(at, 1, end);
            CAPTURE(text);
            test::store(folder / "a.obj", text);
            CHECK(holdsCurves(folder / "a.obj"));
            const Curves c = readCurves(folder / "a.obj");
            REQUIRE(c.vertices() == 3);
            CHECK(c.x[2] == 2);
        }
}

TEST_CASE("readCurves: the edges of an OBJ are joined where two meet", "[vdb]") {
    const Folder folder;
    const std::string points = "v 0 0 0\nv 1 0 0\nv 2 0 0\nv 0 1 0\nv 1 1 0\nv 1 2 0\nv 7 7 7\n";
    test::store(folder / "edges.obj", points + "l 2 3\nl 1 2\nl 4 5\nl 5 6\nl 6 4\n");
    const Curves edges = readCurves(folder / "edges.obj");
    REQUIRE(edges.size() == 2);
    CHECK(edges.x == std::vector<double>{0, 1, 2, 0, 1, 1});
    CHECK(edges.downstream[0] != CurveEnd::closed);
    CHECK(edges.downstream[1] == CurveEnd::closed);
    // Beside a longer line, one of two vertices is a curve of its own.
    test::store(folder / "lines.obj", points + "l 1 2\nl 2 3\nl 4 5 6\n");
    CHECK(readCurves(folder / "lines.obj").size() == 3);
    test::store(folder / "point.obj", points + "l 1 2\nl 3 3\n");
    CHECK_THROWS_WITH(readCurves(folder / "point.obj"), ContainsSubstring("point.obj"));
}
