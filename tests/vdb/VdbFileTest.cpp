// SPDX-License-Identifier: Apache-2.0
// Longer than 400 lines: every kind of grid, written and read back, and its damaged files.
#include "curlew/base/Error.h"
#include "curlew/base/Parallel.h"
#include "curlew/vdb/NanoFile.h"
#include "curlew/vdb/Openvdb.h"
#include "curlew/vdb/PointFile.h"
#include "curlew/vdb/VdbFile.h"
#include "support/Catch.h"
#include "support/Files.h"

#include <openvdb/io/File.h>
#include <openvdb/io/Stream.h>
#include <openvdb/tools/LevelSetSphere.h>
#include <unistd.h>

#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iterator>
#include <random>
#include <sstream>
#include <string>

using namespace curlew;
using Catch::Matchers::ContainsSubstring;
namespace fs = std::filesystem;
using test::bytesOf;
using Folder = test::ScratchFolder;
using test::store;

namespace {

using Grids = std::vector<openvdb::GridBase::ConstPtr>;

openvdb::FloatGrid::Ptr sphere() {
    auto grid = openvdb::tools::createLevelSetSphere<openvdb::FloatGrid>(1.0f, {0.1f, 0.2f, 0.3f}, 0.1f);
    grid->setName("sphere");
    return grid;
}

openvdb::Vec3SGrid::Ptr velocity() {
    auto grid = openvdb::Vec3SGrid::create();
    grid->setName("vel");
    for (int i = 0; i < 20; ++i)
        for (int j = -3; j < 9; ++j) grid->tree().setValue({i, j, i * j}, {float(i) / 7, float(j) / 3, 1});
    grid->tree().addTile(1, {640, 0, 0}, {1, 2, 3}, true);
    return grid;
}

openvdb::points::PointDataGrid::Ptr points() {
    Points particles;
    particles.x = {0.1, 3, -7}, particles.y = {0, 3, 0}, particles.z = {0, 3, 0}, particles.id = {0, 1, 2};
    return pointGrid(particles, {.voxelSize = 0.5});
}

/// One grid of each kind; two of them share a tree.
Grids variety() {
    openvdb::initialize();
    auto level = sphere();
    auto shared = level->copy();
    shared->setName("shared");
    shared->setTransform(openvdb::math::Transform::createLinearTransform(3));
    auto half = velocity();
    half->setName("half");
    half->setSaveFloatAsHalf(true);
    auto mask = openvdb::BoolGrid::create();
    mask->fill({{0, 0, 0}, {20, 20, 20}}, true);
    auto counts = openvdb::Int32Grid::create(5);
    counts->tree().setValue({1, 2, 3}, 4);
    return {level, velocity(), shared, half, mask, counts, points()};
}

void requireSame(const openvdb::GridBase& read, const openvdb::GridBase& written) {
    CAPTURE(written.getName(), written.type());
    REQUIRE(read.getName() == written.getName());
    REQUIRE(read.type() == written.type());
    REQUIRE(read.transform() == written.transform());
    REQUIRE(read.saveFloatAsHalf() == written.saveFloatAsHalf());
    REQUIRE(read.activeVoxelCount() == written.activeVoxelCount());
    REQUIRE(read.evalActiveVoxelBoundingBox() == written.evalActiveVoxelBoundingBox());
    if (!written.isType<openvdb::FloatGrid>()) return;
    const auto& a = static_cast<const openvdb::FloatGrid&>(read);
    const auto& b = static_cast<const openvdb::FloatGrid&>(written);
    REQUIRE(a.background() == b.background());
    for (auto value = b.cbeginValueAll(); value; ++value)
        if (a.tree().getValue(value.getCoord()) != *value) FAIL("another value at " << value.getCoord());
}

void requireSame(const std::vector<openvdb::GridBase::Ptr>& read, const Grids& written) {
    REQUIRE(read.size() == written.size());
    for (size_t n = 0; n < read.size(); ++n) requireSame(*read[n], *written[n]);
}

/// Removes the random UUID that OpenVDB's own files have at byte 21.
std::string withoutUuid(std::string bytes) { return bytes.erase(21, 36); }

/// Returns the python3 that has the module, or an empty string.
std::string pythonWith(const std::string& module) {
    for (const char* python : {"python3", "/usr/bin/python3"})
        if (std::system((std::string(python) + " -c 'import " + module + "' 2>/dev/null").c_str()) == 0) return python;
    return {};
}

} // namespace

