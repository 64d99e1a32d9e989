// SPDX-License-Identifier: Apache-2.0
#include "Targets.h"

#include "../../src/app/run/Evaluator.h"
#include "curlew/app/actions/Actions.h"
#include "curlew/app/language/Program.h"
#include "curlew/app/registry/Expression.h"
#include "curlew/app/run/IsolatedModel.h"
#include "curlew/base/Csv.h"
#include "curlew/base/Error.h"
#include "curlew/field/NoiseField.h"
#include "curlew/field/ParsedFormula.h"
#include "curlew/picture/ImageFile.h"
#include "curlew/vdb/AnimatedMesh.h"
#include "curlew/vdb/BgeoFile.h"
#include "curlew/vdb/CurveFile.h"
#include "curlew/vdb/MeshFile.h"
#include "curlew/vdb/PointFile.h"
#include "curlew/vdb/VdbFile.h"

#include <fcntl.h>
#include <openvdb/points/PointDataGrid.h>
#include <openvdb/tools/LevelSetSphere.h>
#include <unistd.h>

#include <cstring>
#include <filesystem>
#include <fstream>

namespace curlew::fuzz {

namespace {

namespace fs = std::filesystem;

/// Temporary files of this process that contain the input.
struct Scratch {
    fs::path folder = fs::temp_directory_path() / ("curlew_fuzz_" + std::to_string(::getpid()));

    Scratch() { fs::create_directories(folder); }
    ~Scratch() {
        std::error_code ignored;
        fs::remove_all(folder, ignored);
    }
    Scratch(const Scratch&) = delete;
    Scratch& operator=(const Scratch&) = delete;

    fs::path with(const std::string& name, std::string_view bytes) const {
        std::ofstream(folder / name, std::ios::binary).write(bytes.data(), std::streamsize(bytes.size()));
        return folder / name;
    }
    std::string bytes(const std::string& name) const {
        std::ifstream in(folder / name, std::ios::binary);
        return {std::istreambuf_iterator<char>(in), {}};
    }
};

const Scratch& scratch() {
    static const Scratch kScratch;
    return kScratch;
}

template <class Read>
bool accepts(const Read& read) {
    try {
        read();
        return true;
    } catch (const Error&) {
        return false;
    }
}

bool readVdbTarget(std::string_view bytes) {
    constexpr size_t version = 21 + 14; // in the UUID: the reader checks the digest only in files with our UUID
    std::string changed(bytes);
    if (changed.size() > version) changed[version] = '4';
    return accepts([&] {
        for (const auto& grid : readVdb(scratch().with("a.vdb", changed)))
            if (const auto points = openvdb::GridBase::grid<openvdb::points::PointDataGrid>(grid)) pointsOf(*points);
    });
}

template <char... Extension>
bool readMeshTarget(std::string_view bytes) {
    static const std::string kName{'a', '.', Extension...};
    return accepts([&] { readMesh(scratch().with(kName, bytes)); });
}

/// Bytes instead of a process.
class BytesSource final : public PartSource {
  public:
    explicit BytesSource(std::string_view bytes) : mLeft(bytes) {}
    void take(void* to, size_t bytes) override {
        if (bytes > mLeft.size()) throw FileError("the process ended");
        std::memcpy(to, mLeft.data(), bytes);
        mLeft.remove_prefix(bytes);
    }

