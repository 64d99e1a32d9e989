// SPDX-License-Identifier: Apache-2.0
#include "curlew/base/Error.h"
#include "curlew/base/Parallel.h"
#include "curlew/vdb/Openvdb.h"
#include "curlew/vdb/PointFile.h"
#include "curlew/vdb/VdbFile.h"
#include "support/Catch.h"
#include "support/Files.h"

#include <openvdb/points/PointAttribute.h>
#include <openvdb/points/PointCount.h>
#include <unistd.h>

#include <charconv>
#include <cmath>
#include <cstring>
#include <fstream>
#include <iterator>
#include <limits>
#include <random>
#include <sstream>

using namespace curlew;
using Catch::Matchers::ContainsSubstring;
namespace fs = std::filesystem;
using test::bytesOf;
using Folder = test::ScratchFolder;

namespace {

/// Random particles. If `surface` is set, they are on a sphere, so that most of their bounding box is empty.
Points cloud(size_t count, bool velocity = true, bool surface = false) {
    Points particles;
    std::mt19937_64 random(7);
    const auto number = [&] { return double(random() >> 11) * 0x1p-52 - 1; };
    for (size_t n = 0; n < count; ++n) {
        double x = number(), y = number(), z = number();
        if (surface) {
            const double length = std::hypot(x, y, z);
            x /= length, y /= length, z /= length;
        }
        particles.x.push_back(x), particles.y.push_back(y + 100), particles.z.push_back(z);
        if (velocity) {
            particles.vx.push_back(float(number()));
            particles.vy.push_back(float(number()));
            particles.vz.push_back(float(number()));
        }
        particles.id.push_back(int64_t(count - n) * 3 - 5);
    }
    return particles;
}

/// Particles with ages, lives and tracks that floats represent exactly.
Points agedCloud(size_t count) {
    Points particles = cloud(count);
    for (size_t n = 0; n < count; ++n) {
        const auto number = static_cast<float>(n);
        particles.age.push_back(number / 8);
        particles.life.push_back(n % 3 ? number : std::numeric_limits<float>::infinity());
        particles.f.push_back(static_cast<double>(number) / 4 - 10);
        particles.g.push_back(static_cast<double>(-number));
    }
    return particles;
}

double pointsPerVoxel(const openvdb::points::PointDataGrid& grid) {
    return double(openvdb::points::pointCount(grid.tree())) / double(grid.activeVoxelCount());
}

} // namespace

TEST_CASE("PointFile: points are read back from a grid and a file sorted by id", "[vdb]") {
    const Folder folder;
    const bool velocity = GENERATE(true, false);
    CAPTURE(velocity);
    const Points particles = cloud(5000, velocity);
    const auto grid = pointGrid(particles, {.name = "dust"});
    CHECK(grid->getName() == "dust");
    CHECK((grid->getVectorType() == openvdb::VEC_CONTRAVARIANT_RELATIVE) == velocity);
    writeVdb(folder / "a.vdb", {grid});
    const auto read = openvdb::gridPtrCast<openvdb::points::PointDataGrid>(readVdb(folder / "a.vdb").at(0));
    REQUIRE(read);
    const Points back = pointsOf(*read);
    REQUIRE(back.size() == particles.size());
    REQUIRE(back.hasVelocity() == velocity);
    const double tolerance = grid->voxelSize()[0] * 0x1p-25 +
                             100 * 0x1p-50; // P is relative to the voxel; rounding from world to voxels and back
    for (size_t n = 0; n < back.size(); ++n) {
        const size_t m = particles.size() - 1 - n; // ids in cloud() count down
        CAPTURE(n);
        REQUIRE(back.id[n] == particles.id[m]);
        REQUIRE(std::abs(back.x[n] - particles.x[m]) <= tolerance);
        REQUIRE(std::abs(back.y[n] - particles.y[m]) <= tolerance);
        REQUIRE(std::abs(back.z[n] - particles.z[m]) <= tolerance);
        if (!velocity) continue;
        REQUIRE(back.vx[n] == particles.vx[m]);
        REQUIRE(back.vy[n] == particles.vy[m]);
        REQUIRE(back.vz[n] == particles.vz[m]);
    }
}

TEST_CASE("PointFile: the default voxel size gives about 8 points per voxel in volumes and on surfaces", "[vdb]") {
    const bool surface = GENERATE(false, true);
    CAPTURE(surface);
    const auto grid = pointGrid(cloud(100000, false, surface));
    CHECK(pointsPerVoxel(*grid) > 5);
    CHECK(pointsPerVoxel(*grid) < 11);
    CHECK(pointGrid(cloud(1000), {.voxelSize = 0.25})->voxelSize() == openvdb::Vec3d(0.25));
}

