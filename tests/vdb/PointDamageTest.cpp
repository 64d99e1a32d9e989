// SPDX-License-Identifier: Apache-2.0
// Damaged point files: reading one gives an error or the same points.

#include "curlew/base/Error.h"
#include "curlew/vdb/Openvdb.h"
#include "curlew/vdb/PointFile.h"
#include "curlew/vdb/VdbFile.h"
#include "support/Catch.h"
#include "support/Files.h"

#include <blosc.h>
#include <openvdb/io/File.h>
#include <openvdb/io/Stream.h>
#include <openvdb/points/AttributeArrayString.h>
#include <openvdb/points/PointAttribute.h>
#include <openvdb/points/PointConversion.h>

#include <cstring>
#include <optional>
#include <random>
#include <sstream>
#include <string>

using namespace curlew;
namespace fs = std::filesystem;
namespace vp = openvdb::points;
using test::bytesOf;
using Folder = test::ScratchFolder;
using test::store;

namespace {

Points somePoints(size_t count) {
    std::mt19937 random(7);
    std::uniform_real_distribution<double> in(-1, 1);
    Points p;
    for (size_t n = 0; n < count; ++n) {
        for (auto* values : {&p.x, &p.y, &p.z}) values->push_back(in(random));
        for (auto* values : {&p.vx, &p.vy, &p.vz}) values->push_back(float(n % 3));
        p.id.push_back(int64_t(count - n));
        p.age.push_back(0.5f); // uniform: stored as a single value
    }
    return p;
}

/// Several leaves with seven attributes; one of them is text.
vp::PointDataGrid::Ptr grid(size_t count = 300) {
    auto points = pointGrid(somePoints(count), {.voxelSize = 0.1});
    const auto descriptor = vp::makeDescriptorUnique(points->tree());
    vp::StringMetaInserter(descriptor->getMetadata()).insert("smoke");
    vp::appendAttribute(points->tree(), "kind", vp::StringAttributeArray::attributeType());
    for (auto leaf = points->tree().beginLeaf(); leaf; ++leaf) {
        vp::StringAttributeWriteHandle kind(leaf->attributeArray("kind"),
                                            leaf->attributeSet().descriptor().getMetadata());
        kind.set(0, "smoke");
    }
    return points;
}

bool same(const Points& a, const Points& b) {
    return a.x == b.x && a.y == b.y && a.z == b.z && a.vx == b.vx && a.vy == b.vy && a.vz == b.vz && a.id == b.id &&
           a.age == b.age;
}

/// Returns nullopt if the file is refused.
std::optional<Points> pointsIn(const fs::path& path) {
    try {
        Points all;
        for (const auto& one : readVdb(path))
            if (const auto points = openvdb::gridPtrCast<vp::PointDataGrid>(one)) all = pointsOf(*points);
        return all;
    } catch (const Error&) {
        return {};
    }
}

/// Returns the bytes after one random kind of damage: bytes flipped, lost, duplicated or copied from elsewhere, or a
/// number made very large or small.
std::string damaged(std::string bytes, std::mt19937& random) {
    const auto place = [&](size_t size) { return random() % (bytes.size() - size); };
    const size_t length = 1 + random() % 16;
    const auto number = [&](auto value) { std::memcpy(&bytes[place(sizeof value)], &value, sizeof value); };
    switch (random() % 8) {
        case 0:
            bytes[place(1)] ^= static_cast<char>(1 << random() % 8);
            break;
        case 1:
            bytes.insert(place(1), 1, static_cast<char>(random()));
            break;
        case 2:
            bytes.erase(place(length), length);
            break;
        case 3:
            bytes.insert(place(length), bytes.substr(place(length), length));
            break;
        case 4:
            bytes.replace(place(length), length, bytes.substr(place(length), length));
            break;
        case 5:
            number(uint32_t(random()) >> random() % 32);
            break;
        case 6:
            number(random() % 2 ? int64_t(-1) : int64_t(1) << random() % 63);
            break;
        default:
            bytes.resize(place(1));
    }
    return bytes;
}

/// Returns a file as OpenVDB's own classes write it, with a random UUID.
std::string foreign(const Folder& folder, const openvdb::GridBase::ConstPtr& points, uint32_t flags, bool asStream) {
    const openvdb::GridCPtrVec list{points};
    if (asStream) {
        std::ostringstream out;
        openvdb::io::Stream stream(out);
        stream.setCompression(flags);
        stream.write(list);
        return out.str();
    }
    openvdb::io::File file((folder / "foreign.vdb").string());
    file.setCompression(flags);
    file.write(list);
    return bytesOf(folder / "foreign.vdb");
}

constexpr uint32_t kPacked = openvdb::io::COMPRESS_BLOSC | openvdb::io::COMPRESS_ACTIVE_MASK;

} // namespace

TEST_CASE("damaged points: a corrupted file of ours is refused or gives the same points", "[vdb]") {
    const Folder folder;
    const auto codec = GENERATE(Codec::none, Codec::blosc, Codec::zip);
    writeVdb(folder / "a.vdb", {grid()}, {}, {.codec = codec});
    const std::string bytes = bytesOf(folder / "a.vdb");
    const auto whole = pointsIn(folder / "a.vdb");
    REQUIRE(whole);
    REQUIRE(whole->size() == 300);
    std::mt19937 random(1);
    for (int n = 0; n < 250; ++n) {
        CAPTURE(n);
        const std::string changed = damaged(bytes, random);
        const auto read = pointsIn(store(folder / "b.vdb", changed));
        if (changed == bytes)
            REQUIRE(read);
        else if (read)
            REQUIRE(same(*read, *whole));
    }
}

