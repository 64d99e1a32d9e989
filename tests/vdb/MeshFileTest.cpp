// SPDX-License-Identifier: Apache-2.0
// Longer than 400 lines: three formats, each with its variants and its damaged files.
#include "curlew/base/Error.h"
#include "curlew/vdb/MeshFile.h"
#include "curlew/vdb/Openvdb.h"
#include "support/Catch.h"
#include "support/Files.h"
#include "support/Meshes.h"
#include "support/Places.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <fstream>
#include <iterator>
#include <limits>
#include <numbers>
#include <numeric>
#include <random>
#include <set>

using namespace curlew;
using Catch::Matchers::ContainsSubstring;
namespace fs = std::filesystem;
using test::bytesOf;
using Folder = test::ScratchFolder;
using test::store;

namespace {

/// A closed box with 8 points and 6 quads that face outwards.
constexpr std::array<std::array<int, 4>, 6> kBox{
    {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}}};

std::array<float, 3> corner(int n) { return {n & 1 ? 2.0f : -0.5f, n & 2 ? 1.0f : 0.0f, n & 4 ? 3.0f : 0.25f}; }

std::string objPoints() {
    std::string text = "# a box\nmtllib none.mtl\no box\n";
    for (int n = 0; n < 8; ++n) text += fmt::format("v {} {} {}\n", corner(n)[0], corner(n)[1], corner(n)[2]);
    return text;
}

std::string objBox() {
    std::string text = objPoints();
    for (const auto& q : kBox) text += fmt::format("f {} {} {} {}\n", q[0] + 1, q[1] + 1, q[2] + 1, q[3] + 1);
    return text;
}

template <typename T>
void append(std::string& bytes, T value, bool bigEndian = false) {
    char raw[sizeof value];
    std::memcpy(raw, &value, sizeof value);
    if (bigEndian) std::reverse(raw, raw + sizeof value);
    bytes.append(raw, sizeof value);
}

std::string plyHead(const std::string& format) {
    return "ply\nformat " + format +
           " 1.0\ncomment a box\nelement vertex 8\nproperty float x\nproperty float y\nproperty float z\n"
           "element face 6\nproperty list uchar int vertex_indices\nend_header\n";
}

std::string plyBox(const std::string& format) {
    std::string bytes = plyHead(format);
    const bool text = format == "ascii", big = format == "binary_big_endian";
    for (int n = 0; n < 8; ++n) {
        if (text) bytes += fmt::format("{} {} {}\n", corner(n)[0], corner(n)[1], corner(n)[2]);
        for (int axis = 0; axis < 3 && !text; ++axis) append(bytes, corner(n)[size_t(axis)], big);
    }
    for (const auto& q : kBox) {
        if (text) bytes += fmt::format("4 {} {} {} {}\n", q[0], q[1], q[2], q[3]);
        if (!text) append(bytes, uint8_t(4));
        for (int k = 0; k < 4 && !text; ++k) append(bytes, q[size_t(k)], big);
    }
    return bytes;
}

std::string stlBox(bool text) {
    std::string bytes = text ? "solid box\n" : std::string(80, 's');
    if (!text) append(bytes, uint32_t(12));
    for (const auto& q : kBox) {
        for (const auto& t : {std::array{q[0], q[1], q[2]}, std::array{q[0], q[2], q[3]}}) {
            if (text) bytes += "facet normal 0 0 0\n outer loop\n";
            for (int k = 0; k < 3 && !text; ++k) append(bytes, 0.0f);
            for (const int n : t) {
                if (text) bytes += fmt::format("  vertex {} {} {}\n", corner(n)[0], corner(n)[1], corner(n)[2]);
                for (int axis = 0; axis < 3 && !text; ++axis) append(bytes, corner(n)[size_t(axis)]);
            }
            bytes += text ? " endloop\nendfacet\n" : std::string(2, '\0');
        }
    }
    return text ? bytes + "endsolid box\n" : bytes;
}

double volumeOf(const Mesh& mesh) {
    double six = 0;
    const auto add = [&](uint32_t i, uint32_t j, uint32_t k) {
        const openvdb::Vec3d a(mesh.points[i]), b(mesh.points[j]), c(mesh.points[k]);
        six += a.dot(b.cross(c));
    };
    for (const auto& t : mesh.triangles) add(t[0], t[1], t[2]);
    for (const auto& q : mesh.quads) add(q[0], q[1], q[2]), add(q[0], q[2], q[3]);
    return six / 6;
}

void requireBox(const Mesh& mesh) {
    const MeshTopology topology = topologyOf(mesh);
    CHECK(mesh.points.size() == 8);
    CHECK(mesh.triangles.size() + 2 * mesh.quads.size() == 12);
    CHECK(topology.closed());
    CHECK(topology.nonManifoldEdges == 0);
    CHECK(topology.degenerateFaces == 0);
    CHECK(volumeOf(mesh) == Approx(2.5 * 1 * 2.75)); // the faces keep their orientation, position and number
}

