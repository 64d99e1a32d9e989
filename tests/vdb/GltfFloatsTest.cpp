// SPDX-License-Identifier: Apache-2.0
#include "support/BentBar.h"
#include "support/Places.h"

#include <boost/archive/iterators/base64_from_binary.hpp>
#include <boost/archive/iterators/transform_width.hpp>

#include <cmath>
#include <numbers>

using namespace curlew;
using Catch::Matchers::ContainsSubstring;
using nlohmann::json;
using test::complaintAbout;
using test::furthest;
using test::Glb;
using test::kRounding;
using test::readModel;

namespace {

constexpr double kRight = std::numbers::pi / 2;
constexpr double kShare = 0.2; // of the first bone at y = 1: a whole number of bytes and of shorts

json& attributesOf(Glb& glb) { return glb.root["meshes"][0]["primitives"][0]["attributes"]; }

/// Returns the weights of the bendingBar(), in units of 1 / `one`.
template <class T>
std::vector<T> weightsOf(double one) {
    const test::Bar bar;
    std::vector<T> weights;
    for (size_t n = 0; n < bar.points.size() / 3; ++n) {
        const float y = bar.points[3 * n + 1];
        const double first = y < 1 ? 1 : y > 1 ? 0 : kShare;
        for (const double w : {first, 1 - first, 0.0, 0.0}) weights.push_back(static_cast<T>(std::lround(one * w)));
    }
    return weights;
}

/// Returns the points of the bar with these weights.
std::vector<openvdb::Vec3d> bent(double angle) { return test::bentBar(angle, kShare); }

std::string base64(const std::string& bytes) {
    using namespace boost::archive::iterators;
    using Letters = base64_from_binary<transform_width<const char*, 6, 8>>;
    REQUIRE(bytes.size() % 3 == 0);
    return std::string(Letters(bytes.data()), Letters(bytes.data() + bytes.size()));
}

} // namespace

TEMPLATE_TEST_CASE("GltfFloats: skin weights in bytes and shorts bind points to all their bones", "[vdb]", uint8_t,
                   uint16_t) {
    const test::ScratchFolder folder;
    Glb glb = test::bendingBar();
    constexpr double kOne = std::numeric_limits<TestType>::max();
    attributesOf(glb)["WEIGHTS_0"] = glb.addIntegers(weightsOf<TestType>(kOne), "VEC4", true);
    const AnimatedMesh model = readModel(folder, "bend.glb", glb.bytes());
    for (const double t : {0.0, 0.3, 1.0}) CHECK(furthest(model.at({.seconds = t}), bent(t * kRight)) < kRounding);
}

TEST_CASE("GltfFloats: joints and weights of a point may come in two sets", "[vdb]") {
    const test::ScratchFolder folder;
    Glb glb = test::bendingBar();
    const std::vector<uint8_t> both = weightsOf<uint8_t>(255);
    std::vector<uint8_t> first = both, second = both, lower(both.size(), 0), upper(both.size(), 1);
    for (size_t k = 0; k < both.size(); ++k) (k % 4 == 0 ? second : first)[k] = 0;
    for (size_t k = 0; k < both.size(); k += 4) std::swap(second[k], second[k + 1]);
    attributesOf(glb)["JOINTS_0"] = glb.addIntegers(lower, "VEC4", false);
    attributesOf(glb)["WEIGHTS_0"] = glb.addIntegers(first, "VEC4", true);
    attributesOf(glb)["JOINTS_1"] = glb.addIntegers(upper, "VEC4", false);
    attributesOf(glb)["WEIGHTS_1"] = glb.addIntegers(second, "VEC4", true);
    CHECK(furthest(readModel(folder, "two.glb", glb.bytes()).at({.seconds = 1}), bent(kRight)) < kRounding);
}

TEST_CASE("GltfFloats: rotations of an animation may be normalized shorts", "[vdb]") {
    const test::ScratchFolder folder;
    Glb glb = test::bendingBar();
    attributesOf(glb)["WEIGHTS_0"] = glb.addIntegers(weightsOf<uint8_t>(255), "VEC4", true);
    const auto root = static_cast<int16_t>(std::lround(32767 * std::sqrt(0.5)));
    const std::vector<int16_t> turns{0, 0, 0, 32767, 0, 0, root, root};
    glb.root["animations"][0]["samplers"][0]["output"] = glb.addIntegers(turns, "VEC4", true);
    const AnimatedMesh model = readModel(folder, "bend.glb", glb.bytes());
    // A component is off by up to 1.5e-5, so the arm of 1 is off by up to 2 x 1.5e-5 x sqrt(2).
    for (const double t : {0.0, 0.3, 1.0}) CHECK(furthest(model.at({.seconds = t}), bent(t * kRight)) < 5e-5);
}

// The positions in the file have 16 bits for a height of 2, so each coordinate is off by up to 2^-16.
TEST_CASE("GltfFloats: Draco decodes weights in bytes to floats", "[vdb]") {
    const AnimatedMesh model = AnimatedMesh::read(test::dataDir() + "/bar_draco.glb");
    for (const double t : {0.0, 0.3, 1.0}) CHECK(furthest(model.at({.seconds = t}), bent(t * kRight)) < 2 * 0x1p-16);
}

