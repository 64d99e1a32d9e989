// SPDX-License-Identifier: Apache-2.0
#include "curlew/vdb/NanoFile.h"
#include "support/HostObjects.h"

#include <openvdb/tools/LevelSetSphere.h>

#include <algorithm>
#include <cstring>

using namespace curlew;
using namespace curlew::test;
using Catch::Matchers::ContainsSubstring;
using Folder = ScratchFolder;
using Grids = std::vector<openvdb::GridBase::ConstPtr>;

namespace {

openvdb::FloatGrid::Ptr sphere() {
    auto grid = openvdb::tools::createLevelSetSphere<openvdb::FloatGrid>(1, openvdb::Vec3f(0.25f, 0, 0), 0.125f);
    grid->setName("surface");
    return grid;
}

} // namespace

TEST_CASE("NanoFile: grids are read back as written", "[vdb]") {
    const Folder folder;
    const auto codec = GENERATE(Codec::automatic, Codec::zip, Codec::blosc);
    writeNano(folder / "a.nvdb", {rampGrid(), sphere()}, {.codec = codec});
    const auto infos = nanoContents(folder / "a.nvdb");
    REQUIRE(infos.size() == 2);
    CHECK((infos[0].name == "vel" && infos[0].kind == GridKind::velocity));
    CHECK((infos[1].name == "surface" && infos[1].kind == GridKind::levelSet));
    const auto read = readNano(folder / "a.nvdb");
    REQUIRE(read.size() == 2);
    const auto vel = openvdb::gridPtrCast<openvdb::Vec3SGrid>(read[0]);
    CHECK(vel->activeVoxelCount() == 60);
    CHECK(vel->tree().getValue({1, 4, 9}) == openvdb::Vec3s(1, 4, 90));
    CHECK(vel->indexToWorld(openvdb::Coord(1, 4, 9)) == openvdb::Vec3d(0.5, 2, 4.5));
    const auto distances = openvdb::gridPtrCast<openvdb::FloatGrid>(read[1]);
    CHECK(distances->getGridClass() == openvdb::GRID_LEVEL_SET);
    const auto written = sphere();
    CHECK(distances->activeVoxelCount() == written->activeVoxelCount());
    for (auto value = written->cbeginValueAll(); value; ++value)
        if (distances->tree().getValue(value.getCoord()) != *value) FAIL("differs at " << value.getCoord());
}

TEST_CASE("NanoFile: half precision quantizes floats within their leaf", "[vdb]") {
    const Folder folder;
    writeNano(folder / "full.nvdb", {sphere()});
    writeNano(folder / "half.nvdb", {sphere()}, {.half = true});
    CHECK(std::filesystem::file_size(folder / "half.nvdb") < std::filesystem::file_size(folder / "full.nvdb"));
    const auto distances = openvdb::gridPtrCast<openvdb::FloatGrid>(readNano(folder / "half.nvdb").front());
    // A leaf spans at most the narrow band, 0.75; one of its 65535 steps is below 2e-5 (dithering is off).
    const auto written = sphere();
    for (auto value = written->cbeginValueOn(); value; ++value)
        if (std::abs(distances->tree().getValue(value.getCoord()) - *value) > 2e-5f)
            FAIL("differs at " << value.getCoord());
}

TEST_CASE("NanoFile: the same grids give the same bytes", "[vdb]") {
    const Folder folder;
    const Grids grids{rampGrid(), sphere()};
    writeNano(folder / "a.nvdb", grids);
    { // memory that is not zero
        std::vector<std::vector<char>> used;
        for (int k = 0; k < 64; ++k) used.emplace_back(1 << 20, '\x55');
    }
    writeNano(folder / "b.nvdb", grids);
    CHECK((bytesOf(folder / "a.nvdb") == bytesOf(folder / "b.nvdb")));
}