std::string box(const std::string& kind) {
    if (kind == "box.obj") return objBox();
    if (kind == "text.stl") return stlBox(true);
    if (kind == "binary.stl") return stlBox(false);
    return plyBox(kind.substr(0, kind.find('.')));
}

const std::vector<std::string> kKinds{"box.obj",  "ascii.ply", "binary_little_endian.ply", "binary_big_endian.ply",
                                      "text.stl", "binary.stl"};

/// Returns the error message of readMesh for a file with this name and content.
std::string errorOf(const Folder& folder, const std::string& name, const std::string& content) {
    try {
        readMesh(store(folder / name, content));
    } catch (const FileError& error) {
        CHECK_THAT(error.what(), ContainsSubstring(name) && !ContainsSubstring("\n"));
        return error.what();
    }
    return "no error";
}

} // namespace

TEST_CASE("MeshFile: reads a box from every format", "[vdb]") {
    const Folder folder;
    for (const std::string& kind : kKinds) {
        CAPTURE(kind);
        const Mesh mesh = readMesh(store(folder / kind, box(kind)));
        requireBox(mesh);
        CHECK(mesh.quads.size() == (kind.ends_with(".stl") ? 0 : 6));
    }
    requireBox(readMesh(store(folder / "LOUD.OBJ", objBox())));
}

TEST_CASE("MeshFile: OBJ seams and groups and colours and line endings do not split the mesh", "[vdb]") {
    const Folder folder;
    std::string seams = objPoints() + "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nvn 0 0 1\nvn 1 0 0\n";
    int face = 0;
    for (const auto& q : kBox) {
        seams += fmt::format("g side{}\nusemtl m{}\ns {}\n", face, face, face);
        seams += fmt::format("f {}/1/{n} {}/2/{n} {}/3/{n} {}/4/{n}\n", q[0] + 1, q[1] + 1, q[2] + 1, q[3] + 1,
                             fmt::arg("n", 1 + face++ % 2));
    }
    requireBox(readMesh(store(folder / "seams.obj", seams)));

    std::string windows = objBox();
    for (size_t at = 0; (at = windows.find('\n', at)) != std::string::npos; at += 2) windows.insert(at, 1, '\r');
    requireBox(readMesh(store(folder / "windows.obj", windows)));
    std::string old = objBox();
    std::replace(old.begin(), old.end(), '\n', '\r');
    requireBox(readMesh(store(folder / "old.obj", old)));
    std::string continued = objBox();
    continued.insert(continued.find("f ") + 4, "\\\n");
    requireBox(readMesh(store(folder / "continued.obj", continued)));

    std::string indented = objBox();
    for (size_t at = 0; (at = indented.find('\n', at)) != std::string::npos; at += 3) indented.insert(at + 1, " \t");
    requireBox(readMesh(store(folder / "indented.obj", indented)));

    std::string fancy, relative;
    for (int n = 0; n < 8; ++n) {
        const auto p = corner(n);
        fancy += fmt::format("v {} {} {} 2\n", 2 * p[0], 2 * p[1], 2 * p[2]);
        relative += fmt::format("v {} {} {} 1 0.5 0\n", p[0], p[1], p[2]);
    }
    for (const auto& q : kBox) {
        fancy += fmt::format("f {} {} {} {} # a side\n", q[0] + 1, q[1] + 1, q[2] + 1, q[3] + 1);
        relative += fmt::format("f {} {} {} {}\n", q[0] - 8, q[1] - 8, q[2] - 8, q[3] - 8);
    }
    requireBox(readMesh(store(folder / "weights.obj", fancy)));
    requireBox(readMesh(store(folder / "colours.obj", relative)));
}

TEST_CASE("MeshFile: polygons with more than four vertices become triangles and quads stay", "[vdb]") {
    const Folder folder;
    // An L-shaped prism: two concave hexagons and six quads.
    const std::array<std::array<int, 2>, 6> outline{{{0, 0}, {2, 0}, {2, 1}, {1, 1}, {1, 2}, {0, 2}}};
    std::string text;
    for (int z = 0; z < 2; ++z)
        for (const auto& p : outline) text += fmt::format("v {} {} {}\n", p[0], p[1], z);
    text += "f 6 5 4 3 2 1\nf 7 8 9 10 11 12\n";
    for (int n = 0; n < 6; ++n) text += fmt::format("f {} {} {} {}\n", n + 1, (n + 1) % 6 + 1, (n + 1) % 6 + 7, n + 7);
    const Mesh mesh = readMesh(store(folder / "prism.obj", text));
    CHECK(mesh.points.size() == 12);
    CHECK(mesh.quads.size() == 6);
    CHECK(mesh.triangles.size() == 8);
    CHECK(topologyOf(mesh).closed());
    CHECK(volumeOf(mesh) == Approx(3));
}