TEST_CASE("damaged points: corrupted foreign files never crash the reader", "[vdb]") {
    const Folder folder;
    const auto flags = GENERATE(uint32_t(openvdb::io::COMPRESS_NONE), kPacked);
    const bool asStream = GENERATE(false, true);
    CAPTURE(flags, asStream);
    const std::string bytes = foreign(folder, grid(), flags, asStream);
    REQUIRE(pointsIn(store(folder / "a.vdb", bytes)));
    std::mt19937 random(2);
    int refused = 0;
    for (int n = 0; n < 150; ++n) {
        const auto read = pointsIn(store(folder / "b.vdb", damaged(bytes, random)));
        refused += read ? 0 : 1;
        if (read) CHECK((read->size() == 300 || read->size() == 0));
    }
    CHECK(refused > 40);
}

TEST_CASE("damaged points: one inserted or deleted byte is detected anywhere", "[vdb]") {
    const Folder folder;
    const auto flags = GENERATE(uint32_t(openvdb::io::COMPRESS_NONE), kPacked);
    const bool asStream = GENERATE(false, true);
    // Without text, an inserted byte of an unpacked page moves all values behind it, and nothing else changes.
    const bool withText = GENERATE(false, true);
    CAPTURE(flags, asStream, withText);
    const auto points = withText ? grid() : pointGrid(somePoints(300), {.voxelSize = 0.1});
    const std::string bytes = foreign(folder, points, flags, asStream);
    const auto whole = pointsIn(store(folder / "a.vdb", bytes));
    REQUIRE(whole);
    std::mt19937 random(3);
    for (int n = 0; n < 200; ++n) {
        std::string changed = bytes;
        const size_t at = random() % bytes.size();
        CAPTURE(n, at, bytes.size());
        if (n % 2 == 0)
            changed.insert(at, 1, static_cast<char>(random()));
        else
            changed.erase(at, 1);
        const auto read = pointsIn(store(folder / "b.vdb", changed));
        if (read) REQUIRE(same(*read, *whole));
    }
}

TEST_CASE("damaged points: headers of compressed blocks must match their surroundings", "[vdb]") {
    const Folder folder;
    const std::string bytes = foreign(folder, grid(3000), kPacked, false);
    int headers = 0;
    for (size_t at = 57; at + BLOSC_MIN_HEADER_LENGTH < bytes.size(); ++at) {
        size_t size = 0, packed = 0, block = 0;
        blosc_cbuffer_sizes(&bytes[at], &size, &packed, &block);
        const bool begins =
            bytes[at] == BLOSC_VERSION_FORMAT && bytes[at + 1] == BLOSC_LZ4_VERSION_FORMAT && bytes[at + 3] == 4;
        if (!begins || size > (1 << 20) || block > size || packed < 20 || packed > bytes.size() - at) continue;
        if (++headers > 40) break;
        CAPTURE(at, size, packed);
        for (const size_t field : {4u, 12u}) // the unpacked size and the packed size
            for (const int change : {-1, 1, -16}) {
                std::string changed = bytes;
                uint32_t value = 0;
                std::memcpy(&value, &changed[at + field], sizeof value);
                value += uint32_t(change);
                std::memcpy(&changed[at + field], &value, sizeof value);
                CHECK(!pointsIn(store(folder / "b.vdb", changed)));
            }
    }
    CHECK(headers > 10);
}

TEST_CASE("damaged points: a small file with four billion points is refused for lack of memory", "[vdb]") {
    openvdb::initialize();
    const Folder folder;
    using Leaf = vp::PointDataTree::LeafNodeType;
    constexpr uint32_t count = 4'000'000'000;
    auto points = vp::PointDataGrid::create();
    auto* leaf = points->tree().touchLeaf({0, 0, 0});
    const auto type = vp::TypedAttributeArray<openvdb::Vec3s, vp::NullCodec>::attributeType();
    leaf->initializeAttributes(vp::AttributeSet::Descriptor::create(type), count); // each array holds a single value
    leaf->setOffsets(std::vector<Leaf::ValueType>(Leaf::SIZE, Leaf::ValueType(count)));
    writeVdb(folder / "a.vdb", {points}, {}, {.codec = Codec::blosc});
    CHECK(fs::file_size(folder / "a.vdb") < 20000);
    const auto read = readVdb(folder / "a.vdb");
    CHECK_THROWS_AS(pointsOf(*openvdb::gridPtrCast<vp::PointDataGrid>(read.at(0))), ResourceError);
}

TEST_CASE("damaged points: reading can be cancelled", "[vdb]") {
    const Folder folder;
    writeVdb(folder / "a.vdb", {grid()});
    CHECK_THROWS_AS(readVdb(folder / "a.vdb", {.report = {}, .cancelled = [] { return true; }}), Interrupted);
    const auto read = readVdb(folder / "a.vdb");
    const auto points = openvdb::gridPtrCast<vp::PointDataGrid>(read.at(0));
    CHECK_THROWS_AS(pointsOf(*points, {.report = {}, .cancelled = [] { return true; }}), Interrupted);
}