TEST_CASE("PointFile: coincident and distant points are stored accurately", "[vdb]") {
    const auto back = [](std::vector<double> x) {
        Points particles;
        particles.x = x;
        particles.y = particles.z = std::vector<double>(x.size());
        particles.id.resize(x.size());
        for (size_t n = 0; n < x.size(); ++n) particles.id[n] = int64_t(n);
        return pointsOf(*pointGrid(particles)).x;
    };
    CHECK(back({2}).at(0) == Approx(2));
    CHECK(back({2, 2, 2}).at(2) == Approx(2));
    CHECK(back({1e12}).at(0) == Approx(1e12));
    CHECK(back({-1e-9, 1e-9}).at(1) == Approx(1e-9).margin(1.5e-5 * 0x1p-25));
    const auto far = back({0, 0.001, 0.002, 1e9}); // one particle far away
    CHECK(far.at(3) == Approx(1e9));
    CHECK(far.at(1) == Approx(0.001).margin(1e9 / 0x1p21 * 0x1p-24));
}

TEST_CASE("PointFile: every format accepts empty points", "[vdb]") {
    const Folder folder;
    const Points none;
    writeVdb(folder / "a.vdb", {pointGrid(none)});
    const auto read = openvdb::gridPtrCast<openvdb::points::PointDataGrid>(readVdb(folder / "a.vdb").at(0));
    REQUIRE(read);
    CHECK(pointsOf(*read).size() == 0);
    writePly(folder / "a.ply", none);
    CHECK_THAT(bytesOf(folder / "a.ply"), ContainsSubstring("element vertex 0\n"));
    writeCsv(folder / "a.csv", none);
    CHECK(bytesOf(folder / "a.csv") == "x,y,z,id\n");
}

TEST_CASE("PointFile: bytes do not depend on the number of threads", "[vdb]") {
    const Folder folder;
    const Points particles = cloud(70000);
    const auto writeAll = [&](const std::string& name) {
        writeVdb(folder / (name + ".vdb"), {pointGrid(particles)});
        writePly(folder / (name + ".ply"), particles);
        writeCsv(folder / (name + ".csv"), particles);
    };
    for (const int threads : {1, 2, 7}) {
        const ThreadLimit limit(threads);
        writeAll(std::to_string(threads));
    }
    for (const std::string extension : {".vdb", ".ply", ".csv"}) {
        CAPTURE(extension);
        const std::string one = bytesOf(folder / ("1" + extension));
        CHECK((one == bytesOf(folder / ("2" + extension))));
        CHECK((one == bytesOf(folder / ("7" + extension))));
    }
}

TEST_CASE("PointFile: PLY stores points in order", "[vdb]") {
    const Folder folder;
    const Points particles = cloud(300000); // more than one round of chunks
    writePly(folder / "a.ply", particles);
    const std::string bytes = bytesOf(folder / "a.ply");
    const std::string end = "end_header\n";
    const size_t start = bytes.find(end) + end.size();
    CHECK(bytes.substr(0, start) ==
          "ply\nformat binary_little_endian 1.0\nelement vertex 300000\nproperty float x\nproperty float y\nproperty "
          "float z\n"
          "property float vx\nproperty float vy\nproperty float vz\nproperty int id\nend_header\n");
    struct Record {
        float x, y, z, vx, vy, vz;
        int32_t id;
    };
    REQUIRE(bytes.size() == start + 300000 * sizeof(Record));
    size_t wrong = 0;
    for (size_t n = 0; n < particles.size(); ++n) {
        Record record;
        std::memcpy(&record, &bytes[start + n * sizeof record], sizeof record);
        const bool place =
            record.x == float(particles.x[n]) && record.y == float(particles.y[n]) && record.z == float(particles.z[n]);
        const bool speed = record.vx == particles.vx[n] && record.vy == particles.vy[n] && record.vz == particles.vz[n];
        wrong += !(place && speed && record.id == particles.id[n]);
    }
    CHECK(wrong == 0);
}

TEST_CASE("PointFile: CSV may have a byte order mark, and text in columns that are skipped", "[vdb]") {
    const Folder folder;
    std::ofstream(folder / "named.csv") << "\xEF\xBB\xBFx,y,z,name\n1,2,3,foo\n4,5,6,\"bar\"\n";
    const PointTable table = readPoints(folder / "named.csv");
    REQUIRE(table.points.size() == 2);
    CHECK(table.points.position(1) == Vec3d{{4, 5, 6}});
    CHECK(table.skipped == std::vector<std::string>{"name"});
    std::ofstream(folder / "bad.csv") << "x,y,z,id\n1,2,3,0\n4,five,6,1\n";
    CHECK_THROWS_WITH(readPoints(folder / "bad.csv"), Catch::ContainsSubstring("bad.csv") &&
                                                          Catch::ContainsSubstring("line 3: 'five' is not a number"));
}