TEST_CASE("MeshFile: the triangles of a polygon cover it exactly once", "[vdb]") {
    std::mt19937 random(3);
    std::uniform_real_distribution<float> radius(0.3f, 1.5f);
    for (int run = 0; run < 50; ++run) {
        // A star-shaped polygon around the origin in a tilted plane, and quads that share its corners.
        const auto corners = size_t(5 + run);
        const openvdb::Vec3d u(0.6, 0, 0.8), v(0.48, 0.8, -0.36);
        std::vector<openvdb::Vec3s> points;
        for (size_t k = 0; k < corners; ++k) {
            const double t = 2 * M_PI * double(k) / double(corners);
            points.emplace_back(double(radius(random)) * (std::cos(t) * u + std::sin(t) * v));
        }
        double area = 0;
        for (size_t k = 0; k < corners; ++k)
            area += openvdb::Vec3d(points[k]).cross(openvdb::Vec3d(points[(k + 1) % corners])).length() / 2;
        std::vector<uint32_t> indices(corners), sizes{uint32_t(corners), 4, 4};
        std::iota(indices.begin(), indices.end(), 0u);
        for (const uint32_t corner : {0u, 1u, 2u, 3u, 0u, 2u, 3u, 4u}) indices.push_back(corner);
        CAPTURE(corners);
        const Mesh mesh = meshOf(points, indices, sizes);
        REQUIRE(mesh.triangles.size() == corners - 2);
        REQUIRE(mesh.quads == std::vector<openvdb::Vec4I>{{0, 1, 2, 3}, {0, 2, 3, 4}});
        double covered = 0;
        const openvdb::Vec3d normal = u.cross(v);
        for (const auto& t : mesh.triangles) {
            const openvdb::Vec3d a(mesh.points[t[0]]), b(mesh.points[t[1]]), c(mesh.points[t[2]]);
            const double signedArea = (b - a).cross(c - a).dot(normal) / 2;
            REQUIRE(signedArea > -1e-6); // positions are floats
            covered += signedArea;
        }
        CHECK(covered == Approx(area).epsilon(1e-6));
    }
}

TEST_CASE("MeshFile: concave polygons with vertices on their diagonals are covered exactly once", "[vdb]") {
    using Outline = std::vector<std::array<float, 2>>;
    const Outline tee{{0, 0}, {3, 0}, {3, 1}, {2, 1}, {2, 3}, {1, 3}, {1, 1}, {0, 1}};
    const Outline stairs{{0, 0}, {4, 0}, {4, 1}, {3, 1}, {3, 2}, {2, 2}, {2, 3}, {1, 3}, {1, 4}, {0, 4}};
    const Outline plus{{1, 0}, {2, 0}, {2, 1}, {3, 1}, {3, 2}, {2, 2}, {2, 3}, {1, 3}, {1, 2}, {0, 2}, {0, 1}, {1, 1}};
    const Outline split{{0, 0}, {1, 0}, {2, 0}, {3, 0}, {3, 1}, {2, 1}, {1, 1}, {0, 1}}; // straight sides in parts
    for (const auto& [outline, area] :
         {std::pair(tee, 5.0), std::pair(stairs, 10.0), std::pair(plus, 5.0), std::pair(split, 3.0)})
        for (size_t first = 0; first < outline.size(); ++first) {
            std::vector<openvdb::Vec3s> points;
            std::vector<uint32_t> corners;
            for (size_t k = 0; k < outline.size(); ++k) {
                const auto& p = outline[(first + k) % outline.size()];
                points.emplace_back(p[0], p[1], 0);
                corners.push_back(static_cast<uint32_t>(k));
            }
            const Mesh mesh = meshOf(points, corners, {static_cast<uint32_t>(outline.size())});
            double covered = 0;
            CAPTURE(area, first);
            for (const auto& t : mesh.triangles) {
                const openvdb::Vec3d a(mesh.points[t[0]]), b(mesh.points[t[1]]), c(mesh.points[t[2]]);
                const double signedArea = (b - a).cross(c - a).z() / 2;
                CHECK(signedArea >= 0);
                covered += signedArea;
            }
            CHECK(covered == area);
        }
}

