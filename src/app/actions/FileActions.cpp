#include "Actions.h"
#include "ScatterDomain.h"
#include "curlew/app/registry/Text.h"
#include "curlew/app/run/Probe.h"
#include "curlew/base/AtomicFile.h"
#include "curlew/picture/ImageFile.h"
#include "curlew/picture/Legend.h"
#include "curlew/vdb/CurveFile.h"
#include "curlew/vdb/HostProfile.h"
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

// --- reading
// ----------------------------------------------------------------------------------------------------------

/// What files of a format can be read as and what they can hold, and the functions for it; null if it cannot be read or
/// written. A format is added in formats(), from which the help is made too.
struct Format {
    std::string extension;
    std::vector<Kind> reads;
    void (*read)(Context&, const Arguments&, const std::string& file);
    std::vector<Kind> holds;
    void (*write)(const Context&, const Arguments&, const std::string& file);
    std::string note = {}; ///< What it holds, if that is no object.
};
const std::vector<Format>& formats();

enum class Access { read, write };

bool allows(const Format& format, Access access) {
    return access == Access::read ? format.read != nullptr : format.write != nullptr;
}

const Format& formatOf(const std::string& file, Access access) {
    std::vector<std::string> extensions;
    for (const Format& format : formats()) {
        if (!allows(format, access)) continue;
        if (format.extension == extensionOf(file)) return format;
        extensions.push_back(format.extension);
    }
    throw ValueError(fmt::format("'{}' has no known extension; it can be {}", file, join(extensions, " ")));
}

/// ".vdb (grid, points), .ply (mesh), …".
std::string listOfFormats(Access access) {
    std::vector<std::string> parts;
    for (const Format& format : formats()) {
        if (!allows(format, access)) continue;
        std::vector<std::string> kinds;
        for (const Kind kind : access == Access::read ? format.reads : format.holds) kinds.emplace_back(nameOf(kind));
        parts.push_back(
            fmt::format("{} ({})", format.extension, format.note.empty() ? join(kinds, ", ") : format.note));
    }
    return join(parts, ", ");
}

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

FileError noSuchGrid(const std::string& file, const std::vector<std::string>& names) {
    return FileError(
        fmt::format("'{}' has no grid of that name; it has {}", file, names.empty() ? "none" : join(names, ", ")));
}

void readGrids(Context& c, const Arguments& a, const std::string& file) {
    const auto wanted = wantedGrids(a);
    std::vector<std::string> names;
    bool any = false;
    for (const auto& grid : readVdb(file)) {
        names.push_back(grid->getName());
        if (!isWanted(wanted, grid->getName())) continue;
        any = true;
        const auto points = openvdb::GridBase::grid<openvdb::points::PointDataGrid>(grid);
        if (!points) {
            c.give(GridValue{grid});
            continue;
        }
        Points particles = pointsOf(*points);
        // The track is of a flow that is not here, and rounded to float.
        for (auto* track : {&particles.f, &particles.g}) track->clear();
        givePoints(c, std::move(particles));
    }
    if (!any) throw noSuchGrid(file, names);
}

void readPicture(Context& c, const Arguments&, const std::string& file) {
    Image image = extensionOf(file) == ".png" ? readPng(file) : readExr(file);
    const bool isSigned = std::any_of(image.pixels.begin(), image.pixels.end(), [](float v) { return v < 0; });
    c.give(std::make_shared<const ImageValue>(
        ImageValue{std::move(image), isSigned ? ColorMap::diverging : ColorMap::viridis}));
}

void readMeshFile(Context& c, const Arguments&, const std::string& file) {
    auto mesh = std::make_shared<const Mesh>(readMesh(file));
    c.say(fmt::format("{}: {} points, {} faces", file, mesh->points.size(), mesh->faces()));
    c.give(std::move(mesh));
}

void read(Context& c, const Arguments& a) {
    for (const auto& file : a.words())
        if (Value given = c.provided(file); !std::holds_alternative<std::monostate>(given))
            c.give(std::move(given));
        else
            formatOf(file, Access::read).read(c, a, file);
}

