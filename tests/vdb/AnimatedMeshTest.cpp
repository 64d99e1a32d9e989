// SPDX-License-Identifier: Apache-2.0
#include "curlew/base/Error.h"
#include "curlew/base/Text.h"
#include "curlew/vdb/AnimatedMesh.h"
#include "curlew/vdb/Openvdb.h"
#include "support/BentBar.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <set>

using namespace curlew;
using Catch::Matchers::ContainsSubstring;
using nlohmann::json;
using openvdb::Vec3d;
using openvdb::Vec3s;
using Folder = test::ScratchFolder;
using test::barPoints;
using test::bentBar;
using test::complaintAbout;
using test::furthest;
using test::Glb;
using test::kRounding;
using test::readModel;
using test::turned;

namespace {

/// The bar without bones, as the only mesh. The caller adds the nodes.
Glb barGlb() {
    const test::Bar bar;
    Glb glb;
    const json attributes{{"POSITION", glb.add(bar.points, "VEC3")}};
    glb.root["meshes"] = {
        {{"primitives", {{{"attributes", attributes}, {"indices", glb.add(bar.corners, "SCALAR")}}}}}};
    return glb;
}

double volumeOf(const Mesh& mesh) {
    double six = 0;
    for (const auto& t : mesh.triangles)
        six += Vec3d(mesh.points[t[0]]).dot(Vec3d(mesh.points[t[1]]).cross(Vec3d(mesh.points[t[2]])));
    return six / 6;
}

} // namespace

TEST_CASE("AnimatedMesh: node transforms place a glb mesh", "[vdb]") {
    const Folder folder;
    Glb glb = barGlb();
    const float root = std::sqrt(0.5f);
    glb.root["nodes"] = {{{"children", {1}}, {"translation", {1, 2, 3}}, {"rotation", {0, 0, root, root}}},
                         {{"mesh", 0}, {"scale", {2, 1, 0.5}}}};
    const AnimatedMesh model = readModel(folder, "bar.glb", glb.bytes());
    CHECK(model.units() == "metres, Y up");
    CHECK(model.clips().empty());
    std::vector<Vec3d> points = barPoints();
    for (Vec3d& p : points) p = turned(p * Vec3d(2, 1, 0.5), std::numbers::pi / 2) + Vec3d(1, 2, 3);
    const Mesh mesh = model.at({});
    CHECK(furthest(mesh, points) < kRounding);
    CHECK(topologyOf(mesh).closed());
    CHECK(volumeOf(mesh) == Approx(0.32));
}

TEST_CASE("AnimatedMesh: a mesh used by two nodes appears twice and mirrored copies keep their orientation", "[vdb]") {
    const Folder folder;
    Glb glb = barGlb();
    glb.root["scenes"] = {{{"nodes", {0, 1}}}};
    glb.root["nodes"] = {{{"mesh", 0}}, {{"mesh", 0}, {"translation", {3, 0, 0}}, {"scale", {-1, 1, 1}}}};
    const Mesh mesh = readModel(folder, "two.glb", glb.bytes()).at({});
    CHECK(mesh.points.size() == 40);
    CHECK(mesh.triangles.size() == 72);
    CHECK(volumeOf(mesh) == Approx(0.64));
}

TEST_CASE("AnimatedMesh: a skin of two bones follows linear blend skinning", "[vdb]") {
    const Folder folder;
    const AnimatedMesh model = readModel(folder, "bend.glb", test::bendingBar().bytes());
    REQUIRE(model.clips().size() == 2);
    CHECK(model.clips()[0].name == "bend");
    CHECK(model.clips()[0].seconds == Approx(1));
    CHECK_FALSE(model.clips()[0].cyclic);
    CHECK(model.clips()[1].cyclic);
    CHECK(furthest(model.at({.clip = {}}), barPoints()) < kRounding);
    const Mesh first = model.at({});
    CHECK(topologyOf(first).closed());
    const double right = std::numbers::pi / 2;
    for (const double t : {0.0, 0.1, 0.25, 0.5, 0.9, 1.0}) {
        CAPTURE(t);
        const Mesh mesh = model.at({.seconds = t});
        CHECK(furthest(mesh, bentBar(t * right)) < kRounding);
        CHECK(mesh.triangles == first.triangles);
    }
    // After its end a clip stays in its last pose or repeats: as the file says, or as the caller says.
    CHECK(furthest(model.at({.seconds = 1.25}), bentBar(right)) < kRounding);
    CHECK(furthest(model.at({.seconds = 1.25, .end = ClipEnd::loop}), bentBar(0.25 * right)) < kRounding);
    CHECK(furthest(model.at({.clip = 1, .seconds = 2.25}), bentBar(0.25 * right)) < kRounding);
    CHECK(furthest(model.at({.clip = 1, .seconds = 2.25, .end = ClipEnd::hold}), bentBar(0)) < kRounding);
}