TEST_CASE("MeshFile: a self-intersecting polygon still closes the mesh", "[vdb]") {
    // A pentagram above a fan of triangles with the same border.
    std::vector<openvdb::Vec3s> points;
    for (int k = 0; k < 5; ++k) points.emplace_back(std::cos(0.8 * M_PI * k), std::sin(0.8 * M_PI * k), 0.0);
    points.emplace_back(0, 0, -1);
    std::vector<uint32_t> corners{0, 1, 2, 3, 4}, sizes{5, 3, 3, 3, 3, 3};
    for (uint32_t k = 0; k < 5; ++k) corners.insert(corners.end(), {(k + 1) % 5, k, 5});
    CHECK(topologyOf(meshOf(points, corners, sizes)).closed());
}

TEST_CASE("MeshFile: numbers in text may use any notation", "[vdb]") {
    const Folder folder;
    const std::string text =
        "v .5 -0.25e+1 +3\nv 1. 1E-2 12345678901234567890123\nv 1e-50 -0 0.1234567890123456789\nf 1 2 3\n";
    const Mesh mesh = readMesh(store(folder / "forms.obj", text));
    CHECK(mesh.points ==
          std::vector<openvdb::Vec3s>{{0.5f, -2.5f, 3}, {1, 0.01f, 12345678901234567890123.0f}, {0, 0, 0.12345679f}});
    for (const std::string word : {".", "1e", "1e+", "--1", "1-", "0x10", "1,5", "e5", "in"}) {
        CAPTURE(word);
        CHECK_THAT(errorOf(folder, "a.obj", "v 0 0 " + word + "\n" + objBox()), ContainsSubstring("not a number"));
    }

    // Tolerance: 2 units in the last place from the correctly rounded value.
    std::mt19937 random(4);
    std::string points;
    std::vector<float> expected;
    for (int n = 0; n < 3000; ++n) {
        const float value = std::ldexp(std::uniform_real_distribution<float>(-1, 1)(random), int(random() % 40) - 20);
        const char* format = n % 3 == 0 ? "{:.6f}" : n % 3 == 1 ? "{:.8e}" : "{}";
        const std::string word = fmt::format(fmt::runtime(format), value);
        expected.push_back(std::stof(word));
        points += (n % 3 == 0 ? "v " : " ") + word + (n % 3 == 2 ? "\n" : "");
    }
    for (int n = 1; n <= 1000; ++n) points += fmt::format("f {} {} {}\n", n, n % 1000 + 1, (n + 1) % 1000 + 1);
    const Mesh many = readMesh(store(folder / "many.obj", points));
    REQUIRE(many.points.size() == 1000);
    for (size_t n = 0; n < expected.size(); ++n) {
        const float read = many.points[n / 3][int(n % 3)];
        const float ulp = std::nextafter(std::abs(expected[n]), INFINITY) - std::abs(expected[n]);
        REQUIRE(std::abs(read - expected[n]) <= 2 * ulp);
    }
}

TEST_CASE("MeshFile: PLY skips unknown properties and elements and reads doubles", "[vdb]") {
    const Folder folder;
    for (const std::string format : {"ascii", "binary_little_endian", "binary_big_endian"}) {
        CAPTURE(format);
        const bool text = format == "ascii", big = format == "binary_big_endian";
        std::string bytes = "ply\nformat " + format +
                            " 1.0\nelement camera 1\nproperty short view\nelement vertex 8\nproperty float nx\n"
                            "property double x\nproperty double y\nproperty double z\nproperty uchar red\n"
                            "element face 6\nproperty list uchar float uv\nproperty list uint ushort vertex_index\n"
                            "end_header\n";
        const auto put = [&](auto value) {
            if (text)
                bytes += fmt::format("{} ", value);
            else
                append(bytes, value, big);
        };
        const auto endLine = [&] { bytes += text ? "\n" : ""; };
        put(int16_t(-7)), endLine();
        for (int n = 0; n < 8; ++n) {
            put(0.5f);
            for (const float x : corner(n)) put(double(x));
            put(uint8_t(200)), endLine();
        }
        for (const auto& q : kBox) {
            put(uint8_t(2)), put(0.25f), put(0.75f), put(uint32_t(4));
            for (const int c : q) put(uint16_t(c));
            endLine();
        }
        requireBox(readMesh(store(folder / "more.ply", bytes)));
    }
}