/// What the files of -read hold: from the header of a .vdb, otherwise by the extension.
std::vector<Object> readObjects(const Arguments& a, const std::vector<std::vector<Object>>&, const World& world) {
    std::vector<Object> objects;
    for (const auto& file : a.words()) {
        if (const auto known = world.contents(file)) {
            objects.insert(objects.end(), known->begin(), known->end());
            continue;
        }
        const Format& format = formatOf(file, Access::read);
        if (format.extension != ".vdb") {
            objects.push_back({.kind = format.reads.front()});
        } else if (world.lenient && !std::filesystem::exists(file)) {
            objects.push_back({.kind = Kind::grid, .uncertain = true});
        } else {
            std::vector<std::string> names;
            const size_t before = objects.size();
            for (const GridInfo& grid : vdbContents(file)) {
                names.push_back(grid.name);
                if (isWanted(wantedGrids(a), grid.name))
                    objects.push_back({.kind = kindOf(grid.kind), .name = grid.name});
            }
            if (objects.size() == before) throw noSuchGrid(file, names);
        }
    }
    return objects;
}

// --- writing
// ----------------------------------------------------------------------------------------------------------

openvdb::GridBase::ConstPtr gridOf(const Context& c, const Arguments& a, size_t index) {
    PointGridOptions options{.velocity = std::string(kHostProfiles.at(a.choice("target")).pointVelocity)};
    switch (curlew::app::kindOf(c.value("what", index))) {
        case Kind::points:
            return pointGrid(c.points("what", index).particles, options);
        case Kind::curves:
            options.name = "curves";
            return pointGrid(*c.curves("what", index), options);
        default:
            return c.grid("what", index).grid;
    }
}

void writeVdbFile(const Context& c, const Arguments& a, const std::string& file) {
    openvdb::MetaMap metadata;
    metadata.insertMeta("creator", openvdb::StringMetadata("Curlew"));
    std::vector<openvdb::GridBase::ConstPtr> grids;
    for (size_t k = 0; k < c.count("what"); ++k) grids.push_back(gridOf(c, a, k));
    writeVdb(file, grids, metadata, {.half = a.flag("half"), .codec = a.choice<Codec>("codec")},
             c.console().cancelFunction());
}

void writePicture(const Context& c, const Arguments& a, const std::string& file) {
    const ImageValue& value = c.image("what");
    if (extensionOf(file) == ".exr") return writeExr(file, value.image, {.half = a.flag("half")});
    ColorScale scale = automaticScale(value.image, value.map);
    if (a.given("range")) {
        const Range range = a.interval("range");
        scale.lower = static_cast<float>(range.lower);
        scale.upper = static_cast<float>(range.upper);
    }
    writePng(file,
             a.flag("legend") && value.image.channels.size() == 1
                 ? withLegend(value.image, scale, value.image.channels.front())
                 : value.image,
             scale);
}

/// Meshes, points and curves, each by its own function.
template <class PointsWriter, class CurvesWriter>
void writeGeometry(const Context& c, const std::string& file, const PointsWriter& points, const CurvesWriter& curves) {
    switch (c.kind("what")) {
        case Kind::mesh:
            return writeMesh(file, *c.mesh("what"), c.console().cancelFunction());
        case Kind::points:
            return points(c.points("what").particles);
        default:
            return curves(*c.curves("what"));
    }
}

void writePlyFile(const Context& c, const Arguments&, const std::string& file) {
    writeGeometry(
        c, file, [&](const Points& p) { writePly(file, p); }, [&](const Curves& k) { writePly(file, k); });
}
void writeCsvFile(const Context& c, const Arguments&, const std::string& file) {
    writeGeometry(
        c, file, [&](const Points& p) { writeCsv(file, p); }, [&](const Curves& k) { writeCsv(file, k); });
}
void writeObjFile(const Context& c, const Arguments&, const std::string& file) {
    writeGeometry(
        c, file, [](const Points&) {}, [&](const Curves& k) { writeObj(file, k); });
}

