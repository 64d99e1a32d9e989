#include "Options.h"
#include "curlew/app/Probe.h"
#include "curlew/app/Registry.h"
#include "curlew/app/Session.h"
#include "curlew/app/Text.h"
#include "curlew/base/AtomicFile.h"
#include "curlew/picture/ImageFile.h"
#include "curlew/picture/Legend.h"
#include "curlew/vdb/CurveFile.h"
#include "curlew/vdb/PointFile.h"
#include "curlew/vdb/VdbFile.h"

#include <algorithm>

namespace curlew::app {

namespace {

using namespace options;

const std::string kGroup = "files";

std::string extensionOf(const std::string& file) {
    std::string extension = std::filesystem::path(file).extension().string();
    std::transform(extension.begin(), extension.end(), extension.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    return extension;
}

void requireKnown(const std::string& file, const std::vector<std::string>& extensions) {
    if (std::find(extensions.begin(), extensions.end(), extensionOf(file)) == extensions.end())
        throw ValueError(fmt::format("'{}' has no known extension; it can be {}", file, join(extensions, " ")));
}

// --- reading
// ----------------------------------------------------------------------------------------------------------

void readPoints(Session& s, const openvdb::points::PointDataGrid& grid) {
    Particles particles = particlesOf(grid);
    // Of a flow that is not here, and rounded to float.
    for (auto* track : {&particles.f, &particles.g}) track->clear();
    s.geometry.push(std::move(particles), s.now());
}

void readGrids(Session& s, const std::string& file, const std::vector<std::string>& wanted) {
    size_t taken = 0;
    std::vector<std::string> names;
    for (const auto& grid : readVdb(file)) {
        names.push_back(grid->getName());
        if (!wanted.empty() && std::find(wanted.begin(), wanted.end(), grid->getName()) == wanted.end()) continue;
        ++taken;
        if (const auto points = openvdb::GridBase::grid<openvdb::points::PointDataGrid>(grid))
            readPoints(s, *points);
        else
            s.grids.push({grid, nullptr}, s.now());
    }
    if (taken == 0)
        throw ValueError(
            fmt::format("'{}' has no grid of that name; it has {}", file, names.empty() ? "none" : join(names, ", ")));
}

void readPicture(Session& s, const std::string& file) {
    Image image = extensionOf(file) == ".png" ? readPng(file) : readExr(file);
    const bool isSigned = std::any_of(image.pixels.begin(), image.pixels.end(), [](float v) { return v < 0; });
    s.images.push({std::move(image), isSigned ? ColorMap::diverging : ColorMap::viridis}, s.now());
}

void read(Session& s, const Arguments& a) {
    const std::vector<std::string> wanted = a.given("grids") ? split(a.text("grids"), ',') : std::vector<std::string>();
    for (const auto& file : a.words()) {
        if (const auto given = s.provided.find(file); given != s.provided.end()) {
            s.geometry.push(given->second, s.now());
            continue;
        }
        requireKnown(file, {".obj", ".ply", ".stl", ".vdb", ".png", ".exr"});
        if (extensionOf(file) == ".vdb") {
            readGrids(s, file, wanted);
            continue;
        }
        if (extensionOf(file) == ".png" || extensionOf(file) == ".exr") {
            readPicture(s, file);
            continue;
        }
        auto mesh = std::make_shared<const Mesh>(readMesh(file));
        s.console.say(fmt::format("{}: {} points, {} faces", file, mesh->points.size(), mesh->faces()));
        s.geometry.push(std::move(mesh), s.now());
    }
}

// --- writing
// ----------------------------------------------------------------------------------------------------------

using MeshPointer = std::shared_ptr<const Mesh>;
using CurvesPointer = std::shared_ptr<const Curves>;

/// Calls `use` with the geometry of that age among those of the given kinds, which are what a file can hold. ValueError
/// with `missing` where there is none.
template <class... Kinds, class Use>
auto withGeometry(const Session& s, size_t age, const char* missing, const Use& use) {
    using Result = std::common_type_t<decltype(use(std::declval<const Kinds&>()))...>;
    for (size_t k = 0; k < s.geometry.size(); ++k) {
        const Geometry& geometry = s.geometry.at(k);
        if (!(std::holds_alternative<Kinds>(geometry) || ...) || age-- > 0) continue;
        return std::visit(
            [&]<class T>(const T& held) -> Result {
                if constexpr ((std::same_as<T, Kinds> || ...)) return use(held);
                throw std::logic_error("a geometry of another kind");
            },
            geometry);
    }
    throw ValueError(missing);
}

/// The thing itself, of a geometry that may be shared.
const Particles& thing(const Particles& particles) { return particles; }
template <class T>
const T& thing(const std::shared_ptr<const T>& shared) {
    return *shared;
}

constexpr const char* kNoPoints = "there are no points and no curves to write; make some with -scatter or -trace";

std::vector<openvdb::GridBase::ConstPtr> gridsToWrite(Session& s, const Arguments& a) {
    const auto gridOf = [&](size_t age) -> openvdb::GridBase::ConstPtr {
        return withGeometry<Particles, CurvesPointer>(s, age, kNoPoints, [&]<class T>(const T& geometry) {
            PointGridOptions options;
            options.velocity = kHostProfiles[static_cast<size_t>(a.choice("target"))].pointVelocity;
            if constexpr (std::same_as<T, CurvesPointer>) options.name = "curves";
            return pointGrid(thing(geometry), options);
        });
    };
    std::vector<openvdb::GridBase::ConstPtr> grids;
    for (const size_t age : a.ages("grid")) grids.push_back(s.grids.at(age).grid);
    for (const size_t age : a.ages("geo")) grids.push_back(gridOf(age));
    if (!grids.empty()) return grids;
    // The newest of what a .vdb can hold.
    std::optional<uint64_t> points;
    for (size_t k = 0; k < s.geometry.size() && !points; ++k)
        if (!std::holds_alternative<MeshPointer>(s.geometry.at(k))) points = s.geometry.entry(k).made;
    if (!points && s.grids.empty())
        throw ValueError(
            "there is no grid and there are no points to write; make them with -velocity, -mesh2ls or -scatter");
    if (points && (s.grids.empty() || *points > s.grids.entry().made)) return {gridOf(0)};
    return {s.grids.at().grid};
}

void writeVdbFile(Session& s, const Arguments& a, const std::string& file) {
    openvdb::MetaMap metadata;
    metadata.insertMeta("creator", openvdb::StringMetadata("Curlew"));
    writeVdb(file, gridsToWrite(s, a), metadata,
             {.half = a.flag("half"), .codec = static_cast<Codec>(a.choice("codec"))}, s.console.cancelFunction());
}

void writePicture(Session& s, const Arguments& a, const std::string& file) {
    const size_t age = a.given("image") ? a.ages("image").front() : 0;
    const ImageObject& object = s.images.at(age);
    if (extensionOf(file) == ".exr") return writeExr(file, object.image, {.half = a.flag("half")});
    ColorScale scale = automaticScale(object.image, object.map);
    if (a.given("range")) {
        const Range range = a.interval("range");
        scale.lower = static_cast<float>(range.lower);
        scale.upper = static_cast<float>(range.upper);
    }
    writePng(file,
             a.flag("legend") && object.image.channels.size() == 1
                 ? withLegend(object.image, scale, object.image.channels.front())
                 : object.image,
             scale);
}

void writeGeometry(const Session& s, const std::string& file, const std::string& extension, size_t age) {
    const auto mesh = [&](const MeshPointer& m) { writeMesh(file, *m, s.console.cancelFunction()); };
    if (extension == ".obj")
        return withGeometry<MeshPointer, CurvesPointer>(
            s, age, "there is no mesh and there are no curves for an .obj; make some with -ls2mesh or -trace",
            [&]<class T>(const T& geometry) {
                if constexpr (std::same_as<T, MeshPointer>)
                    mesh(geometry);
                else
                    writeObj(file, *geometry);
            });
    if (extension == ".csv")
        return withGeometry<Particles, CurvesPointer>(s, age, kNoPoints,
                                                      [&](const auto& geometry) { writeCsv(file, thing(geometry)); });
    withGeometry<MeshPointer, Particles, CurvesPointer>(
        s, age, "there are no points and no mesh for a .ply; make some with -scatter, -trace or -ls2mesh",
        [&]<class T>(const T& geometry) {
            if constexpr (std::same_as<T, MeshPointer>)
                mesh(geometry);
            else
                writePly(file, thing(geometry));
        });
}

void write(Session& s, const Arguments& a) {
    const size_t geo = a.given("geo") ? a.ages("geo").front() : 0;
    for (const auto& file : a.words()) {
        const std::string extension = extensionOf(file);
        if (extension == ".vdb")
            writeVdbFile(s, a, file);
        else if (extension == ".ply" || extension == ".csv" || extension == ".obj")
            writeGeometry(s, file, extension, geo);
        else if (extension == ".json")
            writeAtomically(file, [&](std::ostream& out) { out << s.report.dump(2) << '\n'; });
        else
            writePicture(s, a, file);
        s.console.say(fmt::format("wrote {}", file));
    }
}

// --- probing
// ----------------------------------------------------------------------------------------------------------

void probe(Session& s, const Arguments& a) {
    const auto positions = readPositions(a.words()[0]);
    const int order = static_cast<int>(a.integer("order"));
    const std::string& output = a.words()[1];
    const bool isFloat = a.choice("precision") == 1;
    const Monitor monitor = s.console.follow("probe");
    const auto levelSet = s.newestLevelSet();
    const uint64_t flow = s.flows.empty() ? 0 : s.flows.entry().made,
                   field = s.fields.empty() ? 0 : s.fields.entry().made;
    const uint64_t grid = levelSet ? s.grids.entry(*levelSet).made : 0;
    if (std::max({flow, field, grid}) == 0)
        throw ValueError("there is no field, flow or level set to probe; make one first");
    const auto probeAny = [&](const auto& object, const auto& asFloat, const auto& asDouble) {
        std::visit([&](const auto& o) { isFloat ? asFloat(o) : asDouble(o); }, object);
    };
    // Positions in space see a field of fewer dimensions as it lies there.
    const bool spatial = positions.dimension() == 3;
    if (flow > std::max(field, grid)) {
        const AnyFlow probed = spatial && dimensionOf(s.flows.at()) < 3 ? AnyFlow(s.flow()) : s.flows.at();
        if (spatial && dimensionOf(probed) == 3) {
            const Vec3d first = s.flow().at(positions.at<3>(0)).velocity;
            s.report["probe"] = {{"first_vx", first[0]}, {"first_vy", first[1]}, {"first_vz", first[2]}};
        }
        return probeAny(
            probed, [&](const auto& f) { probeFlow<float>(f, positions, order, output, monitor); },
            [&](const auto& f) { probeFlow<double>(f, positions, order, output, monitor); });
    }
    AnyField probed = field > grid ? s.fields.at().field : s.levelSetSdf(*levelSet, 0).distance;
    if (spatial && dimensionOf(probed) < 3) probed = inSpace(probed);
    probeAny(
        probed, [&](const auto& f) { probeField<float>(f, positions, order, output, monitor); },
        [&](const auto& f) { probeField<double>(f, positions, order, output, monitor); });
}

} // namespace

std::vector<Action> fileActions() {
    static const std::vector<std::string> kWritable{".vdb", ".ply", ".obj", ".csv", ".png", ".exr", ".json"};
    return {
        {.name = "read",
         .group = kGroup,
         .summary = "read meshes (.obj .ply .stl), grids and points (.vdb), pictures (.png .exr)",
         .outputs = "meshes, grids, points, images",
         .makes = {several(made("meshes", {Kind::mesh}), 0, 1000), several(made("grids", {Kind::grid}), 0, 1000),
                   several(made("points", {Kind::points}), 0, 1000), several(made("images", {Kind::image}), 0, 1000)},
         .options = {text("grids", "", "names of the grids to take from a .vdb, separated by commas (default: all)")},
         .positional = {"FILE …", 1, 1000},
         .examples = {"curlew -read bunny.obj -mesh2ls -write bunny.vdb",
                      "curlew -read smoke.vdb grids=density,vel -print"},
         .run = read},
        {.name = "write",
         .group = kGroup,
         .summary = "write the newest object that a file can hold: grids, points and curves (.vdb), points, curves and "
                    "meshes (.ply), points and curves (.csv), meshes and curves (.obj), pictures (.png .exr), the "
                    "report (.json)",
         .inputs = "grids, points, curves, meshes, image (which stay)",
         .outputs = "files",
         .takes = {several(
             stays("what", {Kind::grid, Kind::points, Kind::curves, Kind::mesh, Kind::image, Kind::report}), 1, 1000,
             "the newest that the file can hold; several grids and points for a .vdb, chosen with grid= and geo=")},
         .makes = {several(made("files", {Kind::file}), 1, 1000)},
         .options = {ages("grid", "", "grids for a .vdb, several in one file"),
                     ages("geo", "", "which of the geometry that the file can hold, the newest being 0"),
                     ages("image", "", "which picture"),
                     flag("half", "0", "16 bits a value in a .vdb or .exr, but for depth"),
                     choice("codec", {"auto", "none", "zip", "blosc"},
                            "compression of a .vdb; auto is blosc for fog volumes, which shrink to a third, and none "
                            "for the rest: velocities, level sets and points hardly shrink"),
                     choice("target", hostNames(),
                            "whose names the attributes of points in a .vdb have: the velocity is v, or velocity"),
                     flag("legend", "1", "a colour bar below a .png"),
                     interval("range", "",
                              "values at the ends of the colours of a .png (default: those that there are)")},
         .positional = {"FILE …", 1, 1000},
         .examples = {"curlew -noise -noise seed=1 -dfvn -velocity density=1 -write grid=0,1 half=1 smoke.vdb",
                      "curlew -frames 1-24 -noise alpha={T} -noise seed=1 -dfvn -velocity -write 'smoke.$F4.vdb'"},
         .run = write,
         .prepare =
             [](const Arguments& a) {
                 for (const auto& file : a.words()) {
                     requireKnown(file, kWritable);
                     checkWritable(file);
                 }
             }},
        {.name = "probe",
         .group = kGroup,
         .summary = "evaluate the newest field, flow or level set at the points of a file",
         .inputs = "field, flow or level set (which stays)",
         .outputs = "file",
         .takes = {stays("what", {Kind::field, Kind::flow, Kind::levelSet})},
         .makes = {made("file", {Kind::file})},
         .options = {integer("order", "1", 0, 2,
                             "highest derivative of the field; of a flow, whose velocity is made of first ones, 2 adds "
                             "the Jacobian"),
                     choice("precision", {"double", "float"}, "in which it is evaluated")},
         .positional = {"IN.csv OUT.csv", 2, 2},
         .examples = {"curlew -noise frequency=2 -probe points.csv values.csv order=2"},
         .run = probe,
         .prepare = [](const Arguments& a) { checkWritable(a.words()[1]); }}};
}

} // namespace curlew::app
