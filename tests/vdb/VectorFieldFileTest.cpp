// SPDX-License-Identifier: Apache-2.0
#include "curlew/vdb/HostConversion.h"
#include "curlew/vdb/Openvdb.h"
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

TEST_CASE("VectorFieldFile: an fga has sizes, bounds and vectors with x fastest", "[vdb]") {
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

TEST_CASE("VectorFieldFile: a field for Unreal is in centimetres with Z up", "[vdb]") {
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

TEST_CASE("VectorFieldFile: a vf has its magic, 16-bit sizes and floats", "[vdb]") {
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

TEST_CASE("VectorFieldFile: mirrored axes reverse the order of the voxels", "[vdb]") {
    const Folder folder;
    const HostProfile& unity = kHostProfiles[7];
    REQUIRE(unity.name == "unity");
    writeVf(folder / "a.vf", *forHost(rampGrid(), {.host = &unity}).front());
    const std::string bytes = bytesOf(folder / "a.vf");
    CHECK(littleAt<float>(bytes, 10) == -1);     // the voxel i = 1, whose velocity along x is mirrored too
    CHECK(littleAt<float>(bytes, 10 + 24) == 1); // the voxel i = -1
}

namespace {

/// A linear field, which trilinear samples and their means reproduce.
openvdb::Vec3d linearAt(const openvdb::Vec3d& p) { return {1 + p[0] - 2 * p[1], 3 * p[2], 0.5 * p[0] + p[1] - p[2]}; }

openvdb::Vec3SGrid::Ptr linearGrid(const openvdb::Coord& size, const openvdb::math::Transform& transform) {
    auto grid = openvdb::Vec3SGrid::create();
    grid->setTransform(transform.copy());
    auto access = grid->getAccessor();
    for (const openvdb::Coord& ijk : openvdb::CoordBBox(openvdb::Coord(0), size - openvdb::Coord(1)))
        access.setValue(ijk, openvdb::Vec3s(linearAt(grid->indexToWorld(ijk))));
    return grid;
}

struct Compared {
    double worst = 0;
    size_t inside = 0;
};

/// Compares the vectors of a .vf with the linear field where all samples lie between voxel centres of the grid.
Compared comparedWithGrid(const std::string& bytes, const FieldBox& box, const openvdb::Vec3SGrid& grid) {
    const openvdb::CoordBBox active = grid.evalActiveVoxelBoundingBox();
    Compared result;
    for (int n = 0; n < box.size[0] * box.size[1] * box.size[2]; ++n) {
        const openvdb::Vec3d ijk(n % box.size[0], n / box.size[0] % box.size[1], n / box.size[0] / box.size[1]);
        openvdb::Vec3d p, edge;
        for (int k = 0; k < 3; ++k) {
            edge[k] = (box.upper[k] - box.lower[k]) / box.size[k];
            p[k] = box.lower[k] + edge[k] * (ijk[k] + 0.5);
        }
        bool inside = true;
        for (int corner = 0; corner < 8; ++corner) {
            openvdb::Vec3d q = p;
            for (int k = 0; k < 3; ++k) q[k] += ((corner >> k & 1) != 0 ? 0.5 : -0.5) * edge[k];
            q = grid.worldToIndex(q);
            for (int k = 0; k < 3; ++k) inside = inside && q[k] >= active.min()[k] && q[k] <= active.max()[k];
        }
        if (!inside) continue;
        ++result.inside;
        const openvdb::Vec3d expected = linearAt(p);
        for (int k = 0; k < 3; ++k) {
            const auto value = littleAt<float>(bytes, 10 + 12 * static_cast<size_t>(n) + 4 * static_cast<size_t>(k));
            result.worst = std::max(result.worst, std::abs(static_cast<double>(value) - expected[k]));
        }
    }
    return result;
}

} // namespace

TEST_CASE("VectorFieldFile: a grid with other axes is resampled", "[vdb]") {
    const Folder folder;
    openvdb::math::Transform::Ptr transform = openvdb::math::Transform::createLinearTransform(0.25);
    transform->postRotate(0.3, openvdb::math::Z_AXIS);
    transform->postRotate(-0.7, openvdb::math::X_AXIS);
    transform->postTranslate({1, -2, 0.5});
    const auto grid = linearGrid({20, 16, 12}, *transform);
    const FieldBox box = writeVf(folder / "a.vf", *grid);
    CHECK(box.resampled);
    for (int k = 0; k < 3; ++k) CHECK((box.upper[k] - box.lower[k]) / box.size[k] == Approx(0.25));
    // Every voxel of the grid is in the box.
    for (auto voxel = grid->cbeginValueOn(); voxel; ++voxel) {
        const openvdb::Vec3d p = grid->indexToWorld(voxel.getCoord());
        for (int k = 0; k < 3; ++k) REQUIRE((p[k] > box.lower[k] && p[k] < box.upper[k]));
    }
    const Compared compared = comparedWithGrid(bytesOf(folder / "a.vf"), box, *grid);
    CHECK(compared.inside > 1000);
    CHECK(compared.worst < 64 * 0x1p-24); // values up to 20 are stored, interpolated and stored again as floats
    CHECK(writeFga(folder / "a.fga", *grid).size == box.size);
}

TEST_CASE("VectorFieldFile: an fga of too many voxels is resampled to 128", "[vdb]") {
    const Folder folder;
    const auto grid = linearGrid({300, 20, 12}, *openvdb::math::Transform::createLinearTransform(0.1));
    const FieldBox box = writeFga(folder / "a.fga", *grid);
    CHECK(box.resampled);
    CHECK(box.size == openvdb::Coord(128, 9, 6));
    CHECK(box.lower[0] == Approx(-0.05));
    CHECK(box.upper[0] == Approx(29.95));
    const auto numbers = numbersOf(bytesOf(folder / "a.fga"));
    REQUIRE(numbers.size() == 9 + 3 * 128 * 9 * 6);
    const double edge = 30.0 / 128;
    double worst = 0;
    for (int i = 1; i < 127; ++i)
        for (int j = 1; j < 8; ++j)
            for (int k = 1; k < 5; ++k) {
                const openvdb::Vec3d p = box.lower + edge * openvdb::Vec3d(i + 0.5, j + 0.5, k + 0.5);
                for (int c = 0; c < 3; ++c)
                    worst = std::max(worst, std::abs(numbers[static_cast<size_t>(9 + 3 * (i + 128 * (j + 9 * k)) + c)] -
                                                     linearAt(p)[c]));
            }
    CHECK(worst < 64 * 0x1p-24);
}

TEST_CASE("VectorFieldFile: refuses what the hosts would refuse or damage", "[vdb]") {
    const Folder folder;
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
    CHECK(folder.files() == 0);
}

TEST_CASE("VectorFieldFile: larger voxels are means of all voxels in them, also of flat ones", "[vdb]") {
    const Folder folder;
    const auto grid = openvdb::Vec3SGrid::create();
    grid->setTransform(openvdb::math::Transform::createLinearTransform(1));
    grid->transform().preScale(openvdb::Vec3d(0.1, 1, 1));
    auto access = grid->getAccessor();
    for (int i = 0; i < 1000; ++i)
        for (int j = 0; j < 4; ++j)
            for (int k = 0; k < 4; ++k) access.setValue({i, j, k}, openvdb::Vec3s(i % 2 == 0 ? 1.0f : -1.0f));
    const FieldBox box = writeFga(folder / "a.fga", *grid);
    REQUIRE(box.size[0] == 128);
    const auto numbers = numbersOf(bytesOf(folder / "a.fga"));
    double worst = 0;
    for (size_t n = 9; n < numbers.size(); ++n) worst = std::max(worst, std::abs(numbers[n]));
    CHECK(worst < 0.2); // of eight samples of alternating signs, the last one may be of half a voxel
}