/// The report; or the graph, if the file's name ends so.
void writeJsonFile(const Context& c, const Arguments&, const std::string& file) {
    const std::string name = std::filesystem::path(file).filename().string();
    const bool graph = name == "graph.json" || name.ends_with(".graph.json");
    writeAtomically(file, [&](std::ostream& out) {
        out << (graph ? jsonOf(c.graph())
                      : c.wholeReport().dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n");
    });
}

const std::vector<Format>& formats() {
    static const std::vector<Format> all{
        {".vdb", {Kind::grid, Kind::points}, readGrids, {Kind::grid, Kind::points, Kind::curves}, writeVdbFile},
        {".ply", {Kind::mesh}, readMeshFile, {Kind::mesh, Kind::points, Kind::curves}, writePlyFile},
        {".obj", {Kind::mesh}, readMeshFile, {Kind::mesh, Kind::curves}, writeObjFile},
        {".stl", {Kind::mesh}, readMeshFile, {}, nullptr},
        {".csv", {}, nullptr, {Kind::points, Kind::curves}, writeCsvFile},
        {".png", {Kind::image}, readPicture, {Kind::image}, writePicture},
        {".exr", {Kind::image}, readPicture, {Kind::image}, writePicture},
        {".json", {}, nullptr, {}, writeJsonFile, "the report; graph.json and NAME.graph.json: the graph"},
    };
    return all;
}

void write(Context& c, const Arguments& a) {
    for (const auto& file : a.words()) {
        formatOf(file, Access::write).write(c, a, file);
        c.say(fmt::format("wrote {}", file));
    }
}

// --- probing
// ----------------------------------------------------------------------------------------------------------

void probe(Context& c, const Arguments& a) {
    const auto positions = readPositions(a.words()[0]);
    const int order = a.integer<int>("order");
    const std::string& output = a.words()[1];
    const bool isFloat = a.choice("precision") == 1;
    const Monitor monitor = c.follow("probe");
    const auto probeAny = [&](const auto& object, const auto& asFloat, const auto& asDouble) {
        std::visit([&](const auto& o) { isFloat ? asFloat(o) : asDouble(o); }, object);
    };
    // Positions in space see a field of fewer dimensions as it lies there.
    const bool spatial = positions.dimension() == 3;
    if (c.kind("what") == Kind::flow) {
        const AnyFlow& flow = c.anyFlow("what");
        const AnyFlow probed = spatial && dimensionOf(flow) < 3 ? AnyFlow(inSpace(flow)) : flow;
        if (spatial && dimensionOf(probed) == 3) {
            const Vec3d first = inSpace(flow).at(positions.at<3>(0)).velocity;
            c.report("probe") = {{"first_vx", first[0]}, {"first_vy", first[1]}, {"first_vz", first[2]}};
        }
        return probeAny(
            probed, [&](const auto& f) { probeFlow<float>(f, positions, order, output, monitor); },
            [&](const auto& f) { probeFlow<double>(f, positions, order, output, monitor); });
    }
    AnyField probed = c.kind("what") == Kind::levelSet ? AnyField(c.sdf("what", 0).distance) : c.field("what").field;
    if (spatial && dimensionOf(probed) < 3) probed = inSpace(probed);
    probeAny(
        probed, [&](const auto& f) { probeField<float>(f, positions, order, output, monitor); },
        [&](const auto& f) { probeField<double>(f, positions, order, output, monitor); });
}

} // namespace

Registry fileActions() {
    return {
        {.name = "read",
         .group = kGroup,
         .summary = "read files: " + listOfFormats(Access::read),
         .makes = {several(made("meshes", {Kind::mesh}), 0, 1000), several(made("grids", {Kind::grid}), 0, 1000),
                   several(made("points", {Kind::points}), 0, 1000), several(made("images", {Kind::image}), 0, 1000)},
         .options = {text("grids", "", "names of the grids to take from a .vdb, separated by commas (default: all)")},
         .positional = {"FILE …", 1, 1000},
         .examples = {"curlew -read bunny.obj -mesh2ls -write bunny.vdb",
                      "curlew -read smoke.vdb grids=density,vel -print"},
         .evaluation = Evaluation::file,
         .run = read,
         .makesWith = readObjects},
        {.name = "write",
         .group = kGroup,
         .summary = "write the newest object that a file can hold: " + listOfFormats(Access::write),
         .takes = {several(
             stays("what", {Kind::grid, Kind::points, Kind::curves, Kind::mesh, Kind::image}), 0, 1000,
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
         .evaluation = Evaluation::effect,
         .run = write,
         .prepare =
             [](const Arguments& a) {
                 for (const auto& file : a.words()) {
                     formatOf(file, Access::write);
                     checkWritable(file);
                 }
             },
         .holds = [](const std::string& file) { return formatOf(file, Access::write).holds; }},
        {.name = "probe",
         .group = kGroup,
         .summary = "evaluate the newest field, flow or level set at the points of a file",
         .takes = {stays("what", {Kind::field, Kind::flow, Kind::levelSet})},
         .makes = {made("file", {Kind::file})},
         .options = {integer("order", "1", 0, 2,
                             "highest derivative of the field; of a flow, whose velocity is made of first ones, 2 adds "
                             "the Jacobian"),
                     choice("precision", {"double", "float"}, "in which it is evaluated")},
         .positional = {"IN.csv OUT.csv", 2, 2},
         .examples = {"curlew -noise frequency=2 -probe points.csv values.csv order=2"},
         .evaluation = Evaluation::effect,
         .run = probe,
         .prepare = [](const Arguments& a) { checkWritable(a.words()[1]); }}};
}

} // namespace curlew::app