TEST_CASE("VdbFile: grids are read back as written", "[vdb]") {
    const Folder folder;
    const Grids grids = variety();
    const auto codec = GENERATE(Codec::automatic, Codec::none, Codec::zip, Codec::blosc);
    openvdb::MetaMap metadata;
    metadata.insertMeta("frames_per_second", openvdb::FloatMetadata(24));
    writeVdb(folder / "a.vdb", grids, metadata, {.codec = codec});
    const auto read = readVdb(folder / "a.vdb");
    requireSame(read, grids);
    CHECK(&read[0]->baseTree() == &read[2]->baseTree());
    const auto vel = openvdb::gridPtrCast<openvdb::Vec3SGrid>(read[1]);
    CHECK(vel->tree().getValue({19, 8, 152}) == openvdb::Vec3s(19.0f / 7, 8.0f / 3, 1));
    CHECK(vel->tree().getValue({641, 1, 1}) == openvdb::Vec3s(1, 2, 3));
    CHECK(pointsOf(*openvdb::gridPtrCast<openvdb::points::PointDataGrid>(read[6])).size() == 3);

    openvdb::io::File file((folder / "a.vdb").string());
    file.open();
    CHECK(file.getMetadata()->metaValue<float>("frames_per_second") == 24);
    CHECK(file.readGrid("half")->activeVoxelCount() == grids[3]->activeVoxelCount()); // uses the offsets
}

TEST_CASE("VdbFile: reads files of OpenVDB's own writers", "[vdb]") {
    const Folder folder;
    const Grids grids = variety();
    const openvdb::GridCPtrVec list(grids.begin(), grids.end());
    const auto flags = GENERATE(uint32_t(openvdb::io::COMPRESS_NONE), uint32_t(openvdb::io::COMPRESS_ZIP),
                                uint32_t(openvdb::io::COMPRESS_ZIP | openvdb::io::COMPRESS_ACTIVE_MASK),
                                uint32_t(openvdb::io::COMPRESS_BLOSC | openvdb::io::COMPRESS_ACTIVE_MASK));
    CAPTURE(flags);
    openvdb::io::File file((folder / "file.vdb").string());
    file.setCompression(flags);
    file.write(list);
    requireSame(readVdb(folder / "file.vdb"), grids);
    {
        std::ofstream out(folder / "stream.vdb", std::ios::binary); // a stream has no offsets
        openvdb::io::Stream stream(out);
        stream.setCompression(flags);
        stream.write(list);
    }
    requireSame(readVdb(folder / "stream.vdb"), grids);
}

TEST_CASE("VdbFile: bytes are reproducible and equal those of OpenVDB except for the UUID", "[vdb]") {
    const Folder folder;
    const Grids grids = variety();
    writeVdb(folder / "a.vdb", grids);
    writeVdb(folder / "b.vdb", variety());
    {
        const ThreadLimit one(1);
        writeVdb(folder / "c.vdb", variety());
    }
    const std::string bytes = bytesOf(folder / "a.vdb");
    CHECK((bytes == bytesOf(folder / "b.vdb")));
    CHECK((bytes == bytesOf(folder / "c.vdb")));

    openvdb::io::File file((folder / "file.vdb").string());
    file.setCompression(openvdb::io::COMPRESS_ACTIVE_MASK);
    file.write(openvdb::GridCPtrVec(grids.begin(), grids.end()));
    CHECK((withoutUuid(bytes) == withoutUuid(bytesOf(folder / "file.vdb"))));

    auto other = sphere();
    other->tree().setValueOnly({0, 0, 0}, 7);
    writeVdb(folder / "d.vdb", {other});
    writeVdb(folder / "e.vdb", {sphere()});
    const std::string uuid = bytesOf(folder / "d.vdb").substr(21, 36);
    CHECK(uuid != bytesOf(folder / "e.vdb").substr(21, 36));
    CHECK_THAT(uuid, Catch::Matches("[0-9a-f]{8}-[0-9a-f]{4}-8[0-9a-f]{3}-[89ab][0-9a-f]{3}-[0-9a-f]{12}"));
}