  private:
    std::string_view mLeft;
};

/// Reads the data that the model reader process passes on. Assimp itself is not a target, because it is known to crash
/// and therefore runs in that process.
bool readModelTarget(std::string_view bytes) {
    return accepts([&] {
        PartReader parts(std::make_unique<BytesSource>(bytes), bytes.size(), "a.glb");
        const AnimatedMesh model(app::takeModel(parts));
        for (size_t clip = 0; clip < model.clips().size(); ++clip) model.at({.clip = clip, .seconds = 0.3});
    });
}

/// NanoVDB is not a target, for the same reason.
bool readBgeoTarget(std::string_view bytes) {
    return accepts([&] { readBgeo(scratch().with("a.bgeo", bytes)); });
}

bool readObjCurvesTarget(std::string_view bytes) {
    return accepts([&] { readCurves(scratch().with("curves.obj", bytes)); });
}
bool readPlyCurvesTarget(std::string_view bytes) {
    return accepts([&] { readCurves(scratch().with("curves.ply", bytes)); });
}
bool readCsvCurvesTarget(std::string_view bytes) {
    return accepts([&] { readCurves(scratch().with("curves.csv", bytes)); });
}

bool readPngTarget(std::string_view bytes) {
    return accepts([&] { readPng(scratch().with("a.png", bytes)); });
}
bool readExrTarget(std::string_view bytes) {
    return accepts([&] { readExr(scratch().with("a.exr", bytes)); });
}
bool readCsvTarget(std::string_view bytes) {
    const fs::path path = scratch().with("a.csv", bytes);
    const bool any = accepts([&] { readCsv(path, CsvCells::optional); });
    return accepts([&] { readCsv(path, CsvCells::finite); }) || any;
}

app::Reading reading() { return {.registry = app::registry(), .world = {.lenient = true}}; }

/// Traps unless the graph, written as JSON, is read as the same graph.
void checkGraph(const app::Graph& graph) {
    const std::string json = app::jsonOf(graph);
    if (app::jsonOf(app::graphOfJson(json, reading())) != json) __builtin_trap();
}
bool readSceneTarget(std::string_view bytes) {
    return accepts([&] { checkGraph(app::graphOfScene(std::string(bytes), "fuzz", reading())); });
}
bool readJsonTarget(std::string_view bytes) {
    return accepts([&] { checkGraph(app::graphOfJson(std::string(bytes), reading())); });
}
bool readFormulaTarget(std::string_view bytes) {
    static const ScalarField swirl = noiseField<Psrd3>();
    return accepts([&] {
        const ScalarField field = parsedFormula<3>(bytes, {{"swirl", swirl}}).field;
        field.at<1>(Vec3d{{0.1, -0.2, 0.3}});
    });
}
bool readExpressionTarget(std::string_view bytes) {
    return accepts([&] {
        const std::string text = app::withConstants(bytes, {{"a", 1.5}, {"b", -2e300}});
        app::variablesOf(text);
        app::expanded(text, {.frame = 3, .time = 0.5});
    });
}

/// Replaces the digest by that of the content, as a forged checkpoint can.
bool readCheckpointTarget(std::string_view bytes) {
    Digest program, whole;
    std::string forged(bytes);
    if (forged.size() >= 8 + 2 * sizeof(Digest)) {
        std::memcpy(&program, &forged[8], sizeof program);
        const size_t end = forged.size() - sizeof whole;
        whole = DigestBuilder().addBytes(forged.data(), end).digest();
        std::memcpy(&forged[end], &whole, sizeof whole);
    }
    return accepts([&] { app::readCheckpoint(scratch().with("a.checkpoint", forged), program); });
}

std::string modelSeed() {
    using openvdb::Mat4d;
    using openvdb::Vec3s;
    ModelData data;
    data.nodes = {{"root", {}, Mat4d::identity()}, {"bone", 0, Mat4d::identity()}};
    data.parts.push_back({.node = 0,
                          .points = {Vec3s(0, 0, 0), Vec3s(1, 0, 0), Vec3s(0, 1, 0)},
                          .corners = {0, 1, 2},
                          .sizes = {3},
                          .bones = {{1, Mat4d::identity()}},
                          .influences = {{0, 1.0}, {0, 0.5}, {0, 1.0}},
                          .firstInfluence = {0, 1, 2, 3},
                          .targets = {{0.5, {Vec3s(1), Vec3s(0), Vec3s(0)}}}});
    ModelData::Clip clip{.name = "walk", .begin = 0, .end = 1, .nodes = {}, .morphs = {}};
    clip.nodes.push_back({.node = 1,
                          .translation = {{0, 1}, {openvdb::Vec3d(0), openvdb::Vec3d(1)}},
                          .rotation = {{0}, {openvdb::math::Quatd::identity()}},
                          .scale = {{0}, {openvdb::Vec3d(1)}}});
    clip.morphs.push_back({.part = 0, .weights = {{0, 1}, {{0}, {1}}}});
    data.clips.push_back(clip);
    const std::filesystem::path path = scratch().with("seed.parts", "");
    const int file = ::open(path.c_str(), O_WRONLY);
    PartWriter parts(file);
    app::writeModel(data, parts);
    ::close(file);
    return scratch().bytes("seed.parts");
}

std::string written(const std::string& name, const std::vector<openvdb::GridBase::ConstPtr>& grids, Codec codec) {
    writeVdb(scratch().folder / name, grids, {}, {.codec = codec});
    return scratch().bytes(name);
}

std::vector<std::string> vdbSeeds() {
    openvdb::initialize();
    Points points = Points::at({{{0.1, 0.2, 0.3}}, {{1, 2, 3}}, {{1.1, 2, 3}}, {{-4, 0, 0}}});
    for (auto* v : {&points.vx, &points.vy, &points.vz}) v->assign(4, 1);
    points.age = {0, 1, 2, 3};
    const auto sphere = openvdb::tools::createLevelSetSphere<openvdb::FloatGrid>(2, {0, 0, 0}, 1);
    const auto mask = openvdb::BoolGrid::create();
    mask->fill({{0, 0, 0}, {9, 9, 9}}, true);
    std::vector<std::string> all;
    for (const Codec codec : {Codec::none, Codec::blosc, Codec::zip}) {
        all.push_back(written("seed.vdb", {pointGrid(points, {.voxelSize = 0.5})}, codec));
        all.push_back(written("seed.vdb", {sphere, mask}, codec));
    }
    return all;
}

std::vector<std::string> imageSeeds(const std::string& name) {
    Image image = filledImage(7, 5, {"R", "G", "B"});
    for (size_t k = 0; k < image.pixels.size(); ++k) image.pixels[k] = float(k % 11) / 10;
    const fs::path path = scratch().folder / name;
    name.ends_with(".png") ? writePng(path, image) : writeExr(path, image);
    return {scratch().bytes(name)};
}

/// Points with a velocity and an id.
std::vector<std::string> bgeoSeeds() {
    Points points = Points::at({{{0, 0, 0}}, {{1, 1, 1}}});
    points.vx = points.vy = points.vz = {1, 2};
    writeBgeo(scratch().folder / "seed.bgeo", points);
    return {scratch().bytes("seed.bgeo")};
}

std::vector<std::string> checkpointSeeds() {
    app::Checkpoint checkpoint{.frame = 3, .sums = {1, 2}, .since = 1};
    checkpoint.states.push_back({{.particles = Points::at({{{0, 0, 0}}, {{1, 1, 1}}})}, {}});
    const fs::path path = scratch().folder / "seed.checkpoint";
    app::writeCheckpoint(path, {}, checkpoint, {});
    return {scratch().bytes("seed.checkpoint")};
}

const std::string kPly =
    "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
    "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
const std::string kPlyCurves =
    "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\nproperty int "
    "curve\nelement edge 4\nproperty int vertex1\nproperty int vertex2\nend_header\n0 0 0 5\n1 0 0 5\n0 1 0 5\n2 2 2 "
    "6\n"
    "0 1\n1 2\n2 0\n3 2\n";
const std::string kScene =
    "set a=2\nsphere radius={a*0.5} as=ball\nnoise frequency={a} alpha={T}\nbound wall=ball\n"
    "noise seed=1\ndfvn speed=1\nscatter count=10\nframes 1-3 fps=24\nadvect duration={1/fps} steps=2\n";

} // namespace

const std::vector<Target>& targets() {
    static const std::vector<Target> kTargets{{"vdb", readVdbTarget},
                                              {"obj", readMeshTarget<'o', 'b', 'j'>},
                                              {"ply", readMeshTarget<'p', 'l', 'y'>},
                                              {"stl", readMeshTarget<'s', 't', 'l'>},
                                              {"bgeo", readBgeoTarget},
                                              {"obj_curves", readObjCurvesTarget},
                                              {"ply_curves", readPlyCurvesTarget},
                                              {"csv_curves", readCsvCurvesTarget},
                                              {"model", readModelTarget},
                                              {"png", readPngTarget},
                                              {"exr", readExrTarget},
                                              {"csv", readCsvTarget},
                                              {"scene", readSceneTarget},
                                              {"json", readJsonTarget},
                                              {"expression", readExpressionTarget},
                                              {"formula", readFormulaTarget},
                                              {"checkpoint", readCheckpointTarget}};
    return kTargets;
}

std::vector<std::string> seeds(const std::string& target) {
    if (target == "vdb") return vdbSeeds();
    if (target == "obj") return {"v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 1\nvt 0 0\nf 1/1/1 2/1/1 3/1/1\nf -1 -2 -3\n"};
    if (target == "ply") return {kPly};
    if (target == "stl")
        return {
            "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n"
            "endsolid a\n",
            std::string(80, ' ') + std::string("\1\0\0\0", 4) + std::string(50, '\0')};
    if (target == "model") return {modelSeed()};
    if (target == "png" || target == "exr") return imageSeeds("seed." + target);
    if (target == "bgeo") return bgeoSeeds();
    if (target == "obj_curves") return {"v 0 0 0\nv 1 0 0\nv 0 1 0\nl 1 2 3\nl 1 2 3 1\nl -1/1 -2/2\n"};
    if (target == "ply_curves") return {kPlyCurves};
    if (target == "csv_curves") return {"curve,x,y,z,closed\n0,0,0,0,0\n0,1,0,0,0\n1,-1.5e3,+2,3,1\n"};
    if (target == "csv") return {"x,y,z,id\n0,1,2,3\n-1.5e3,+2,\"3\",4\n"};
    if (target == "scene") return {kScene};
    if (target == "json") return {app::jsonOf(app::graphOfScene(kScene, "seed", reading()))};
    if (target == "formula")
        return {"sin(2*pi*x) * swirl + 0.3*z^2", "smin(length(p - (1, 2, 0.5)), clamp(y, -1, 1), 0.1)",
                "smoothstep(0, 1, dot(p, (x, y, z))) / (2 + cos(x1)^2)"};
    if (target == "expression") return {"a{1+2*sin(pi*T)}.$F4.####.%04d", "{min(max(F,b),a)}"};
    return checkpointSeeds();
}

} // namespace curlew::fuzz
