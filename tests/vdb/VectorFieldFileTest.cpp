// SPDX-License-Identifier: Apache-2.0
#include "curlew/vdb/HostConversion.h"
#include "curlew/vdb/VectorFieldFile.h"
#include "support/HostObjects.h"

#include <cstdlib>

using namespace curlew;
using namespace curlew::test;
using Catch::Matchers::ContainsSubstring;
using Folder = ScratchFolder;

namespace {

/// The numbers of an .fga as Unreal's importer takes them: up to each comma, with blanks before them.
std::vector<double> numbersOf(const std::string& text) {
    std::vector<double> numbers;
    size_t begin = 0;
    while (begin < text.size()) {
        const size_t end = std::min(text.find(',', begin), text.size());
        numbers.push_back(std::strtod(text.substr(begin, end - begin).c_str(), nullptr));
        begin = end + 1;
    }
    return numbers;
}

} // namespace

TEST_CASE("VectorFieldFile: an fga has sizes, bounds and vectors with x fastest", "[vdb][VectorFieldFile]") {
    const Folder folder;
    const FieldBox box = writeFga(folder / "a.fga", *rampGrid());
    CHECK(box.size == openvdb::Coord(3, 4, 5));
    const auto numbers = numbersOf(bytesOf(folder / "a.fga"));
    REQUIRE(numbers.size() == 3 + 6 + 3 * 60);
    CHECK(std::vector<double>(numbers.begin(), numbers.begin() + 9) ==
          std::vector<double>{3, 4, 5, -0.75, 0.75, 3.25, 0.75, 2.75, 5.75});
    for (int n = 0; n < 60; ++n) {
        const int i = n % 3 - 1, j = n / 3 % 4 + 2, k = n / 12 + 7;
        CAPTURE(n);
        CHECK(numbers[9 + 3 * static_cast<size_t>(n)] == i);
        CHECK(numbers[10 + 3 * static_cast<size_t>(n)] == j);
        CHECK(numbers[11 + 3 * static_cast<size_t>(n)] == 10 * k);
    }
}

TEST_CASE("VectorFieldFile: a field for Unreal is in centimetres with Z up", "[vdb][VectorFieldFile]") {
    const Folder folder;
    const HostProfile& unreal = kHostProfiles[6];
    REQUIRE(unreal.name == "unreal");
    const auto grid = openvdb::GridBase::grid<openvdb::Vec3SGrid>(forHost(rampGrid(), {.host = &unreal}).front());
    writeFga(folder / "a.fga", *grid);
    const auto numbers = numbersOf(bytesOf(folder / "a.fga"));
    CHECK(std::vector<double>(numbers.begin(), numbers.begin() + 9) ==
          std::vector<double>{3, 5, 4, -75, 325, 75, 75, 575, 275});
    // The second vector is one voxel along x: (0, 2, 70) m/s becomes (0, 7000, 200) cm/s.
    CHECK(std::vector<double>(numbers.begin() + 12, numbers.begin() + 15) == std::vector<double>{0, 7000, 200});
}

TEST_CASE("VectorFieldFile: a vf has its magic, 16-bit sizes and floats", "[vdb][VectorFieldFile]") {
    const Folder folder;
    writeVf(folder / "a.vf", *rampGrid());
    const std::string bytes = bytesOf(folder / "a.vf");
    REQUIRE(bytes.size() == 10 + 60 * 12);
    CHECK(bytes.substr(0, 4) == "VF_V");
    for (size_t k = 0; k < 3; ++k) CHECK(littleAt<uint16_t>(bytes, 4 + 2 * k) == 3 + k);
    CHECK(littleAt<float>(bytes, 10) == -1);
    CHECK(littleAt<float>(bytes, 10 + 12) == 0);           // the next along x
    CHECK(littleAt<float>(bytes, 10 + 3 * 12 + 4) == 3);   // the next along y
    CHECK(littleAt<float>(bytes, 10 + 12 * 12 + 8) == 80); // the next along z

    auto density = openvdb::FloatGrid::create();
    density->tree().setValue({4, 4, 4}, 0.25f);
    density->tree().setValue({5, 4, 4}, 0.5f);
    writeVf(folder / "b.vf", *density);
    CHECK(bytesOf(folder / "b.vf") == std::string("VF_F\2\0\1\0\1\0\0\0\x80\x3e\0\0\0\x3f", 18));
}

TEST_CASE("VectorFieldFile: mirrored axes reverse the order of the voxels", "[vdb][VectorFieldFile]") {
    const Folder folder;
    const HostProfile& unity = kHostProfiles[7];
    REQUIRE(unity.name == "unity");
    writeVf(folder / "a.vf", *forHost(rampGrid(), {.host = &unity}).front());
    const std::string bytes = bytesOf(folder / "a.vf");
    CHECK(littleAt<float>(bytes, 10) == -1);     // the voxel i = 1, whose velocity along x is mirrored too
    CHECK(littleAt<float>(bytes, 10 + 24) == 1); // the voxel i = -1
}

TEST_CASE("VectorFieldFile: refuses what the hosts would refuse or damage", "[vdb][VectorFieldFile]") {
    const Folder folder;
    auto wide = rampGrid();
    wide->tree().setValue({200, 2, 7}, openvdb::Vec3s(1));
    CHECK_THAT(messageOf([&] { writeFga(folder / "a.fga", *wide); }),
               ContainsSubstring("202 x 4 x 5") && ContainsSubstring("at most 128") && ContainsSubstring("dim=128"));
    auto fast = rampGrid();
    fast->tree().setValue({0, 2, 7}, openvdb::Vec3s(0, 7e4f, 0));
    CHECK_THAT(messageOf([&] { writeFga(folder / "a.fga", *fast); }), ContainsSubstring("65504"));
    auto nan = rampGrid();
    nan->tree().setValue({0, 2, 7}, openvdb::Vec3s(0, std::numeric_limits<float>::quiet_NaN(), 0));
    CHECK_THAT(messageOf([&] { writeVf(folder / "a.vf", *nan); }), ContainsSubstring("not finite"));
    CHECK_THAT(messageOf([&] { writeVf(folder / "a.vf", *openvdb::FloatGrid::create()); }),
               ContainsSubstring("no active voxels"));
    CHECK_THAT(messageOf([&] { writeVf(folder / "a.vf", *openvdb::Int32Grid::create(1)); }),
               ContainsSubstring("int32"));
    auto oblique = rampGrid();
    oblique->transform().postRotate(0.3, openvdb::math::Z_AXIS);
    CHECK_THAT(messageOf([&] { writeFga(folder / "a.fga", *oblique); }), ContainsSubstring("not aligned"));
    CHECK(folder.files() == 0);
}