TEST_CASE("VdbFile: half precision is an option of the file and not of the grid", "[vdb]") {
    const Folder folder;
    const Grids grids{sphere(), velocity(), points()};
    writeVdb(folder / "full.vdb", grids);
    writeVdb(folder / "half.vdb", grids, {}, {.half = true});
    CHECK(!grids[0]->saveFloatAsHalf());
    CHECK(fs::file_size(folder / "half.vdb") < fs::file_size(folder / "full.vdb"));
    const auto read = readVdb(folder / "half.vdb");
    CHECK(read[0]->saveFloatAsHalf());
    CHECK(!read[2]->saveFloatAsHalf());
    const auto vel = openvdb::gridPtrCast<openvdb::Vec3SGrid>(read[1]);
    const float value = 19.0f / 7;
    CHECK(vel->tree().getValue({19, 8, 152}).x() != value);
    CHECK(vel->tree().getValue({19, 8, 152}).x() == Approx(value).epsilon(0x1p-11)); // a half has 11 significant bits
}

TEST_CASE("VdbFile: values that half floats cannot hold are refused", "[vdb]") {
    const Folder folder;
    auto density = openvdb::FloatGrid::create();
    auto vel = openvdb::Vec3SGrid::create();
    vel->setName("vel");
    density->tree().setValue({1, 2, 3}, 65504);
    vel->tree().setValue({1, 2, 3}, {1, -65504, 2});
    writeVdb(folder / "a.vdb", {density, vel}, {}, {.half = true});
    writeNano(folder / "a.nvdb", {density, vel}, {.half = true});
    vel->tree().setValue({1, 2, 4}, {1, -65600, 2});
    const auto refused = Catch::ContainsSubstring(
        "the grid 'vel' has values up to 6.56e+04, but 16-bit floats end at 65504; leave out half=1");
    CHECK_THROWS_WITH(writeVdb(folder / "b.vdb", {density, vel}, {}, {.half = true}), refused);
    writeNano(folder / "b.nvdb", {density, vel}, {.half = true}); // which keeps vectors as floats
    CHECK_FALSE(fs::exists(folder / "b.vdb"));
    vel->setSaveFloatAsHalf(true); // as in the file that it was read from: floats are written
    writeVdb(folder / "b.vdb", {density, vel});
    const auto read = openvdb::gridPtrCast<openvdb::Vec3SGrid>(readVdb(folder / "b.vdb").at(1));
    CHECK(read->tree().getValue({1, 2, 4}).y() == -65600);
    CHECK_FALSE(read->saveFloatAsHalf());
    density->tree().setValue({1, 2, 4}, -7e4F);
    CHECK_THROWS_AS(writeNano(folder / "c.nvdb", {density}, {.half = true}), ValueError);
}

TEST_CASE("VdbFile: with one codec for all grids the bytes equal those of OpenVDB", "[vdb]") {
    const Folder folder;
    Grids grids = variety();
    auto fog = sphere();
    fog->setGridClass(openvdb::GRID_FOG_VOLUME);
    auto nameless = velocity(), twin = velocity();
    nameless->setName("");
    twin->setName("");
    const auto again = std::static_pointer_cast<const openvdb::GridBase>(nameless->copyGrid());
    for (const openvdb::GridBase::ConstPtr& grid : Grids{fog, nameless, again, twin, velocity()}) grids.push_back(grid);

    const auto [codec, flag] = GENERATE(table<Codec, uint32_t>(
        {{Codec::none, 0u}, {Codec::zip, openvdb::io::COMPRESS_ZIP}, {Codec::blosc, openvdb::io::COMPRESS_BLOSC}}));
    writeVdb(folder / "a.vdb", grids, {}, {.codec = codec});
    openvdb::io::File file((folder / "file.vdb").string());
    file.setCompression(openvdb::io::COMPRESS_ACTIVE_MASK | flag);
    file.write(openvdb::GridCPtrVec(grids.begin(), grids.end()));
    CHECK((withoutUuid(bytesOf(folder / "a.vdb")) == withoutUuid(bytesOf(folder / "file.vdb"))));
}