TEST_CASE("AnimatedMesh: clips are selected by name or index and start at their first key", "[vdb]") {
    const Folder folder;
    Glb glb = test::bendingBar();
    const float root = std::sqrt(0.5f);
    const json sampler{{"input", glb.add(std::vector<float>{5, 6}, "SCALAR")},
                       {"output", glb.add(std::vector<float>{0, 0, 0, 1, 0, 0, root, root}, "VEC4")}};
    const json channel{{"sampler", 0}, {"target", {{"node", 2}, {"path", "rotation"}}}};
    glb.root["animations"].push_back({{"name", "late"}, {"samplers", {sampler}}, {"channels", {channel}}});
    const AnimatedMesh model = readModel(folder, "late.glb", glb.bytes());
    CHECK(model.clip("sway") == 1);
    CHECK(model.clip("2") == 2);
    CHECK_THROWS_WITH(model.clip("run"),
                      ContainsSubstring("there is no clip 'run'") && ContainsSubstring("0 'bend', 1 'sway', 2 'late'"));
    CHECK_THROWS_WITH(model.clip("3"), ContainsSubstring("there is no clip '3'"));
    CHECK_THROWS_AS(model.at({.clip = 3}), ValueError);
    CHECK(model.clips()[2].seconds == Approx(1));
    CHECK(furthest(model.at({.clip = 2, .seconds = 0.5}), bentBar(std::numbers::pi / 4)) < kRounding);
}

TEST_CASE("AnimatedMesh: morph targets move points by their weights", "[vdb]") {
    const Folder folder;
    Glb glb = barGlb();
    const size_t points = barPoints().size();
    std::vector<float> up, out;
    for (size_t n = 0; n < points; ++n) {
        up.insert(up.end(), {0, static_cast<float>(n), 0});
        out.insert(out.end(), {1, 0, 0});
    }
    json& primitive = glb.root["meshes"][0]["primitives"][0];
    primitive["targets"] = {{{"POSITION", glb.add(up, "VEC3")}}, {{"POSITION", glb.add(out, "VEC3")}}};
    glb.root["meshes"][0]["weights"] = {0.25, 0};
    glb.root["nodes"] = {{{"name", "face"}, {"mesh", 0}, {"translation", {0, 0, 1}}}};
    const json sampler{{"input", glb.add(std::vector<float>{0, 2}, "SCALAR")},
                       {"output", glb.add(std::vector<float>{0, 0, 1, 0.5}, "SCALAR")}};
    const json channel{{"sampler", 0}, {"target", {{"node", 0}, {"path", "weights"}}}};
    glb.root["animations"] = {{{"name", "talk"}, {"samplers", {sampler}}, {"channels", {channel}}}};
    const AnimatedMesh model = readModel(folder, "face.glb", glb.bytes());
    REQUIRE(model.clips().size() == 1);
    const auto shaped = [&](double first, double second) {
        std::vector<Vec3d> all = barPoints();
        for (size_t n = 0; n < all.size(); ++n) all[n] += Vec3d(second, first * double(n), 1);
        return all;
    };
    for (const double t : {0.0, 0.5, 2.0}) {
        CAPTURE(t);
        CHECK(furthest(model.at({.seconds = t}), shaped(t / 2, t / 4)) < 10 * kRounding); // positions up to 21
    }
}