TEST_CASE("NanoFile: nanovdb_validate and nanovdb_print accept the files", "[vdb]") {
    if (std::system("command -v nanovdb_print > /dev/null 2>&1") != 0) {
        WARN("skipped: nanovdb_print is not installed");
        return;
    }
    const Folder folder;
    for (const bool halved : {false, true}) {
        writeNano(folder / "a.nvdb", {rampGrid(), sphere()}, {.half = halved});
        const std::string file = " '" + (folder / "a.nvdb").string() + "'";
        const std::string out = (folder / "out.txt").string();
        CHECK(std::system(("nanovdb_validate" + file + " > '" + out + "' 2>&1").c_str()) == 0);
        CHECK_THAT(bytesOf(out), !ContainsSubstring("nvalid"));
        CHECK(std::system(("nanovdb_print" + file + " > '" + out + "' 2>&1").c_str()) == 0);
        for (const char* word : {"vel", "surface", "Vec3f", halved ? "Float16" : "float"})
            CHECK_THAT(bytesOf(out), ContainsSubstring(word));
    }
}

TEST_CASE("NanoFile: damaged files are refused", "[vdb]") {
    const Folder folder;
    writeNano(folder / "a.nvdb", {rampGrid()});
    const std::string good = bytesOf(folder / "a.nvdb");
    const auto complaint = [&](const std::string& bytes) {
        return messageOf([&] { readNano(store(folder / "b.nvdb", bytes)); });
    };
    CHECK(complaint(good) == "no error");
    CHECK_THAT(complaint("something else that is long enough"), ContainsSubstring("is not a .nvdb file"));
    for (const size_t size : {10u, 100u, 200u, 1000u, 20000u}) {
        CAPTURE(size);
        CHECK_THAT(complaint(good.substr(0, size)), ContainsSubstring("cut short"));
    }
    std::string older = good;
    const uint32_t version = 31u << 21;
    std::memcpy(&older[8], &version, sizeof version);
    CHECK_THAT(complaint(older), ContainsSubstring("format version 31"));
    // The grid begins after the header (16 bytes), its metadata (176) and its name; its root after 672 + 64 bytes.
    const size_t grid = 16 + 176 + 4;
    std::string table = good;
    const uint32_t entries = 1u << 30;
    std::memcpy(&table[grid + 672 + 64 + 24], &entries, sizeof entries);
    CHECK_THAT(complaint(table), ContainsSubstring("damaged"));
}

TEST_CASE("NanoFile: refuses grids that the format cannot hold", "[vdb]") {
    const Folder folder;
    CHECK_THAT(messageOf([&] { writeNano(folder / "a.nvdb", {}); }), ContainsSubstring("no grid"));
    CHECK_THAT(messageOf([&] { writeNano(folder / "a.nvdb", {openvdb::FloatGrid::create()}); }),
               ContainsSubstring("no active voxels"));
    auto strange = openvdb::Vec3IGrid::create();
    strange->tree().setValue({0, 0, 0}, openvdb::Vec3i(1));
    CHECK_THAT(messageOf([&] { writeNano(folder / "a.nvdb", {strange}); }), ContainsSubstring("a .nvdb holds"));
    CHECK(folder.files() == 0);
}

TEST_CASE("NanoFile: the name of a grid is that of its entry, whatever the grid itself says", "[vdb]") {
    const Folder folder;
    writeNano(folder / "a.nvdb", {rampGrid()});
    std::string bytes = bytesOf(folder / "a.nvdb");
    const size_t grid = 16 + 176 + 4;                             // as above
    const auto flags = littleAt<uint32_t>(bytes, grid + 20) | 1u; // HasLongGridName
    std::memcpy(&bytes[grid + 20], &flags, sizeof flags);
    std::fill_n(&bytes[grid + 40], 256, 'x'); // a short name without an end
    const int64_t offset = int64_t(1) << 45;
    const uint32_t count = 1;
    std::memcpy(&bytes[grid + 640], &offset, sizeof offset); // of the blind data, and how many there are
    std::memcpy(&bytes[grid + 648], &count, sizeof count);
    const auto read = readNano(store(folder / "b.nvdb", bytes));
    REQUIRE(read.size() == 1);
    CHECK(read[0]->getName() == "vel");
    CHECK(read[0]->activeVoxelCount() == 60);
}