TEST_CASE("VdbFile: the automatic codec compresses fog volumes only", "[vdb]") {
    const Folder folder;
    auto fog = openvdb::FloatGrid::create();
    fog->setName("density");
    fog->setGridClass(openvdb::GRID_FOG_VOLUME);
    fog->sparseFill({{0, 0, 0}, {30, 30, 30}}, 1.0f); // stored as tiles
    for (int n = 0; n < 30; ++n) fog->tree().setValue({n, 3, n}, 0.25f * float(n));
    fog->tree().voxelizeActiveTiles();
    const auto size = [&](const Grids& grids, Codec codec) {
        writeVdb(folder / "a.vdb", grids, {}, {.codec = codec});
        return fs::file_size(folder / "a.vdb");
    };
    const Grids others{sphere(), velocity(), points()};
    CHECK(size(others, Codec::automatic) == size(others, Codec::none));
    CHECK(size({fog}, Codec::automatic) == size({fog}, Codec::blosc));
    CHECK(2 * size({fog}, Codec::automatic) < size({fog}, Codec::none));

    // Each grid of a file chooses its own codec.
    const Grids mixed{sphere(), fog, velocity()};
    CHECK(size(mixed, Codec::automatic) - size({sphere(), velocity()}, Codec::none) < size({fog}, Codec::blosc));
    writeVdb(folder / "mixed.vdb", mixed);
    requireSame(readVdb(folder / "mixed.vdb"), mixed);
    openvdb::io::File file((folder / "mixed.vdb").string());
    file.open();
    for (const auto& grid : mixed) requireSame(*file.readGrid(grid->getName()), *grid);
}

TEST_CASE("VdbFile: names may repeat and lists may be empty and the Houdini creator is removed", "[vdb]") {
    const Folder folder;
    writeVdb(folder / "twins.vdb", {sphere(), sphere(), velocity()});
    const auto twins = readVdb(folder / "twins.vdb");
    REQUIRE(twins.size() == 3);
    CHECK(twins[0]->getName() == "sphere");
    CHECK(twins[1]->getName() == "sphere");

    writeVdb(folder / "none.vdb", {});
    CHECK(readVdb(folder / "none.vdb").empty());

    auto grid = sphere(), own = sphere();
    grid->setCreator("Houdini/GEO_VDBTranslator");
    own->setCreator("Curlew");
    openvdb::MetaMap metadata;
    metadata.insertMeta("creator", openvdb::StringMetadata("Houdini 20"));
    writeVdb(folder / "creator.vdb", {grid, own}, metadata);
    CHECK(grid->getCreator() == "Houdini/GEO_VDBTranslator");
    CHECK(bytesOf(folder / "creator.vdb").find("Houdini") == std::string::npos);
    CHECK(readVdb(folder / "creator.vdb")[1]->getCreator() == "Curlew");
}

TEST_CASE("VdbFile: every truncation of a file is detected", "[vdb]") {
    const Folder folder;
    const auto codec = GENERATE(Codec::automatic, Codec::none, Codec::zip, Codec::blosc);
    writeVdb(folder / "a.vdb", {velocity(), points()}, {}, {.codec = codec});
    const std::string bytes = bytesOf(folder / "a.vdb");
    for (size_t size = 1; size < bytes.size(); size += size < 1000 ? 7 : 997) {
        CAPTURE(size);
        store(folder / "cut.vdb", bytes.substr(0, size));
        REQUIRE_THROWS_AS(readVdb(folder / "cut.vdb"), FileError);
    }
    store(folder / "cut.vdb", bytes.substr(0, bytes.size() - 1));
    REQUIRE_THROWS_WITH(readVdb(folder / "cut.vdb"), ContainsSubstring("cut.vdb") && ContainsSubstring("cut short"));
}

TEST_CASE("VdbFile: a truncated stream without offsets is detected", "[vdb]") {
    const Folder folder;
    std::ostringstream out;
    openvdb::initialize();
    openvdb::io::Stream(out).write(openvdb::GridCPtrVec{velocity(), points()});
    const std::string bytes = out.str();
    for (size_t size = 1; size < bytes.size(); size += 997) {
        CAPTURE(size);
        store(folder / "cut.vdb", bytes.substr(0, size));
        REQUIRE_THROWS_AS(readVdb(folder / "cut.vdb"), FileError);
    }
}