TEST_CASE("PointFile: CSV has nine digits and 64-bit ids", "[vdb]") {
    const Folder folder;
    Points particles = cloud(300000);
    particles.id[1] = 1LL << 60;
    writeCsv(folder / "a.csv", particles);
    std::ifstream in(folder / "a.csv");
    std::string line;
    std::getline(in, line);
    CHECK(line == "x,y,z,vx,vy,vz,id");
    size_t wrong = 0;
    for (size_t n = 0; n < particles.size() && std::getline(in, line); ++n) {
        double values[6] = {};
        const char *at = line.data(), *end = line.data() + line.size();
        bool right = true;
        for (double& value : values) {
            at = std::from_chars(at, end, value).ptr;
            right = right && at < end && *at++ == ',';
        }
        right = right && std::abs(values[0] - particles.x[n]) <= 0.5e-9 &&
                std::abs(values[1] - particles.y[n]) <= 0.5e-6 && // coordinates are about 100
                std::abs(values[2] - particles.z[n]) <= 0.5e-9;
        right = right && float(values[3]) == particles.vx[n] && float(values[4]) == particles.vy[n] &&
                float(values[5]) == particles.vz[n]; // nine digits identify a float
        wrong += !(right && std::string(at, end) == std::to_string(particles.id[n]));
    }
    CHECK(wrong == 0);
    CHECK(!std::getline(in, line));

    Points one;
    one.x = {0.1}, one.y = {-1.0 / 3}, one.z = {1e-7}, one.id = {-1};
    writeCsv(folder / "one.csv", one);
    CHECK(bytesOf(folder / "one.csv") == "x,y,z,id\n0.1,-0.333333333,1e-07,-1\n");
}

TEST_CASE("PointFile: invalid points are refused", "[vdb]") {
    const Folder folder;
    Points big = cloud(3);
    big.id[1] = int64_t(std::numeric_limits<int32_t>::max()) + 1;
    REQUIRE_THROWS_AS(pointGrid(big), ValueError);
    REQUIRE_THROWS_WITH(writePly(folder / "a.ply", big), ContainsSubstring("2147483648"));
    Points ragged = cloud(3);
    ragged.vy.pop_back();
    REQUIRE_THROWS_AS(pointGrid(ragged), ValueError);
    REQUIRE_THROWS_AS(writePly(folder / "a.ply", ragged), ValueError);
    REQUIRE_THROWS_AS(writeCsv(folder / "a.csv", ragged), ValueError);
    Points bad = cloud(3);
    bad.y[2] = std::nan("");
    REQUIRE_THROWS_AS(pointGrid(bad), ValueError);
    bad.y[2] = -std::numeric_limits<double>::infinity();
    REQUIRE_THROWS_WITH(pointGrid(bad), ContainsSubstring("1 coordinate"));
    for (const double voxelSize : {-1.0, 1e-9, 1e200, std::nan("")}) {
        CAPTURE(voxelSize);
        REQUIRE_THROWS_WITH(pointGrid(cloud(3), {.voxelSize = voxelSize}), ContainsSubstring("voxel size"));
    }
    CHECK(folder.files() == 0);
}

TEST_CASE("PointFile: reads point grids of other programs", "[vdb]") {
    namespace points = openvdb::points;
    Points particles = cloud(100, false);
    const auto grid = pointGrid(particles);

    const auto withoutIds = grid->deepCopy();
    points::dropAttribute(withoutIds->tree(), "id");
    const Points numbered = pointsOf(*withoutIds);
    REQUIRE(numbered.size() == 100);
    CHECK(numbered.id.front() == 0);
    CHECK(numbered.id.back() == 99);

    const auto longIds = withoutIds->deepCopy();
    points::appendAttribute<int64_t>(longIds->tree(), "id", int64_t(1) << 40);
    CHECK(pointsOf(*longIds).id.at(5) == int64_t(1) << 40);

    const auto wrongIds = withoutIds->deepCopy();
    points::appendAttribute<float>(wrongIds->tree(), "id");
    REQUIRE_THROWS_WITH(pointsOf(*wrongIds), ContainsSubstring("'id'") && ContainsSubstring("float"));

    const auto wrongVelocity = grid->deepCopy();
    points::appendAttribute<openvdb::Vec3d>(wrongVelocity->tree(), "v");
    REQUIRE_THROWS_AS(pointsOf(*wrongVelocity), ValueError);

    const auto packed = grid->deepCopy();
    points::appendAttribute<openvdb::Vec3s, points::TruncateCodec>(packed->tree(), "v", openvdb::Vec3s(0.5f, 1, 2));
    CHECK(pointsOf(*packed).vx.at(7) == 0.5f);
}