TEST_CASE("MeshFile: arrays give the same mesh as a file", "[vdb]") {
    const Folder folder;
    // A box with one duplicate corner and one unused point; then the same with two quads split into triangles, and with
    // a lid of six corners.
    std::vector<openvdb::Vec3s> points;
    for (int n = 0; n < 8; ++n) points.emplace_back(corner(n)[0], corner(n)[1], corner(n)[2]);
    points.emplace_back(9, 9, 9);
    points.push_back(points[7]);
    using Faces = std::vector<std::vector<uint32_t>>;
    const Faces quads{{0, 2, 3, 1}, {4, 5, 9, 6}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
    Faces mixed(quads.begin() + 2, quads.end()), polygons = quads;
    for (const auto& triangle : Faces{{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}})
        mixed.insert(mixed.begin(), triangle);
    polygons.push_back({0, 1, 5, 7, 6, 2});
    for (const auto& faces : {quads, mixed, polygons}) {
        std::string ply =
            "ply\nformat ascii 1.0\nelement vertex 10\nproperty float x\nproperty float y\nproperty float z\n" +
            fmt::format("element face {}\nproperty list uchar int vertex_indices\nend_header\n", faces.size());
        for (const auto& p : points) ply += fmt::format("{} {} {}\n", p.x(), p.y(), p.z());
        std::vector<uint32_t> corners, sizes;
        for (const auto& face : faces) {
            ply += fmt::format("{} {}\n", face.size(), fmt::join(face, " "));
            corners.insert(corners.end(), face.begin(), face.end());
            sizes.push_back(static_cast<uint32_t>(face.size()));
        }
        const Mesh read = readMesh(store(folder / "mesh.ply", ply)), made = meshOf(points, corners, sizes);
        CHECK(made.points == read.points);
        CHECK(made.triangles == read.triangles);
        CHECK(made.quads == read.quads);
        CHECK(made.points.size() == 8);
    }
}

TEST_CASE("MeshFile: invalid arrays are errors", "[vdb]") {
    const std::vector<openvdb::Vec3s> points{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    CHECK(meshOf(points, {0, 1, 2}, {3}).faces() == 1);
    CHECK_THROWS_WITH(meshOf(points, {}, {}), ContainsSubstring("no faces"));
    CHECK_THROWS_WITH(meshOf(points, {0, 1}, {2}), ContainsSubstring("face 0") && ContainsSubstring("2 corners"));
    CHECK_THROWS_WITH(meshOf(points, {0, 1, 2, 0}, {3}), ContainsSubstring("have 3 corners, but 4"));
    CHECK_THROWS_WITH(meshOf(points, {0, 1, 3}, {3}),
                      ContainsSubstring("corner 2") && ContainsSubstring("there are 3"));
    CHECK_THROWS_AS(meshOf({{0, 0, 0}, {1, NAN, 0}, {0, 1, 0}}, {0, 1, 2}, {3}), ValueError);
}

TEST_CASE("MeshFile: topologyOf reports closed and non-manifold and degenerate meshes", "[vdb]") {
    const Folder folder;
    const std::string whole = objBox();
    const Mesh open = readMesh(store(folder / "open.obj", whole.substr(0, whole.rfind("f "))));
    CHECK(!topologyOf(open).closed());
    CHECK(topologyOf(open).boundaryEdges == 4);
    CHECK(topologyOf(open).faces == 5);
    const MeshTopology fin = topologyOf(readMesh(store(folder / "fin.obj", whole + "f 1 2 8\n")));
    CHECK(fin.nonManifoldEdges == 1);
    CHECK(fin.boundaryEdges == 2);
    const MeshTopology point = topologyOf(readMesh(store(folder / "point.obj", whole + "f 1 1 2\nf 1 2 2 2\n")));
    CHECK(point.degenerateFaces == 2);
    CHECK(point.closed());

    CHECK(!topologyOf(Mesh{}).closed());
    Mesh mesh{.points = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, .triangles = {{0, 0, 1}}, .quads = {}};
    CHECK(!topologyOf(mesh).closed());
    mesh.quads = {{0, 1, 2, 2}, {0, 2, 1, 1}}; // triangles stored as quads, back to back
    CHECK(topologyOf(mesh).closed());
    CHECK(topologyOf(mesh).faces == 2);
}

TEST_CASE("MeshFile: non-finite points are counted in the error", "[vdb]") {
    const Folder folder;
    for (const std::string bad : {"nan", "inf", "-inf", "1e39", "1e999"}) {
        CAPTURE(bad);
        const auto replaced = [&](std::string text) {
            for (int n = 0; n < 2; ++n) text.replace(text.find("-0.5"), 4, bad);
            return text;
        };
        CHECK_THAT(errorOf(folder, "a.obj", replaced(objBox())), ContainsSubstring("2 of its 8 points"));
        CHECK_THAT(errorOf(folder, "a.ply", replaced(plyBox("ascii"))), ContainsSubstring("2 of its 8 points"));
        CHECK_THAT(errorOf(folder, "a.stl", replaced(stlBox(true))), ContainsSubstring("2 of its 36 points"));
    }
    CHECK_THAT(errorOf(folder, "weight.obj", "v 1 2 3 0\n" + objBox()), ContainsSubstring("1 of its 9 points"));
    for (const float bad : {std::numeric_limits<float>::quiet_NaN(), -std::numeric_limits<float>::infinity()}) {
        std::string ply = plyHead("binary_little_endian"), stl = stlBox(false), raw;
        append(raw, bad);
        const size_t head = ply.size();
        ply = plyBox("binary_little_endian");
        CHECK_THAT(errorOf(folder, "b.ply", ply.replace(head + 4, 4, raw)), ContainsSubstring("1 of its 8 points"));
        CHECK_THAT(errorOf(folder, "b.stl", stl.replace(84 + 12, 4, raw)), ContainsSubstring("1 of its 36 points"));
    }
}

TEST_CASE("MeshFile: invalid vertex indices are errors", "[vdb]") {
    const Folder folder;
    for (const std::string face : {"f 1 2 9\n", "f 0 1 2\n", "f 1 2 -9\n", "f 1 2 99999999999\n"}) {
        CAPTURE(face);
        CHECK_THAT(errorOf(folder, "a.obj", objBox() + face),
                   ContainsSubstring("line 18") && ContainsSubstring("vertex"));
    }
    for (const std::string index : {"8", "-1"}) {
        std::string text = plyBox("ascii");
        CHECK_THAT(errorOf(folder, "a.ply", text.replace(text.rfind(' ') + 1, 1, index)),
                   ContainsSubstring("vertex " + index));
    }
    for (const int index : {8, -1, std::numeric_limits<int>::max()}) {
        std::string ply = plyBox("binary_little_endian"), raw;
        append(raw, index);
        CHECK_THAT(errorOf(folder, "b.ply", ply.replace(ply.size() - 4, 4, raw)), ContainsSubstring("vertex"));
    }
}

TEST_CASE("MeshFile: malformed lines and headers are errors", "[vdb]") {
    const Folder folder;
    CHECK_THAT(errorOf(folder, "a.obj", "v 1 2\n" + objBox()),
               ContainsSubstring("line 1 ") && ContainsSubstring("2 numbers"));
    CHECK_THAT(errorOf(folder, "b.obj", "v 1 2 x\n" + objBox()), ContainsSubstring("not a number"));
    CHECK_THAT(errorOf(folder, "c.obj", objBox() + "f 1 2\n"), ContainsSubstring("2 vertices"));
    CHECK_THAT(errorOf(folder, "d.obj", objBox() + "f 1 2 x\n"), ContainsSubstring("not a vertex"));
    std::string flat = plyBox("ascii");
    CHECK_THAT(errorOf(folder, "e.ply", flat.replace(flat.rfind("4 "), std::string::npos, "2 0 1\n")),
               ContainsSubstring("2 vertices"));
    std::string type = plyBox("ascii");
    CHECK_THAT(errorOf(folder, "f.ply", type.replace(type.find("uchar"), 5, "quark")),
               ContainsSubstring("unknown type"));
    std::string count = plyBox("ascii");
    CHECK_THAT(errorOf(folder, "g.ply", count.replace(count.find("vertex 8"), 8, "vertex -8")),
               ContainsSubstring("element"));
    std::string many = plyBox("binary_little_endian");
    CHECK_THAT(errorOf(folder, "h.ply", many.replace(many.find("face 6"), 6, "face 4000000000")),
               ContainsSubstring("cut short"));
}

TEST_CASE("MeshFile: files without a mesh are errors", "[vdb]") {
    const Folder folder;
    const std::string png =
        "\x89PNG\r\n\x1a\n" + std::string("\0\0\0\rIHDR\0\0\1\0\0\0\1\0", 16) + std::string(300, 'x');
    for (const std::string extension : {".obj", ".ply", ".stl"}) {
        CAPTURE(extension);
        REQUIRE_THROWS_WITH(readMesh(folder / ("missing" + extension)), ContainsSubstring("no such file"));
        fs::create_directory(folder / ("folder" + extension));
        REQUIRE_THROWS_WITH(readMesh(folder / ("folder" + extension)), ContainsSubstring("is a folder"));
        CHECK_THAT(errorOf(folder, "empty" + extension, ""), ContainsSubstring("is empty"));
        CHECK_THAT(errorOf(folder, "image" + extension, png), ContainsSubstring("cannot be read as a mesh"));
        CHECK_THAT(errorOf(folder, "noise" + extension, "hello\n"), ContainsSubstring("cannot be read as a mesh"));
    }
    CHECK_THAT(errorOf(folder, "a.txt", objBox()), ContainsSubstring(".obj, .ply or .stl"));
    CHECK_THAT(errorOf(folder, "a", objBox()), ContainsSubstring(".obj, .ply or .stl"));
    for (const std::string& kind : kKinds) // each format with the suffix of another
        for (const std::string extension : {".obj", ".ply", ".stl"})
            if (!kind.ends_with(extension)) CHECK(errorOf(folder, "wrong" + extension, box(kind)) != "no error");
    CHECK_THAT(errorOf(folder, "points.obj", objPoints()), ContainsSubstring("no faces"));
    CHECK_THAT(errorOf(folder, "lines.obj", objPoints() + "l 1 2 3\n"), ContainsSubstring("no faces"));
    CHECK_THAT(errorOf(folder, "points.ply",
                       "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n"
                       "property float z\nend_header\n0 0 0\n"),
               ContainsSubstring("no faces"));
    CHECK_THAT(errorOf(folder, "none.stl", "solid a\nendsolid a\n"), ContainsSubstring("no faces"));
}

TEST_CASE("MeshFile: truncated and corrupted files never crash the reader", "[vdb]") {
    const Folder folder;
    std::mt19937 random(1);
    for (const std::string& kind : kKinds) {
        const std::string whole = box(kind);
        for (size_t size = 1; size + 8 < whole.size(); size += 29) {
            CAPTURE(kind, size);
            const bool noticed = errorOf(folder, kind, whole.substr(0, size)) != "no error";
            const bool hasFace = kind == "box.obj" && whole.substr(0, size).find("f 1 3 4") != std::string::npos;
            REQUIRE((noticed || hasFace));
        }
        for (int n = 0; n < 100; ++n) {
            std::string damaged = whole;
            damaged[random() % whole.size()] = char(random());
            try {
                topologyOf(readMesh(store(folder / kind, damaged)));
            } catch (const FileError&) {
            }
        }
    }
}

TEST_CASE("MeshFile: reads large meshes and meshes of higher genus", "[vdb]") {
    const Folder folder;
    const fs::path spot = fs::path(test::sourceDir()) / "scenes/spot.obj";
    const Mesh cow = readMesh(spot);
    CHECK(cow.points.size() == 2930);
    CHECK(cow.faces() == 5856);
    CHECK(topologyOf(cow).closed());
    CHECK(volumeOf(cow) > 0);

    // A torus of 100 x 100 quads with radii 2 and 1/2. Half of the quads are split into triangles.
    constexpr int kSteps = 100;
    constexpr double kTurn = 2 * std::numbers::pi;
    std::string text;
    const auto vertex = [](int i, int j) { return 1 + (i % kSteps) * kSteps + j % kSteps; };
    for (int k = 0; k < kSteps * kSteps; ++k) {
        const double u = kTurn * (k / kSteps) / kSteps, v = kTurn * (k % kSteps) / kSteps;
        const double radius = 2 + 0.5 * std::cos(v);
        text += fmt::format("v {:.9g} {:.9g} {:.9g}\n", radius * std::cos(u), 0.5 * std::sin(v), -radius * std::sin(u));
    }
    for (int k = 0; k < kSteps * kSteps; ++k) {
        const int i = k / kSteps, j = k % kSteps;
        const std::array q{vertex(i, j), vertex(i + 1, j), vertex(i + 1, j + 1), vertex(i, j + 1)};
        text += k % 2 ? fmt::format("f {} {} {} {}\n", q[0], q[1], q[2], q[3])
                      : fmt::format("f {} {} {}\nf {} {} {}\n", q[0], q[1], q[2], q[0], q[2], q[3]);
    }
    const Mesh torus = readMesh(store(folder / "torus.obj", text));
    CHECK(torus.points.size() == kSteps * kSteps);
    CHECK(torus.faces() == kSteps * kSteps * 3 / 2);
    CHECK(topologyOf(torus).closed());
    // A polygon with n corners has sin(x) / x of its circle's area, with x = 2 pi / n. This holds for both circles, so
    // the volume is below 2 pi^2 2 / 4 by a fraction of 2 x^2 / 6.
    CHECK(volumeOf(torus) == Approx(std::numbers::pi * std::numbers::pi).epsilon(2e-3));

    const std::string whole = bytesOf(spot);
    for (size_t size = 1; size < whole.size(); size += 9700) {
        CAPTURE(size);
        const std::string error = errorOf(folder, "cut.obj", whole.substr(0, size));
        const bool hasFace = whole.substr(0, size).find("\nf ") != std::string::npos;
        CHECK((error != "no error" || hasFace));
    }
}

TEST_CASE("MeshFile: a written mesh is read back unchanged", "[vdb]") {
    const Folder folder;
    Mesh mesh;
    for (int n = 0; n < 8; ++n) mesh.points.emplace_back(corner(n)[0] / 3, corner(n)[1] * 1e-20f, corner(n)[2] * 1e20f);
    for (size_t k = 0; k + 1 < kBox.size(); ++k) {
        const auto& q = kBox[k];
        mesh.quads.emplace_back(q[0], q[1], q[2], q[3]);
    }
    mesh.triangles = {{1, 3, 7}, {1, 7, 5}};
    for (const char* name : {"a.ply", "a.obj", "A.PLY"}) {
        CAPTURE(name);
        writeMesh(folder.path / name, mesh);
        const Mesh back = readMesh(folder.path / name);
        REQUIRE(back.points.size() == 8);
        CHECK(topologyOf(back).closed());
        CHECK(back.faces() == 7);
        // Each face has the same corners in the same cyclic order.
        const auto cornersOf = [](const Mesh& m) {
            std::set<std::vector<openvdb::Vec3s>> faces;
            const auto add = [&](const openvdb::Index32* c, size_t count) {
                std::vector<openvdb::Vec3s> face;
                for (size_t k = 0; k < count; ++k) face.push_back(m.points[c[k]]);
                std::rotate(face.begin(), std::min_element(face.begin(), face.end()), face.end());
                faces.insert(face);
            };
            for (const auto& f : m.triangles) add(f.asV(), 3);
            for (const auto& f : m.quads) add(f.asV(), 4);
            return faces;
        };
        CHECK(cornersOf(back) == cornersOf(mesh));
    }
}

TEST_CASE("MeshFile: invalid meshes are not written", "[vdb]") {
    const Folder folder;
    Mesh mesh;
    mesh.points = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    mesh.triangles = {{0, 1, 2}};
    CHECK_THROWS_WITH(writeMesh(folder.path / "a.stl", mesh), ContainsSubstring(".ply or .obj"));
    CHECK_THROWS_AS(writeMesh(folder.path / "none" / "a.ply", mesh), FileError);
    mesh.triangles = {{0, 1, 3}};
    CHECK_THROWS_WITH(writeMesh(folder.path / "a.ply", mesh), ContainsSubstring("vertex"));
    mesh.triangles = {{0, 1, 2}};
    mesh.points[1][2] = std::numeric_limits<float>::infinity();
    CHECK_THROWS_WITH(writeMesh(folder.path / "a.obj", mesh), ContainsSubstring("finite"));
    CHECK(fs::is_empty(folder.path));
}

TEST_CASE("MeshFile: reading large files can be cancelled", "[vdb]") {
    const Folder folder;
    const Monitor stop{.report = {}, .cancelled = [] { return true; }};
    writeMesh(folder.path / "a.obj", test::ball(5));
    writeMesh(folder.path / "a.ply", test::ball(5));
    CHECK_THROWS_AS(readMesh(folder.path / "a.obj", stop), Interrupted);
    CHECK_THROWS_AS(readMesh(folder.path / "a.ply", stop), Interrupted);
}

TEST_CASE("MeshFile: normals and UVs are written, and readers read past them", "[vdb]") {
    const Folder folder;
    Mesh mesh;
    mesh.points = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0.5f}};
    mesh.quads = {{0, 1, 2, 3}};
    const auto obj = [&] {
        writeMesh(folder.path / "a.obj", mesh);
        return bytesOf(folder.path / "a.obj");
    };
    CHECK_THAT(obj(), ContainsSubstring("\nf 1 2 3 4\n"));
    mesh.normals = {{0, 0, 1}, {0, 0, 1}, {0, 1, 0}, {1, 0, 0}};
    CHECK_THAT(obj(), ContainsSubstring("vn 0 0 1\n") && ContainsSubstring("\nf 1//1 2//2 3//3 4//4\n"));
    mesh.uvs = {{0, 0}, {1, 0}, {1, 1}, {0, 0.25f}};
    CHECK_THAT(obj(), ContainsSubstring("vt 0 0.25\n") && ContainsSubstring("\nf 1/1/1 2/2/2 3/3/3 4/4/4\n"));
    writeMesh(folder.path / "a.ply", mesh);
    const std::string ply = bytesOf(folder.path / "a.ply");
    CHECK_THAT(ply, ContainsSubstring("property float nz\nproperty float s\nproperty float t\nelement face 1\n"));
    CHECK(ply.size() == ply.find("end_header\n") + 11 + 4 * 8 * sizeof(float) + 1 + 4 * sizeof(int32_t));
    for (const char* name : {"a.obj", "a.ply"}) {
        const Mesh back = readMesh(folder.path / name);
        CHECK(back.points == mesh.points);
        CHECK(back.quads == mesh.quads);
        CHECK(back.normals.empty());
    }
    mesh.uvs.pop_back();
    CHECK_THROWS_WITH(writeMesh(folder.path / "a.ply", mesh), ContainsSubstring("3 UVs for 4 points"));
    mesh.uvs.clear();
    mesh.normals.pop_back();
    CHECK_THROWS_WITH(writeMesh(folder.path / "a.obj", mesh), ContainsSubstring("3 normals for 4 points"));
}