TEST_CASE("VdbFile: sizes that would crash OpenVDB are detected", "[vdb]") {
    const Folder folder;
    const auto damaged = [&](const std::string& bytes) {
        store(folder / "damaged.vdb", bytes);
        REQUIRE_THROWS_AS(readVdb(folder / "damaged.vdb"), FileError);
    };
    writeVdb(folder / "a.vdb", {velocity()}, {}, {.codec = Codec::zip});
    const std::string bytes = bytesOf(folder / "a.vdb");
    damaged(std::string(bytes).replace(57, 4, 4, '\x7f')); // metadata
    damaged(std::string(bytes).replace(61, 4, 4, '\x7f')); // grids
    damaged(std::string(bytes).replace(65, 4, 4, '\x7f')); // length of a name

    // A value chunk whose size is larger than its node: OpenVDB 10.0 reads it before it checks.
    size_t chunks = 0;
    for (size_t at = 57; at + 8 < bytes.size(); ++at) {
        int64_t size = 0;
        std::memcpy(&size, &bytes[at], sizeof size);
        if (size >= 0 || size < -4096) continue;
        ++chunks;
        size -= 8;
        damaged(std::string(bytes).replace(at, sizeof size, reinterpret_cast<const char*>(&size), sizeof size));
    }
    CHECK(chunks > 0);
}

TEST_CASE("VdbFile: files that are not vdb are errors", "[vdb]") {
    const Folder folder;
    const auto error = [&](const std::string& name, const std::string& what) {
        CAPTURE(name);
        REQUIRE_THROWS_AS(readVdb(folder / name), FileError);
        REQUIRE_THROWS_WITH(readVdb(folder / name),
                            ContainsSubstring(name) && ContainsSubstring(what) && !ContainsSubstring("\n"));
    };
    error("missing.vdb", "no such file");
    fs::create_directory(folder / "folder.vdb");
    error("folder.vdb", "folder");
    store(folder / "empty.vdb", "");
    error("empty.vdb", "empty");
    store(folder / "image.vdb", "\x89PNG\r\n\x1a\n" + std::string(500, '\0'));
    error("image.vdb", "not a .vdb");
    store(folder / "text.vdb", "v 0 0 0\n");
    error("text.vdb", "not a .vdb");

    writeVdb(folder / "a.vdb", {sphere()});
    const std::string bytes = bytesOf(folder / "a.vdb");
    store(folder / "new.vdb", std::string(bytes).replace(8, 1, "\xff"));
    error("new.vdb", "version 255");
    std::string unknown = bytes;
    unknown.replace(unknown.find("Tree_float_5_4_3"), 10, "Tree_quark");
    store(folder / "unknown.vdb", unknown);
    error("unknown.vdb", "Tree_quark_5_4_3");
    std::string broken = bytes;
    broken.replace(broken.find("UniformScaleMap"), 7, "Uni\norm");
    store(folder / "broken.vdb", broken);
    error("broken.vdb", "Uni?ormScaleMap");
}

TEST_CASE("VdbFile: vdbContents lists grids from their headers", "[vdb]") {
    const Folder folder;
    Grids grids = variety();
    auto fog = sphere(), nameless = sphere();
    fog->setGridClass(openvdb::GRID_FOG_VOLUME);
    nameless->setName("");
    auto staggered = velocity();
    staggered->setGridClass(openvdb::GRID_STAGGERED);
    for (const openvdb::GridBase::ConstPtr& grid : Grids{fog, nameless, nameless->copyGrid(), staggered})
        grids.push_back(grid);
    using enum GridKind;
    const std::vector<GridKind> kinds{levelSet, velocity,  levelSet, velocity, other,   other,
                                      points,   fogVolume, levelSet, levelSet, velocity};
    const auto requireContents = [&](const fs::path& path) {
        const auto infos = vdbContents(path);
        REQUIRE(infos.size() == grids.size());
        for (size_t n = 0; n < infos.size(); ++n) {
            CAPTURE(n);
            CHECK(infos[n].name == grids[n]->getName());
            CHECK(infos[n].type == grids[n]->type());
            CHECK(infos[n].kind == kinds[n]);
        }
    };
    writeVdb(folder / "a.vdb", grids, {}, {.half = GENERATE(false, true), .codec = Codec::zip});
    requireContents(folder / "a.vdb");
    {
        std::ofstream out(folder / "stream.vdb", std::ios::binary); // a stream has no offsets
        openvdb::io::Stream(out).write(openvdb::GridCPtrVec(grids.begin(), grids.end()));
    }
    requireContents(folder / "stream.vdb");
    writeVdb(folder / "none.vdb", {});
    CHECK(vdbContents(folder / "none.vdb").empty());
}