TEST_CASE("PointFile: a failed write leaves no file", "[vdb]") {
    const Folder folder;
    REQUIRE_THROWS_AS(writePly(folder / "none" / "a.ply", cloud(10)), FileError);
    REQUIRE_THROWS_AS(writeCsv(folder.path, cloud(10)), FileError);
    CHECK(folder.files() == 0);
}

TEST_CASE("PointFile: age and life and track attributes are read back in order of id", "[vdb]") {
    const Folder folder;
    const Points particles = agedCloud(3000);
    writeVdb(folder / "a.vdb", {pointGrid(particles)});
    const auto read = openvdb::gridPtrCast<openvdb::points::PointDataGrid>(readVdb(folder / "a.vdb").at(0));
    REQUIRE(read);
    for (const char* name : {"P", "v", "id", "age", "life", "f", "g"})
        CHECK(read->tree().cbeginLeaf()->hasAttribute(name));
    const Points back = pointsOf(*read);
    REQUIRE(back.size() == particles.size());
    REQUIRE((back.hasAge() && back.hasLife() && back.hasTrack()));
    for (size_t n = 0; n < back.size(); ++n) {
        const size_t m = particles.size() - 1 - n; // ids in cloud() count down
        CAPTURE(n);
        REQUIRE(back.id[n] == particles.id[m]);
        REQUIRE(back.age[n] == particles.age[m]);
        REQUIRE(back.life[n] == particles.life[m]);
        REQUIRE(back.f[n] == particles.f[m]);
        REQUIRE(back.g[n] == particles.g[m]);
    }
}

TEST_CASE("PointFile: the velocity attribute gets the name chosen by the host", "[vdb]") {
    const Points particles = cloud(50);
    const auto grid = pointGrid(particles, {.velocity = "velocity"});
    CHECK(grid->tree().cbeginLeaf()->hasAttribute("velocity"));
    CHECK_FALSE(grid->tree().cbeginLeaf()->hasAttribute("v"));
    const Points back = pointsOf(*grid);
    REQUIRE(back.hasVelocity());
    CHECK(back.vx.front() == particles.vx.back());
}

TEST_CASE("PointFile: foreign attributes with the same name but another type are ignored", "[vdb]") {
    namespace points = openvdb::points;
    const auto grid = pointGrid(cloud(50));
    points::appendAttribute<int32_t>(grid->tree(), "age", 7);
    points::appendAttribute<float>(grid->tree(), "f", 0.5F); // f without g
    points::appendAttribute<float>(grid->tree(), "life", 3.0F);
    const Points back = pointsOf(*grid);
    CHECK_FALSE(back.hasAge());
    CHECK_FALSE(back.hasTrack());
    CHECK(back.life == std::vector<float>(50, 3.0F));
}

TEST_CASE("PointFile: PLY and CSV store age and life and track after the id", "[vdb]") {
    const Folder folder;
    Points one;
    one.x = {1}, one.y = {2}, one.z = {3}, one.id = {4};
    one.age = {0.1F}, one.life = {std::numeric_limits<float>::infinity()};
    one.f = {1.0 / 3}, one.g = {-2};
    writeCsv(folder / "one.csv", one);
    CHECK(bytesOf(folder / "one.csv") == "x,y,z,id,age,life,f,g\n1,2,3,4,0.100000001,inf,0.333333343,-2\n");
    writePly(folder / "one.ply", one);
    const std::string bytes = bytesOf(folder / "one.ply");
    CHECK_THAT(bytes,
               ContainsSubstring("property int id\nproperty float age\nproperty float life\nproperty float f\nproperty "
                                 "float g\nend_header\n"));
    const float last[4] = {0.1F, std::numeric_limits<float>::infinity(), static_cast<float>(1.0 / 3), -2};
    CHECK(bytes.substr(bytes.size() - sizeof last) == std::string(reinterpret_cast<const char*>(last), sizeof last));
    one.life.clear();
    writeCsv(folder / "one.csv", one);
    CHECK_THAT(bytesOf(folder / "one.csv"), ContainsSubstring("id,age,f,g\n"));
    one.g.clear();
    CHECK_THROWS_WITH(writeCsv(folder / "two.csv", one), ContainsSubstring("g 0"));
    CHECK_THROWS_AS(pointGrid(one), ValueError);
}
