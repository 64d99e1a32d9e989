// SPDX-License-Identifier: Apache-2.0
#include "curlew/base/Error.h"
#include "curlew/vdb/PointFile.h"
#include "support/Files.h"

#include <limits>
#include <random>

using namespace curlew;
using Catch::Matchers::ContainsSubstring;
using Folder = test::ScratchFolder;
using test::store;

namespace {

/// Points with all arrays. All numbers are representable as floats.
Points all(size_t count) {
    std::mt19937_64 random(5);
    const auto number = [&] { return static_cast<float>(random() >> 40) * 0x1p-23f - 1; };
    Points p;
    for (size_t n = 0; n < count; ++n) {
        for (auto* array : {&p.x, &p.y, &p.z, &p.f, &p.g}) array->push_back(static_cast<double>(number()));
        for (auto* array : {&p.vx, &p.vy, &p.vz, &p.age, &p.fade}) array->push_back(number());
        p.life.push_back(n % 3 ? number() + 2 : std::numeric_limits<float>::infinity());
        p.id.push_back(static_cast<int64_t>(7 * n) - 50);
    }
    return p;
}

std::string complaint(const Folder& folder, const std::string& name, const std::string& text) {
    try {
        readPoints(store(folder / name, text));
    } catch (const FileError& error) {
        return error.what();
    }
    return "nothing";
}

} // namespace

TEST_CASE("readPoints: every value written to PLY and CSV is read back", "[vdb]") {
    const Folder folder;
    const Points points = all(1000);
    writePly(folder / "all.ply", points);
    writeCsv(folder / "all.csv", points);
    for (const char* name : {"all.ply", "all.csv"}) {
        CAPTURE(name);
        const PointTable table = readPoints(folder / name);
        CHECK(table.skipped.empty());
        const Points& back = table.points;
        CHECK(back.id == points.id);
        CHECK((back.vx == points.vx && back.vy == points.vy && back.vz == points.vz));
        CHECK((back.age == points.age && back.life == points.life && back.fade == points.fade));
        // 9 digits identify a float, not a double.
        for (size_t n = 0; n < points.size(); ++n)
            if (static_cast<float>(back.x[n]) != static_cast<float>(points.x[n]) ||
                static_cast<float>(back.g[n]) != static_cast<float>(points.g[n]))
                FAIL("point " << n << " differs");
    }
    CHECK(readPoints(folder / "all.ply").points.x == points.x);
    writePly(folder / "again.ply", readPoints(folder / "all.ply").points);
    writeCsv(folder / "again.csv", readPoints(folder / "all.csv").points);
    CHECK(test::bytesOf(folder / "again.ply") == test::bytesOf(folder / "all.ply"));
    CHECK(test::bytesOf(folder / "again.csv") == test::bytesOf(folder / "all.csv"));
    CHECK(contentOfPly(folder / "all.ply") == PlyContent::points);
}

TEST_CASE("readPoints: reads known columns from files of other programs and reports the rest", "[vdb]") {
    const Folder folder;
    const std::string ply =
        "ply\nformat ascii 1.0\nelement vertex 2\nproperty double z\nproperty float nx\n"
        "property float x\nproperty float y\nproperty list uchar int tags\nend_header\n"
        "3 0.5 1 2 2 7 8\n6 0.5 4 5 0\n";
    const PointTable table = readPoints(store(folder / "other.ply", ply));
    CHECK(table.points.x == std::vector<double>{1, 4});
    CHECK(table.points.y == std::vector<double>{2, 5});
    CHECK(table.points.z == std::vector<double>{3, 6});
    CHECK(table.points.id == std::vector<int64_t>{0, 1});
    CHECK_FALSE(table.points.hasVelocity());
    CHECK(table.skipped == std::vector<std::string>{"nx"});
    const PointTable csv = readPoints(store(folder / "other.csv", "\"x\", y ,z,Cd\r\n1,2,3,0.5\r\n"));
    CHECK(csv.points.position(0)[2] == 3);
    CHECK(csv.skipped == std::vector<std::string>{"Cd"});
    CHECK(readPoints(store(folder / "none.csv", "x,y,z,id\n")).points.size() == 0);
}

TEST_CASE("readPoints: damaged and unsuitable files give a one-line error", "[vdb]") {
    const Folder folder;
    CHECK_THAT(complaint(folder, "a.csv", "x,y\n1,2\n"),
               ContainsSubstring("a.csv") && ContainsSubstring("no column z; its columns are x,y"));
    CHECK_THAT(complaint(folder, "b.csv", "x,y,z,vx\n1,2,3,4\n"), ContainsSubstring("no column vy"));
    CHECK_THAT(complaint(folder, "c.csv", "x,y,z,id\n1,2,3,0.5\n"), ContainsSubstring("the id 0.5"));
    CHECK_THAT(complaint(folder, "d.csv", "x,y,z,id\n1,2,3,1e17\n"), ContainsSubstring("2^53"));
    CHECK_THAT(complaint(folder, "e.csv", "x,y,z\n1,,3\n"), ContainsSubstring("1 of its 1 points"));
    CHECK_THAT(complaint(folder, "f.csv", "x,y,z\n1,2\n"), ContainsSubstring("line 2"));
    CHECK_THAT(complaint(folder, "g.csv", "x,y,z,x\n1,2,3,4\n"), ContainsSubstring("column x twice"));
    CHECK_THAT(complaint(folder, "h.ply", "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nend_header\n1\n"),
               ContainsSubstring("property y"));
    const std::string edges =
        "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty "
        "float z\nelement edge 1\nproperty int vertex1\nproperty int vertex2\nend_header\n1 2 3\n0 0\n";
    CHECK_THAT(complaint(folder, "i.ply", edges), ContainsSubstring("curves"));
    writePly(folder / "whole.ply", all(100));
    const std::string whole = test::bytesOf(folder / "whole.ply");
    for (size_t part = 1; part < 20; ++part)
        CHECK_THAT(complaint(folder, "cut.ply", whole.substr(0, whole.size() * part / 20)),
                   ContainsSubstring("cut.ply"));
    const std::string many =
        "ply\nformat binary_little_endian 1.0\nelement vertex 4000000000\nproperty float x\n"
        "property float y\nproperty float z\nend_header\n123456789012";
    CHECK_THAT(complaint(folder, "many.ply", many), ContainsSubstring("cut short"));
}