TEST_CASE("VdbFile: vdbContents detects damaged headers without reading grids", "[vdb]") {
    const Folder folder;
    writeVdb(folder / "a.vdb", {velocity(), points()});
    const std::string bytes = bytesOf(folder / "a.vdb");
    const fs::path damaged = folder / "damaged.vdb";
    for (size_t size = 1; size < bytes.size(); size += size < 1000 ? 7 : 997) {
        CAPTURE(size);
        store(damaged, bytes.substr(0, size));
        REQUIRE_THROWS_AS(vdbContents(damaged), FileError);
    }
    for (const size_t at : {57, 61, 65}) { // metadata, grids, length of a name
        CAPTURE(at);
        store(damaged, std::string(bytes).replace(at, 4, 4, '\x7f'));
        REQUIRE_THROWS_AS(vdbContents(damaged), FileError);
    }
    std::mt19937 random(1);
    for (int n = 0; n < 700; ++n) { // no damage crashes the program
        std::string changed = bytes;
        changed[random() % 1000] = static_cast<char>(random());
        try {
            vdbContents(store(damaged, changed));
        } catch (const FileError&) {
        }
    }
    store(damaged, std::string(bytes).replace(bytes.find("Tree_vec3s"), 10, "Tree_quark"));
    REQUIRE_THROWS_WITH(vdbContents(damaged), ContainsSubstring("Tree_quark_5_4_3"));
    REQUIRE_THROWS_WITH(vdbContents(folder / "missing.vdb"), ContainsSubstring("no such file"));
    REQUIRE_THROWS_WITH(vdbContents(store(damaged, "v 0 0 0\n")), ContainsSubstring("not a .vdb"));
}

TEST_CASE("VdbFile: a failed write leaves nothing behind", "[vdb]") {
    const Folder folder;
    writeVdb(folder / "a.vdb", {sphere()});
    const std::string earlier = bytesOf(folder / "a.vdb");
    REQUIRE_THROWS_AS(writeVdb(folder / "a.vdb", {velocity()}, {}, {}, [] { return true; }), Interrupted);
    REQUIRE_THROWS_AS(writeVdb(folder / "a.vdb", {velocity(), nullptr}), ValueError);
    CHECK((bytesOf(folder / "a.vdb") == earlier));
    REQUIRE_THROWS_AS(writeVdb(folder / "none" / "b.vdb", {sphere()}), FileError);
    REQUIRE_THROWS_AS(writeVdb(folder.path, {sphere()}), FileError);
    CHECK(folder.files() == 1);
}

TEST_CASE("VdbFile: OpenVDB tools read our files", "[vdb]") {
    const Folder folder;
    const fs::path file = folder / "a.vdb", list = folder / "list.txt";
    writeVdb(file, {sphere(), velocity()}, {}, {.half = true, .codec = Codec::blosc});
    if (std::system("command -v vdb_print >/dev/null") != 0) {
        WARN("vdb_print is not installed");
    } else {
        REQUIRE(std::system(("vdb_print -l " + file.string() + " >" + list.string()).c_str()) == 0);
        CHECK_THAT(bytesOf(list), ContainsSubstring("Name: sphere") && ContainsSubstring("Name: vel"));
    }
    const std::string python = pythonWith("pyopenvdb");
    if (python.empty()) {
        WARN("pyopenvdb is not installed");
    } else {
        const std::string script = "import pyopenvdb as v; g=v.read(\"" + file.string() +
                                   "\",\"vel\"); assert abs(g.getConstAccessor().getValue((19,8,152))[1]-8/3)<2e-3";
        CHECK(std::system((python + " -c '" + script + "'").c_str()) == 0);
    }
}