TEST_CASE("AnimatedMesh: coincident points are merged only if they move alike", "[vdb]") {
    const Folder folder;
    // Each triangle has its own points, as at texture seams. The two triangles share an edge.
    Glb glb;
    const std::vector<float> points{0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0};
    const std::vector<uint16_t> corners{0, 1, 2, 3, 4, 5};
    const auto model = [&](const std::vector<uint16_t>& joints) {
        Glb made = test::bendingBar();
        std::vector<float> weights;
        for (size_t n = 0; n < 6; ++n) weights.insert(weights.end(), {1, 0, 0, 0});
        std::vector<uint16_t> four;
        for (const uint16_t joint : joints) four.insert(four.end(), {joint, 0, 0, 0});
        const json attributes{{"POSITION", made.add(points, "VEC3")},
                              {"JOINTS_0", made.add(four, "VEC4")},
                              {"WEIGHTS_0", made.add(weights, "VEC4")}};
        made.root["meshes"] = {
            {{"primitives", {{{"attributes", attributes}, {"indices", made.add(corners, "SCALAR")}}}}}};
        return readModel(folder, "seams.glb", made.bytes());
    };
    CHECK(model({0, 0, 0, 0, 0, 0}).at({}).points.size() == 4);
    CHECK(model({0, 0, 0, 0, 1, 0}).at({}).points.size() == 4);
    const AnimatedMesh lips = model({0, 0, 0, 1, 1, 1}); // the triangles move apart
    CHECK(lips.at({}).points.size() == 6);
    const Mesh open = lips.at({.seconds = 1});
    CHECK((open.points[1] - open.points[3]).length() > 0.5f);
}

TEST_CASE("AnimatedMesh: reads gltf with embedded data and collada with units and axes", "[vdb]") {
    const Folder folder;
    const std::string gltf = R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],
"meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],
"accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,0]}],
"bufferViews":[{"buffer":0,"byteLength":36}],"buffers":[{"byteLength":36,"uri":"data:application/octet-stream;base64,
AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA"}]})";
    std::string plain = gltf;
    plain.erase(plain.find("base64,\n") + 7, 1);
    const Mesh mesh = readModel(folder, "inside.gltf", plain).at({});
    REQUIRE(mesh.triangles.size() == 1);
    CHECK(mesh.points == std::vector<Vec3s>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}});

    const std::string dae = R"(<?xml version="1.0" encoding="utf-8"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset><unit name="centimeter" meter="0.01"/><up_axis>Z_UP</up_axis></asset>
<library_geometries><geometry id="g"><mesh><source id="p"><float_array id="a" count="9">0 0 0 100 0 0 0 0 50</float_array>
<technique_common><accessor source="#a" count="3" stride="3"><param name="X" type="float"/><param name="Y" type="float"/>
<param name="Z" type="float"/></accessor></technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
<triangles count="1"><input semantic="VERTEX" source="#v" offset="0"/><p>0 1 2</p></triangles></mesh></geometry>
</library_geometries><library_visual_scenes><visual_scene id="s"><node id="n"><translate>0 0 10</translate>
<instance_geometry url="#g"/></node></visual_scene></library_visual_scenes>
<scene><instance_visual_scene url="#s"/></scene></COLLADA>)";
    const AnimatedMesh tall = readModel(folder, "tall.dae", dae);
    CHECK(tall.units() == "centimetres, Z up");
    const std::vector<Vec3d> expected{{0, 0.1, 0}, {1, 0.1, 0}, {0, 0.6, 0}};
    CHECK(furthest(tall.at({}), expected) < kRounding);
    CHECK_FALSE(AnimatedMesh::mayMove(folder / "tall.dae"));
    std::string damaged = dae;
    damaged.replace(damaged.find("<p>0 1"), 6, "<p>0 x");
    CHECK_THAT(complaintAbout(folder, "damaged.dae", damaged), ContainsSubstring("not a whole number"));
}

