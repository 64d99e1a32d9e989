// SPDX-License-Identifier: Apache-2.0
// Longer than 400 lines: the table of all formats, and the two actions that read and write them.
#include "Actions.h"
#include "FileText.h"
#include "HostFiles.h"
#include "PointsN.h"
#include "ProbeAction.h"
#include "ReadFiles.h"
#include "ShaderFiles.h"
#include "curlew/app/registry/Text.h"
#include "curlew/base/AtomicFile.h"
#include "curlew/base/LocalFile.h"
#include "curlew/picture/ImageFile.h"
#include "curlew/picture/Legend.h"
#include "curlew/vdb/CurveFile.h"
#include "curlew/vdb/PointFile.h"
#include "curlew/vdb/VdbFile.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <string_view>

namespace curlew::app {

namespace {

using namespace options;
const std::string kFileGroup = "files";

// --- reading

/// A file format: the kinds of objects that can be read from it and written to it, and the functions that do so; null
/// if the format cannot be read or written. To add a format, add it to formats(), from which the help is generated too.
struct Format {
    std::string extension;
    std::vector<Kind> reads;
    void (*read)(Context&, const Arguments&, const SourceFile& file);
    std::vector<Kind> holds;
    void (*write)(const Context&, const Arguments&, const std::string& file);
    std::string note = {}; ///< Describes the content if it is not an object.
    /// Returns which of several kinds a file holds, from its content; null if there is only one.
    Kind (*kindOf)(const std::filesystem::path& path) = nullptr;
    bool hasGrids = false; ///< Holds any number of grids, which its headers list.
};
const std::vector<Format>& formats();

enum class Access { read, write };

bool allows(const Format& format, Access access) {
    return access == Access::read ? format.read != nullptr : format.write != nullptr;
}

/// Returns the extensions of the formats.
std::vector<std::string> endings(Access access) {
    std::vector<std::string> all;
    for (const Format& format : formats())
        if (allows(format, access)) all.push_back(format.extension);
    return all;
}

/// Returns the extension of the file name, or the one selected by format=.
std::string endingFor(const Arguments& a, const std::string& file) {
    return a.choice("format") == 0 ? endingOf(file) : "." + a.text("format");
}

/// A format of other programs, and what to use instead.
struct ForeignFormat {
    std::string_view extension, toRead, toWrite;
};
constexpr std::string_view kModels = ".obj, .ply, .glb or .fbx", kNoCompression = ".bgeo, without compression";
constexpr std::array<ForeignFormat, 7> kForeign{{{".abc", kModels, ".usda, .bgeo or .ply"},
                                                 {".usd", kModels, ".usda"},
                                                 {".usdc", kModels, ".usda"},
                                                 {".usdz", kModels, ".usda"},
                                                 {".bgeo.sc", kNoCompression, kNoCompression},
                                                 {".bgeo.gz", kNoCompression, kNoCompression},
                                                 {".geo", ".bgeo", ".bgeo"}}};

/// Returns the format selected by the extension of the file name, or by format=.
const Format& formatOf(const Arguments& a, const std::string& file, Access access) {
    const bool compressed = access == Access::write && file.ends_with(".gz");
    const std::string ending = compressed ? ".gz" : endingFor(a, file);
    for (const Format& format : formats())
        if (format.extension == ending && allows(format, access)) return format;
    const std::string known = join(endings(access), " ");
    if (ending.empty() && isStream(file))
        throw ValueError(fmt::format("the format of '{}' is unknown; give format=, one of {}", file, known));
    std::string name = file;
    std::ranges::transform(name, name.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    for (const ForeignFormat& foreign : kForeign)
        if (name.ends_with(foreign.extension))
            throw ValueError(fmt::format("'{}': {} is not supported; use {}", file, foreign.extension,
                                         access == Access::read ? foreign.toRead : foreign.toWrite));
    throw ValueError(fmt::format("'{}' has no known extension; use one of {}", file, known));
}

/// Declares format=, with the extensions of the formats as choices.
Option formatOption(Access access, std::string help) {
    std::vector<std::string> choices{"auto"};
    for (const std::string& ending : endings(access)) choices.push_back(ending.substr(1));
    return choice("format", std::move(choices), std::move(help));
}

/// Returns ".vdb (grid, points), .ply (mesh), …".
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

void readOne(Context& c, const Arguments& a, const std::string& file) {
    const Format& format = formatOf(a, file, Access::read);
    std::optional<LocalFile> copy;
    if (!isStream(file)) copy.emplace(file, format.extension, c.console().cancelFunction());
    const SourceFile source{file, (copy ? copy->path() : c.session().streamed(file, format.extension)).string()};
    try {
        format.read(c, a, source);
    } catch (const FileError& error) { // name the file that the user gave, not its copy
        std::string what = error.what();
        if (const size_t at = what.find(source.path); at != std::string::npos)
            what.replace(at, source.path.size(), file);
        throw FileError(what);
    }
}

void read(Context& c, const Arguments& a) {
    for (const auto& file : a.words())
        if (Value given = c.provided(file); !std::holds_alternative<std::monostate>(given))
            c.give(std::move(given));
        else
            readOne(c, a, file);
    c.memory().object = std::make_shared<bool>(true); // messages are only said once
}

/// Returns a path at which the content of a file can be read, as long as the result exists.
std::shared_ptr<const std::filesystem::path> localFor(const World& world, const std::string& file,
                                                      const std::string& ending) {
    if (isStream(file) && world.streamed)
        return std::make_shared<const std::filesystem::path>(world.streamed(file, ending));
    const auto copy = std::make_shared<const LocalFile>(file, ending);
    return {copy, &copy->path()};
}

/// Returns the objects in the files of -read: from the header of a .vdb, otherwise by the extension.
std::vector<Object> readObjects(const Arguments& a, const std::vector<std::vector<Object>>&, const World& world) {
    std::vector<Object> objects;
    for (const auto& file : a.words()) {
        if (const auto known = world.contents(file)) {
            objects.insert(objects.end(), known->begin(), known->end());
            continue;
        }
        const Format& format = formatOf(a, file, Access::read);
        const bool exists = std::filesystem::exists(file) && !isStream(file);
        const bool there = exists || !world.lenient;
        const bool readable = exists || (isStream(file) && world.streamed);
        if (format.kindOf && readable) {
            objects.push_back({.kind = format.kindOf(*localFor(world, file, format.extension))});
        } else if (!format.hasGrids) {
            objects.push_back({.kind = format.reads.front(), .perhaps = format.reads});
        } else if (!there) {
            objects.push_back({.kind = Kind::grid, .perhaps = {Kind::velocity, Kind::levelSet, Kind::points}});
        } else {
            const auto local = localFor(world, file, format.extension);
            const std::vector<Object> grids = gridObjects(a, {file, local->string()});
            objects.insert(objects.end(), grids.begin(), grids.end());
        }
    }
    return objects;
}

// --- writing

void writeVdbFile(const Context& c, const Arguments& a, const std::string& file) {
    writeVdb(file, gridsForFile(c, a), metadataOf(c, a), {.half = a.flag("half"), .codec = a.choice<Codec>("codec")},
             c.console().cancelFunction());
}

void writePicture(const Context& c, const Arguments& a, const std::string& file) {
    const ImageValue& value = c.image("what");
    if (endingOf(file) == ".exr")
        return writeExr(file, value.image, {.half = a.flag("half")}, c.console().cancelFunction());
    ColorScale scale = automaticScale(value.image, value.map);
    if (a.given("range")) {
        const Interval range = a.interval("range");
        scale.lower = static_cast<float>(range.lower), scale.upper = static_cast<float>(range.upper);
    }
    writePng(file,
             a.flag("legend") && value.image.channels.size() == 1
                 ? withLegend(value.image, scale, value.image.channels.front())
                 : value.image,
             scale, c.console().cancelFunction());
}

void writePlyFile(const Context& c, const Arguments& a, const std::string& file) {
    const auto& cancelled = c.console().cancelFunction();
    switch (c.kind("what")) {
        case Kind::mesh:
            return writeMesh(file, *meshForFile(c, a), cancelled);
        case Kind::points:
            return writePly(file, *pointsForFile(c, a), cancelled);
        default:
            return writePly(file, *curvesForFile(c, a), cancelled);
    }
}
void writeCsvFile(const Context& c, const Arguments& a, const std::string& file) {
    const auto& cancelled = c.console().cancelFunction();
    if (c.kind("what") == Kind::points)
        if (const auto& positions = c.anyPoints("what").positionsN) return writePointsN(file, *positions, cancelled);
    if (c.kind("what") == Kind::points) return writeCsv(file, *pointsForFile(c, a), cancelled);
    writeCsv(file, *curvesForFile(c, a), cancelled);
}
/// Importers of .obj turn axes themselves, so target= does not.
void writeObjFile(const Context& c, const Arguments&, const std::string& file) {
    const auto& cancelled = c.console().cancelFunction();
    if (c.kind("what") == Kind::mesh) return writeMesh(file, *c.mesh("what"), cancelled);
    writeObj(file, *c.curves("what"), cancelled);
}

/// Writes the report; or the graph, if the file is named graph.json or ends in .graph.json.
void writeJsonFile(const Context& c, const Arguments&, const std::string& file) {
    const std::string name = std::filesystem::path(file).filename().string();
    const bool graph = name == "graph.json" || name.ends_with(".graph.json");
    writeAtomically(file, [&](std::ostream& out) {
        out << (graph ? jsonOf(c.graph()) : c.wholeReport().dump(2, ' ', false, Json::error_handler_t::replace) + "\n");
    });
}

const std::vector<Format>& formats() {
    static const std::vector<Format> all{
        {.extension = ".vdb",
         .reads = {Kind::grid, Kind::points},
         .read = readGrids,
         .holds = {Kind::grid, Kind::points, Kind::curves},
         .write = writeVdbFile,
         .hasGrids = true},
        {.extension = ".nvdb",
         .reads = {Kind::grid},
         .read = readGrids,
         .holds = {Kind::grid},
         .write = writeNanoFile,
         .hasGrids = true},
        {.extension = ".ply",
         .reads = {Kind::mesh, Kind::points, Kind::curves},
         .read = readPlyFile,
         .holds = {Kind::mesh, Kind::points, Kind::curves},
         .write = writePlyFile,
         .kindOf = kindOfPly},
        {.extension = ".obj",
         .reads = {Kind::mesh, Kind::curves},
         .read = readObjFile,
         .holds = {Kind::mesh, Kind::curves},
         .write = writeObjFile,
         .kindOf = kindOfObj},
        {".stl", {Kind::mesh}, readMeshFile, {}, nullptr},
        {".gltf", {Kind::mesh}, readModelFile, {}, nullptr},
        {".glb", {Kind::mesh}, readModelFile, {}, nullptr},
        {".fbx", {Kind::mesh}, readModelFile, {}, nullptr},
        {".dae", {Kind::mesh}, readModelFile, {}, nullptr},
        {.extension = ".csv",
         .reads = {Kind::points, Kind::curves},
         .read = readCsvFile,
         .holds = {Kind::points, Kind::curves},
         .write = writeCsvFile,
         .kindOf = kindOfCsv},
        {.extension = ".bgeo",
         .reads = {Kind::points, Kind::curves},
         .read = readBgeoFile,
         .holds = {Kind::points, Kind::curves},
         .write = writeBgeoFile,
         .kindOf = kindOfBgeo},
        {".usda",
         {},
         nullptr,
         {Kind::grid, Kind::points, Kind::curves},
         writeUsdFile,
         "points, curves, and grids that the same -write puts into a .vdb"},
        {".npz", {}, nullptr, {Kind::grid, Kind::points, Kind::curves}, writeNumpyFile},
        {".npy", {}, nullptr, {Kind::grid, Kind::points, Kind::curves}, writeNumpyFile},
        {".fga", {}, nullptr, {Kind::velocity}, writeFgaFile},
        {".vf", {}, nullptr, {Kind::grid}, writeVfFile},
        {".png", {Kind::image}, readPicture, {Kind::image}, writePicture},
        {".exr", {Kind::image}, readPicture, {Kind::image}, writePicture},
        {std::string(kShaderEndings[0]), {}, nullptr, {Kind::flow}, writeShaderFile},
        {std::string(kShaderEndings[1]), {}, nullptr, {Kind::flow}, writeShaderFile},
        {std::string(kShaderEndings[2]), {}, nullptr, {Kind::flow}, writeShaderFile},
        {std::string(kPageEnding), {}, nullptr, {Kind::flow}, writePageFile},
        {".json", {}, nullptr, {}, writeJsonFile, "the report; graph.json and NAME.graph.json: the graph"},
    };
    return all;
}

/// Writes a file in the format that was selected, even if its name has another extension or none.
void writeOne(const Context& c, const Arguments& a, const std::string& file) {
    const Format& format = formatOf(a, file, Access::write);
    if (std::filesystem::path(file).extension() == format.extension || endingOf(file) == format.extension)
        return format.write(c, a, file);
    const TemporaryFolder folder;
    const std::filesystem::path made = folder.path() / ("out" + format.extension);
    format.write(c, a, made.string());
    writeAtomically(file, [&](const std::filesystem::path& temporary) {
        std::filesystem::copy_file(made, temporary, std::filesystem::copy_options::overwrite_existing);
    });
}

void write(Context& c, const Arguments& a) {
    for (const auto& file : a.words()) {
        writeOne(c, a, file);
        if (!collectsFrames(c, a, file)) c.info(fmt::format("wrote {}: {}", file, describedFile(c, a, file)));
    }
}

std::vector<Option> readOptions() {
    std::vector<Option> all{
        text("grids", "", "comma-separated names of the grids to read from a .vdb or .nvdb (default: all)"),
        formatOption(Access::read,
                     "file format, whatever the files are called; auto: from the extension. Needed "
                     "for - (standard input) and other streams")};
    for (Option& option : modelOptions()) all.push_back(std::move(option));
    return all;
}

std::vector<Option> writeOptions() {
    std::vector<Option> all{
        ages("grid", "", "grids for a .vdb, .nvdb, .npz or .usda, several in one file: 0 is the newest"),
        ages("geo", "", "geometry to write, among the kinds that the file can hold: 0 is the newest"),
        ages("image", "", "image to write: 0 is the newest"),
        formatOption(Access::write,
                     "file format, whatever the files are called; auto: from the extension (needed for - "
                     "(standard output) and other streams)"),
        onlyWith({".vdb", ".nvdb", ".exr"},
                 flag("half", "0", "1: 16-bit floats, except for depth and for vectors in a .nvdb")),
        onlyWith({".vdb", ".nvdb", ".npz"},
                 choice("codec", {"auto", "none", "zip", "blosc"},
                        "compression; auto: blosc for fog volumes in a .vdb, which shrink to a third; none for "
                        "everything else, which hardly shrinks"))};
    for (Option& option : hostOptions()) all.push_back(std::move(option));
    for (Option& option : shaderOptions()) all.push_back(std::move(option));
    all.push_back(
        flag("overwrite", "0",
             "1: allow the same file name in all frames, or in several -write; the last one written remains"));
    all.push_back(onlyWith({".png"}, flag("legend", "1", "1: draw a colour bar below the picture")));
    all.push_back(onlyWith(
        {".png"}, interval("range", "", "values at the two ends of the colour map (default: from the image)")));
    return all;
}

/// Throws ValueError if options for animated files are given without such a file.
void checkModelOptions(const Arguments& a) {
    for (const Option& option : modelOptions())
        if (a.given(option.name) && std::none_of(a.words().begin(), a.words().end(), [&](const std::string& file) {
                return isModel(formatOf(a, file, Access::read).extension);
            }))
            throw ValueError(fmt::format("{}= is only for .gltf, .glb, .fbx and .dae", option.name));
}

} // namespace

Registry fileActions() {
    return {
        {.name = "read",
         .group = kFileGroup,
         .summary = "read meshes, grids, points, curves and images; the formats are in -help read",
         .details = "formats: " + listOfFormats(Access::read),
         .makes = {several(made("meshes", {Kind::mesh}), 0, 1000), several(made("grids", {Kind::grid}), 0, 1000),
                   several(made("points", {Kind::points}), 0, 1000), several(made("curves", {Kind::curves}), 0, 1000),
                   several(made("images", {Kind::image}), 0, 1000), several(made("fields", {Kind::field}), 0, 1000)},
         .options = readOptions(),
         .positional = {"FILE …", 1, 1000},
         .examples = {"curlew -read bunny.obj -mesh2ls -write bunny.vdb",
                      "curlew -read smoke.vdb grids=density,vel -print",
                      "curlew -frames 1-24 -read walker.glb clip=walk -mesh2ls -write 'walker.$F4.vdb'",
                      "curlew -read dust.csv.gz -write - format=ply"},
         .evaluation = Evaluation::file,
         .variesWith =
             [](const Arguments& a) {
                 return std::any_of(a.words().begin(), a.words().end(),
                                    [&](const std::string& file) { return modelMoves(a, file, endingFor(a, file)); });
             },
         .run = read,
         .prepare = checkModelOptions,
         .makesWith = readObjects},
        {.name = "write",
         .group = kFileGroup,
         .summary = "write the newest object that the file format can hold; the formats are in -help write",
         .details = "formats: " + listOfFormats(Access::write),
         .takes = {several(
             stays("what", {Kind::grid, Kind::points, Kind::curves, Kind::mesh, Kind::image, Kind::flow}), 0, 1000,
             "the newest that the file can hold; for a .vdb several grids and points, chosen with grid= and geo=")},
         .makes = {several(made("files", {Kind::file}), 1, 1000)},
         .options = writeOptions(),
         .positional = {"FILE …", 1, 1000},
         .examples = {"curlew -noise -noise seed=1 -dfvn -velocity density=1 -write grid=0,1 half=1 smoke.vdb",
                      "curlew -noise -noise seed=1 -dfvn -velocity dim=64 -write target=unreal smoke.fga",
                      "curlew -frames 1-24 -noise alpha={T} -noise seed=1 -dfvn -velocity -write smoke.####.vdb",
                      "curlew -noise -noise seed=1 -dfvn -write flow.glsl",
                      "curlew -noise frequency=1.5 -noise frequency=1.5 seed=1 -sphere -bound -dfvn -write look.html"},
         .evaluation = Evaluation::effect,
         .run = write,
         .prepare =
             [](const Arguments& a) {
                 checkHostOptions(a);
                 std::vector<std::string> formats;
                 for (const auto& file : a.words()) {
                     formats.push_back(formatOf(a, file, Access::write).extension);
                     checkWritable(file);
                 }
                 checkShaderOptions(a, formats);
             },
         .holds = [](const Arguments& a, const std::string& file) { return formatOf(a, file, Access::write).holds; }},
        probeAction()};
}

} // namespace curlew::app
