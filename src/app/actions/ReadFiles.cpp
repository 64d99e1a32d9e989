// SPDX-License-Identifier: Apache-2.0
#include "ReadFiles.h"

#include "PointsN.h"
#include "ScatterDomain.h"
#include "curlew/app/registry/Text.h"
#include "curlew/app/run/IsolatedFiles.h"
#include "curlew/app/run/Probe.h"
#include "curlew/base/LocalFile.h"
#include "curlew/picture/ImageFile.h"
#include "curlew/vdb/AnimatedMesh.h"
#include "curlew/vdb/BgeoFile.h"
#include "curlew/vdb/CurveFile.h"
#include "curlew/vdb/NanoFile.h"
#include "curlew/vdb/Openvdb.h"
#include "curlew/vdb/PointFile.h"
#include "curlew/vdb/VdbFile.h"

#include <algorithm>
#include <array>

namespace curlew::app {

namespace {

using namespace options;

constexpr std::array<std::string_view, 4> kModelEndings{".gltf", ".glb", ".fbx", ".dae"};
const std::string kNoClip = "none";

Digest contentOf(const std::string& path) {
    std::error_code error;
    const auto time = std::filesystem::last_write_time(path, error).time_since_epoch().count();
    return DigestBuilder()
        .add("animated mesh")
        .add(path)
        .add(std::filesystem::file_size(path, error))
        .add(static_cast<int64_t>(time))
        .digest();
}

/// Returns the model, which is kept from frame to frame if each frame needs it.
std::shared_ptr<const AnimatedMesh> modelOf(Context& c, const Arguments& a, const SourceFile& file) {
    const auto read = [&] {
        return std::make_shared<const AnimatedMesh>(
            readModel(file.path, c.follow(fmt::format("reading {}", file.name))));
    };
    const bool again = c.clock() && modelMoves(a, file.name, endingOf(file.path));
    return again ? c.kept<AnimatedMesh>(contentOf(file.path), read) : read();
}

MeshPose poseOf(const Context& c, const Arguments& a, const AnimatedMesh& model) {
    MeshPose pose{.seconds = a.given("time") ? a.real("time") : c.moment().time, .end = a.choice<ClipEnd>("end")};
    const std::string clip = a.text("clip");
    if (clip == kNoClip || (clip.empty() && model.clips().empty()))
        pose.clip = {};
    else if (!clip.empty())
        pose.clip = model.clip(clip);
    return pose;
}

/// Reports, once and not in every frame, which clip was chosen and what else the file contains.
void tellModel(Context& c, const Arguments& a, const SourceFile& file, const AnimatedMesh& model,
               const MeshPose& pose) {
    const std::string metres = "metres, Y up";
    std::string line = fmt::format("{}: {}{}", file.name, model.units(),
                                   model.units() == metres ? "" : fmt::format(" in the file, converted to {}", metres));
    std::vector<std::string> others;
    for (size_t k = 0; k < model.clips().size(); ++k)
        if (k != pose.clip) others.push_back(fmt::format("'{}'", model.clips()[k].name));
    if (pose.clip) {
        const AnimatedMesh::Clip& clip = model.clips()[*pose.clip];
        const bool loops = pose.end == ClipEnd::loop || (pose.end == ClipEnd::automatic && clip.cyclic);
        line += fmt::format("; clip '{}' of {:.4g} s, which {}", clip.name, clip.seconds,
                            loops ? "repeats" : "holds its last pose");
    }
    if (!others.empty()) line += fmt::format("; {} {}", pose.clip ? "other clips:" : "clips:", join(others, ", "));
    c.info(line);
    if (pose.clip && !c.clock() && c.graph().frameRange && !a.given("time"))
        c.warn(
            fmt::format("'{}' is animated but is read before -frames, so it does not move; put -read after -frames, or "
                        "give time= or clip=none",
                        file.name));
}

void sayMesh(const Context& c, const SourceFile& file, const Mesh& mesh, const std::string& more = "") {
    c.info(fmt::format("{}: {} points, {} faces{}", file.name, mesh.points.size(), mesh.faces(), more));
}

// --- grids

std::vector<std::string> wantedGrids(const Arguments& a) {
    return a.given("grids") ? split(a.text("grids"), ',') : std::vector<std::string>();
}

bool isWanted(const std::vector<std::string>& wanted, const std::string& name) {
    return wanted.empty() || std::find(wanted.begin(), wanted.end(), name) != wanted.end();
}

Kind kindOf(GridKind kind) {
    switch (kind) {
        case GridKind::levelSet:
            return Kind::levelSet;
        case GridKind::velocity:
            return Kind::velocity;
        case GridKind::points:
            return Kind::points;
        default:
            return Kind::grid;
    }
}

bool isNano(const SourceFile& file) { return endingOf(file.path) == ".nvdb"; }

FileError noSuchGrid(const std::string& file, const std::vector<std::string>& names) {
    return FileError(
        fmt::format("'{}' has no grid of that name; it has {}", file, names.empty() ? "none" : join(names, ", ")));
}

} // namespace

void readGrids(Context& c, const Arguments& a, const SourceFile& file) {
    const auto wanted = wantedGrids(a);
    std::vector<std::string> names;
    bool any = false;
    const Monitor monitor = c.follow(fmt::format("reading {}", file.name));
    for (VdbContent& content :
         isNano(file) ? readNanoContent(file.path, monitor) : readVdbContent(file.path, monitor)) {
        names.push_back(content.name);
        if (!isWanted(wanted, content.name)) continue;
        any = true;
        if (auto* particles = std::get_if<Points>(&content.value)) {
            // The track belongs to a flow that is not available, and is rounded to float.
            for (auto* track : {&particles->f, &particles->g}) track->clear();
            givePoints(c, std::move(*particles));
        } else {
            c.give(GridValue{std::get<openvdb::GridBase::Ptr>(content.value)});
        }
    }
    if (!any) throw noSuchGrid(file.name, names);
}

void readPicture(Context& c, const Arguments&, const SourceFile& file) {
    const Monitor monitor = c.follow(fmt::format("reading {}", file.name));
    Image image = endingOf(file.path) == ".png" ? readPng(file.path, monitor) : readExrImage(file.path, monitor);
    const bool isSigned = std::any_of(image.pixels.begin(), image.pixels.end(), [](float v) { return v < 0; });
    c.give(std::make_shared<const ImageValue>(
        ImageValue{std::move(image), isSigned ? ColorMap::diverging : ColorMap::viridis}));
}

std::vector<Object> gridObjects(const Arguments& a, const SourceFile& file) {
    std::vector<std::string> names;
    std::vector<Object> objects;
    for (const GridInfo& grid : isNano(file) ? nanoContents(file.path) : vdbContents(file.path)) {
        names.push_back(grid.name);
        if (isWanted(wantedGrids(a), grid.name)) objects.push_back({.kind = kindOf(grid.kind), .name = grid.name});
    }
    if (objects.empty()) throw noSuchGrid(file.name, names);
    return objects;
}

void readMeshFile(Context& c, const Arguments&, const SourceFile& file) {
    auto mesh = std::make_shared<const Mesh>(readMesh(file.path, c.follow(fmt::format("reading {}", file.name))));
    sayMesh(c, file, *mesh);
    c.give(std::move(mesh));
}

void readPointFile(Context& c, const Arguments&, const SourceFile& file) {
    PointTable table = readPoints(file.path, c.follow(fmt::format("reading {}", file.name)));
    c.info(fmt::format("{}: {} points{}", file.name, table.points.size(),
                       table.skipped.empty() ? "" : "; skipped: " + join(table.skipped, " ")));
    givePoints(c, std::move(table.points));
}

namespace {

void readCurveFile(Context& c, const SourceFile& file) {
    auto curves = std::make_shared<const Curves>(readCurves(file.path));
    c.info(fmt::format("{}: {} curves with {} vertices", file.name, curves->size(), curves->vertices()));
    c.give(std::move(curves));
}

} // namespace

void readObjFile(Context& c, const Arguments& a, const SourceFile& file) {
    holdsCurves(file.path) ? readCurveFile(c, file) : readMeshFile(c, a, file);
}
Kind kindOfObj(const std::filesystem::path& path) { return holdsCurves(path) ? Kind::curves : Kind::mesh; }
Kind kindOfCsv(const std::filesystem::path& path) { return holdsCurves(path) ? Kind::curves : Kind::points; }

void readCsvFile(Context& c, const Arguments& a, const SourceFile& file) {
    if (holdsCurves(file.path)) return readCurveFile(c, file);
    if (!hasNumberedCoordinates(file.path)) return readPointFile(c, a, file);
    const Positions table = readPositions(file.path);
    c.info(fmt::format("{}: {} points of {} dimensions", file.name, table.size(), table.dimension()));
    if (table.dimension() > 3)
        return withDimension(table.dimension(), [&](auto n) {
            std::vector<Vec<double, n>> positions;
            for (size_t k = 0; k < table.size(); ++k) positions.push_back(table.at<n>(k));
            givePointsN(c, std::move(positions));
        });
    std::vector<Vec3d> positions(table.size());
    for (size_t k = 0; k < positions.size(); ++k)
        for (int axis = 0; axis < table.dimension(); ++axis)
            positions[k][axis] = table.coordinates[k * table.names.size() + static_cast<size_t>(axis)];
    givePoints(c, Points::at(positions));
}

void readPlyFile(Context& c, const Arguments& a, const SourceFile& file) {
    switch (contentOfPly(file.path)) {
        case PlyContent::points:
            return readPointFile(c, a, file);
        case PlyContent::curves:
            return readCurveFile(c, file);
        case PlyContent::mesh:
            return readMeshFile(c, a, file);
    }
}

Kind kindOfPly(const std::filesystem::path& path) {
    constexpr std::array kKinds{Kind::points, Kind::curves, Kind::mesh};
    return kKinds[static_cast<size_t>(contentOfPly(path))];
}

void readBgeoFile(Context& c, const Arguments&, const SourceFile& file) {
    BgeoContent content = readBgeo(file.path);
    const std::string skipped = content.skipped.empty() ? "" : "; skipped: " + join(content.skipped, " ");
    if (auto* curves = std::get_if<Curves>(&content.geometry)) {
        c.info(fmt::format("{}: {} curves with {} vertices{}", file.name, curves->size(), curves->vertices(), skipped));
        c.give(std::make_shared<const Curves>(std::move(*curves)));
    } else {
        auto& points = std::get<Points>(content.geometry);
        c.info(fmt::format("{}: {} points{}", file.name, points.size(), skipped));
        for (auto* track : {&points.f, &points.g}) track->clear(); // of a flow that is not available, rounded to float
        givePoints(c, std::move(points));
    }
}

Kind kindOfBgeo(const std::filesystem::path& path) { return bgeoHasCurves(path) ? Kind::curves : Kind::points; }

void readModelFile(Context& c, const Arguments& a, const SourceFile& file) {
    const auto model = modelOf(c, a, file);
    const MeshPose pose = poseOf(c, a, *model);
    auto mesh = std::make_shared<const Mesh>(model->at(pose));
    sayMesh(c, file, *mesh, pose.clip ? fmt::format(", at {:.4g} s", model->timeIn(pose)) : "");
    if (!c.memory().object) tellModel(c, a, file, *model, pose);
    c.give(std::move(mesh));
}

bool isModel(const std::string& ending) {
    return std::find(kModelEndings.begin(), kModelEndings.end(), ending) != kModelEndings.end();
}

std::vector<Option> modelOptions() {
    std::string help = "animation clip to read: its name or number, or none (default: the first)";
    return {text("clip", "", std::move(help)),
            notNegative("time", "", "s",
                        "time in the clip since its first key (default: T, the time since the first frame, if -read "
                        "comes after -frames)"),
            choice("end", kClipEndNames,
                   "behaviour after the last key of the clip: loop, or hold the last pose; auto: loop if it ends as it "
                   "begins")};
}

bool modelMoves(const Arguments& a, const std::string& name, const std::string& ending) {
    if (!isModel(ending) || a.given("time") || a.text("clip") == kNoClip) return false;
    const bool closed = isStream(name) || name.ends_with(".gz"); // the content cannot be inspected
    return closed || AnimatedMesh::mayMove(name);
}

} // namespace curlew::app