TEST_CASE("AnimatedMesh: reads fbx in metres with Y up and evaluates its curves", "[vdb]") {
    const Folder folder;
    // FBX measures time in ticks: one second has 46186158000 ticks.
    const std::string fbx = R"(; FBX 7.4.0 project file
FBXHeaderExtension: { FBXHeaderVersion: 1003
 FBXVersion: 7400 }
GlobalSettings: { Version: 1000
 Properties70: {
  P: "UpAxis", "int", "Integer", "",2
  P: "UpAxisSign", "int", "Integer", "",1
  P: "FrontAxis", "int", "Integer", "",1
  P: "FrontAxisSign", "int", "Integer", "",-1
  P: "CoordAxis", "int", "Integer", "",0
  P: "CoordAxisSign", "int", "Integer", "",1
  P: "UnitScaleFactor", "double", "Number", "",2.54
 } }
Objects: {
 Geometry: 10, "Geometry::leaf", "Mesh" {
  Vertices: *9 { a: 0,0,0,100,0,0,0,0,50 }
  PolygonVertexIndex: *3 { a: 0,1,-3 }
  GeometryVersion: 124 }
 Model: 20, "Model::leaf", "Mesh" { Version: 232
  Properties70: { P: "Lcl Translation", "Lcl Translation", "", "A",0,0,10 } }
 AnimationStack: 30, "AnimStack::rise", "" { }
 AnimationLayer: 40, "AnimLayer::base", "" { }
 AnimationCurveNode: 50, "AnimCurveNode::T", "" { Properties70: {
  P: "d|X", "Number", "", "A",0
  P: "d|Y", "Number", "", "A",0
  P: "d|Z", "Number", "", "A",10 } }
 AnimationCurve: 60, "AnimCurve::", "" { Default: 10
  KeyVer: 4008
  KeyTime: *2 { a: 0,46186158000 }
  KeyValueFloat: *2 { a: 10,110 }
  KeyAttrFlags: *1 { a: 24836 }
  KeyAttrDataFloat: *4 { a: 0,0,0,0 }
  KeyAttrRefCount: *1 { a: 2 } }
}
Connections: {
 C: "OO",20,0
 C: "OO",10,20
 C: "OO",40,30
 C: "OO",50,40
 C: "OP",50,20, "Lcl Translation"
 C: "OP",60,50, "d|Z"
}
)";
    const AnimatedMesh leaf = readModel(folder, "leaf.fbx", fbx);
    CHECK(leaf.units() == "inches, Z up");
    const auto raised = [](double height) {
        return std::vector<Vec3d>{{0, 0.0254 * height, 0}, {2.54, 0.0254 * height, 0}, {0, 0.0254 * (height + 50), 0}};
    };
    CHECK(furthest(leaf.at({.clip = {}}), raised(10)) < kRounding);
    CHECK(AnimatedMesh::mayMove(folder / "leaf.fbx"));
    REQUIRE(leaf.clips().size() == 1);
    CHECK(leaf.clips()[0].seconds == Approx(1));
    for (const double t : {0.0, 0.25, 1.0}) CHECK(furthest(leaf.at({.seconds = t}), raised(10 + 100 * t)) < kRounding);
}

TEST_CASE("AnimatedMesh: mayMove tells from the glTF header whether there is animation", "[vdb]") {
    const Folder folder;
    CHECK(AnimatedMesh::mayMove(test::store(folder / "bend.glb", test::bendingBar().bytes())));
    Glb still = barGlb();
    still.root["nodes"] = {{{"mesh", 0}}};
    CHECK_FALSE(AnimatedMesh::mayMove(test::store(folder / "still.glb", still.bytes())));
    still.root["animations"] = json::array();
    CHECK_FALSE(AnimatedMesh::mayMove(test::store(folder / "empty.glb", still.bytes())));
    CHECK_FALSE(AnimatedMesh::mayMove(folder / "missing.glb"));
}

TEST_CASE("AnimatedMesh: damaged files give a one-line error", "[vdb]") {
    const Folder folder;
    const std::string whole = test::bendingBar().bytes();
    for (const char* name : {"x.glb", "x.gltf", "x.fbx", "x.dae"}) {
        CAPTURE(name);
        CHECK_THAT(complaintAbout(folder, name, "hello\n"),
                   ContainsSubstring(name) && ContainsSubstring("cannot be read as a mesh"));
        CHECK_THROWS_WITH(AnimatedMesh::read(folder / (std::string("missing") + name)),
                          ContainsSubstring("no such file"));
    }
    CHECK_THAT(complaintAbout(folder, "empty.glb", ""), ContainsSubstring("it is empty"));
    for (size_t part = 1; part < 16; ++part) {
        const std::string said = complaintAbout(folder, "cut.glb", whole.substr(0, whole.size() * part / 16));
        CAPTURE(part, said);
        CHECK_THAT(said, ContainsSubstring("cut.glb"));
        CHECK(said.find('\n') == std::string::npos);
    }
    Glb packed = barGlb();
    packed.root["nodes"] = {{{"mesh", 0}}};
    packed.root["extensionsRequired"] = {"EXT_meshopt_compression"};
    CHECK_THAT(complaintAbout(folder, "packed.glb", packed.bytes()), ContainsSubstring("EXT_meshopt_compression"));
    Glb bad = barGlb();
    bad.root["nodes"] = {{{"mesh", 0}}};
    std::string bytes = bad.bytes();
    const size_t binary = bytes.find(std::string("BIN\0", 4)) + 4;
    const float infinite = std::numeric_limits<float>::infinity();
    std::memcpy(bytes.data() + binary + 12, &infinite, sizeof infinite);
    CHECK_THAT(complaintAbout(folder, "infinite.glb", bytes), ContainsSubstring("not a finite number"));
}