TEST_CASE("GltfFloats: KHR_mesh_quantization with interleaved bytes and sparse morph targets", "[vdb]") {
    const test::ScratchFolder folder;
    const test::Bar bar;
    Glb glb;
    std::vector<int8_t> tenths; // padded to four bytes a point, as alignment asks
    for (size_t k = 0; k < bar.points.size(); ++k) {
        tenths.push_back(static_cast<int8_t>(std::lround(10 * bar.points[k])));
        if (k % 3 == 2) tenths.push_back(99);
    }
    const int positions = glb.addIntegers(tenths, "VEC4", false);
    glb.root["accessors"][positions]["type"] = "VEC3";
    glb.root["bufferViews"][positions]["byteStride"] = 4;
    // The target moves the last point by (0.3, 0, -0.1).
    const int index = glb.addIntegers(std::vector<uint8_t>{19, 0, 0, 0}, "VEC4", false);
    const int offset = glb.addIntegers(std::vector<int8_t>{3, 0, -1, 0}, "VEC4", false);
    const json sparse{{"count", 1},
                      {"indices", {{"bufferView", index}, {"componentType", 5121}}},
                      {"values", {{"bufferView", offset}}}};
    glb.root["accessors"].push_back({{"componentType", 5120}, {"type", "VEC3"}, {"count", 20}, {"sparse", sparse}});
    const json targets{{{"POSITION", glb.root["accessors"].size() - 1}}};
    const json primitive{
        {"attributes", {{"POSITION", positions}}}, {"indices", glb.add(bar.corners, "SCALAR")}, {"targets", targets}};
    glb.root["meshes"] = {{{"primitives", {primitive}}, {"weights", {1}}}};
    glb.root["nodes"] = {{{"mesh", 0}, {"scale", {0.1, 0.1, 0.1}}}};
    glb.root["extensionsUsed"] = glb.root["extensionsRequired"] = {"KHR_mesh_quantization"};
    std::vector<openvdb::Vec3d> points = bent(0);
    points.back() += openvdb::Vec3d(0.3, 0, -0.1);
    CHECK(furthest(readModel(folder, "quantized.glb", glb.bytes()).at({}), points) < kRounding);
}

TEST_CASE("GltfFloats: integers may be in a data URI or in a separate file", "[vdb]") {
    const test::ScratchFolder folder;
    Glb glb = test::bendingBar();
    attributesOf(glb)["WEIGHTS_0"] = glb.addIntegers(weightsOf<uint8_t>(255), "VEC4", true);
    std::string bytes = glb.binary();
    bytes.resize((bytes.size() + 2) / 3 * 3, '\0');
    json& buffer = glb.root["buffers"][0] = {{"byteLength", bytes.size()}};
    buffer["uri"] = "data:application/octet-stream;base64," + base64(bytes);
    CHECK(furthest(readModel(folder, "inside.gltf", glb.root.dump()).at({.seconds = 1}), bent(kRight)) < kRounding);
    buffer["uri"] = "data:application/octet-stream;base64,%%%%";
    CHECK_THAT(complaintAbout(folder, "letters.gltf", glb.root.dump()), ContainsSubstring("not base64"));
    buffer["uri"] = "bend.bin";
    CHECK_THAT(complaintAbout(folder, "apart.gltf", glb.root.dump()), ContainsSubstring("bend.bin"));
    test::store(folder / "bend.bin", bytes);
    CHECK(furthest(readModel(folder, "apart.gltf", glb.root.dump()).at({.seconds = 1}), bent(kRight)) < kRounding);
    buffer.erase("uri");
    CHECK_THAT(complaintAbout(folder, "none.gltf", glb.root.dump()), ContainsSubstring("buffer without uri"));
}

TEST_CASE("GltfFloats: integers that are not in the file are refused", "[vdb]") {
    const test::ScratchFolder folder;
    Glb glb = test::bendingBar();
    const int weights = glb.addIntegers(weightsOf<uint8_t>(255), "VEC4", true);
    attributesOf(glb)["WEIGHTS_0"] = weights;
    const json good = glb.root;
    const auto complaintWith = [&](const char* list, const char* name, const json& value) {
        glb.root = good;
        glb.root[list][weights][name] = value;
        return complaintAbout(folder, "bad.glb", glb.bytes());
    };
    CHECK(complaintAbout(folder, "good.glb", glb.bytes()) == "nothing");
    CHECK_THAT(complaintWith("accessors", "count", 21), ContainsSubstring("cut short or damaged"));
    CHECK_THAT(complaintWith("accessors", "byteOffset", 81), ContainsSubstring("cut short or damaged"));
    CHECK_THAT(complaintWith("accessors", "bufferView", 99), ContainsSubstring("not that of a glTF"));
    CHECK_THAT(complaintWith("accessors", "type", "VEC5"), ContainsSubstring("type that does not exist"));
    CHECK_THAT(complaintWith("bufferViews", "byteOffset", 1 << 20), ContainsSubstring("cut short or damaged"));
    CHECK_THAT(complaintWith("bufferViews", "byteOffset", -4), ContainsSubstring("cut short or damaged"));
    CHECK_THAT(complaintWith("bufferViews", "byteLength", "many"), ContainsSubstring("not that of a glTF"));
    const std::string deep = std::string(300, '[') + std::string(300, ']');
    CHECK_THAT(complaintAbout(folder, "deep.gltf", R"({"asset": )" + deep + "}"), ContainsSubstring("200 levels deep"));
}
