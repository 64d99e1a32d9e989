// SPDX-License-Identifier: Apache-2.0
#include "ShaderFiles.h"

#include "curlew/app/language/Program.h"
#include "curlew/base/AtomicFile.h"
#include "curlew/shader/FlowPage.h"
#include "curlew/shader/FlowShader.h"
#include "curlew/vdb/FieldMesh.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <filesystem>
#include <ostream>
#include <sstream>

namespace curlew::app {

using namespace options;

namespace {

/// Puts words that a shell would change into quotes. Words with spaces have quotes already.
std::string quotedForShell(const std::string& line) {
    std::string safe;
    for (size_t begin = 0, end = 0; begin < line.size(); begin = end + 1) {
        bool within = false;
        for (end = begin; end < line.size() && (within || line[end] != ' '); ++end) within ^= line[end] == '"';
        const std::string word = line.substr(begin, end - begin);
        const bool changes = word.find_first_of("{}*?$&;|<>()[]~!^#") != std::string::npos;
        safe += (begin ? " " : "") + (changes && word.find('"') == std::string::npos ? "'" + word + "'" : word);
    }
    return safe;
}

/// The program as a command, an action on each line.
std::string commandOf(const Graph& graph) {
    std::string command = "curlew";
    std::istringstream scene(sceneOf(graph));
    for (std::string line; std::getline(scene, line);) command += " \\\n  -" + quotedForShell(line);
    return command;
}

/// Gives a page the surface of the flow's wall.
void addWall(const Context& c, const Flow& flow, FlowPageOptions& page) {
    if (!flow.domain().wall) return;
    const Box& box = flow.domain().box;
    const Mesh mesh = isosurface(flow.domain().wall->sdf.distance,
                                 {.box = box.padded(0.02 * length(box.size())), .dim = 80}, c.follow("wall"));
    for (const auto& p : mesh.points) page.points.push_back({{p[0], p[1], p[2]}});
    const auto add = [&](uint32_t a, uint32_t b, uint32_t d) { page.corners.insert(page.corners.end(), {a, b, d}); };
    for (const auto& t : mesh.triangles) add(t[0], t[1], t[2]);
    for (const auto& q : mesh.quads) {
        add(q[0], q[1], q[2]);
        add(q[0], q[2], q[3]);
    }
}

constexpr size_t kDialectsOfGlsl = 2; ///< The first ones.

Dialect dialectOf(std::string_view ending, const Arguments& a) {
    if (ending == kShaderEndings[1]) return Dialect::hlsl;
    if (ending == kShaderEndings[2]) return Dialect::wgsl;
    return a.choice<Dialect>("dialect");
}

} // namespace

std::vector<Option> shaderOptions() {
    return {
        choice("dialect", kDialectNames,
               "language of a .glsl: glsl is GLSL 4.50 for OpenGL and Vulkan, es is GLSL ES 3.00 for WebGL 2",
               kDialectsOfGlsl),
        choice("tables", kShaderTableNames,
               "where a shader has the tables of noises: text: in itself; data: in FILE.bin, for drivers that run "
               "shaders on the processor"),
        choice(
            "coordinates", kShaderCoordinateNames,
            "how GLSL 4.50 subtracts the lattice cells of noises; doubles: in double; pairs: as pairs of floats, for "
            "GPUs whose doubles are slow (those for games) or missing. The other languages always use pairs"),
        integer("group", "0", 0, 31, "group (Vulkan: set) in which a host binds the buffers of a shader"),
        integer("binding", "0", 0, 999, "binding of the first buffer of a shader; the others follow"),
        integer("corrections", "2", 1, 10, "corrections back onto the track after each step of a shader"),
        vector("origin", "", "world units",
               "position from which a shader measures its own (default: the centre of the flow's box)")};
}

void checkShaderOptions(const Arguments& a, const std::vector<std::string>& endings) {
    const auto writes = [&](std::string_view ending) {
        return std::find(endings.begin(), endings.end(), ending) != endings.end();
    };
    const bool any = std::any_of(kShaderEndings.begin(), kShaderEndings.end(), writes);
    for (const Option& option : shaderOptions())
        if (a.given(option.name) && !any)
            throw ValueError(fmt::format("{}= is only for {}", option.name, fmt::join(kShaderEndings, ", ")));
    if (a.given("dialect") && !writes(kShaderEndings[0]))
        throw ValueError(fmt::format("dialect= is only for {}", kShaderEndings[0]));
    if (a.given("coordinates") && a.choice<ShaderCoordinates>("coordinates") == ShaderCoordinates::doubles &&
        (!writes(kShaderEndings[0]) || a.choice<Dialect>("dialect") == Dialect::glslEs))
        throw ValueError("coordinates=doubles is only for GLSL 4.50; the other languages have no doubles");
    if ((a.given("group") || a.given("binding")) && a.given("dialect") &&
        a.choice<Dialect>("dialect") == Dialect::glslEs)
        throw ValueError("group= and binding= do not exist in dialect=es, which has textures instead of buffers");
}

void writeShaderFile(const Context& c, const Arguments& a, const std::string& file) {
    const std::string data = file + ".bin", ending = std::filesystem::path(file).extension().string();
    FlowShaderOptions options{
        .dialect = dialectOf(ending, a),
        .tables = a.choice<ShaderTables>("tables"),
        .coordinates = a.choice<ShaderCoordinates>("coordinates"),
        .bindings = {.group = a.integer<unsigned>("group"), .first = a.integer<unsigned>("binding")},
        .corrections = a.integer<int>("corrections"),
        .dataFile = std::filesystem::path(data).filename().string()};
    if (a.given("origin")) options.origin = a.vector("origin");
    const ShaderText shader =
        std::visit([&](const auto& flow) { return flowShader(flow, options, c.follow("write")); }, c.anyFlow("what"));
    // Otherwise the file is a temporary one, whose contents go elsewhere.
    const bool named = std::find(a.words().begin(), a.words().end(), file) != a.words().end();
    if (!shader.buffers.empty() && !named)
        throw ValueError(
            fmt::format("this shader has a data file beside it, NAME{0}.bin, so its name must end with {0}", ending));
    if (!shader.buffers.empty())
        writeAtomically(data, [&](std::ostream& out) {
            for (const SymbolBuffer& buffer : shader.buffers)
                out.write(reinterpret_cast<const char*>(buffer.data->data()), // NOLINT: the words' bytes
                          static_cast<std::streamsize>(buffer.data->size() * sizeof(uint32_t)));
        });
    writeAtomically(file, [&](std::ostream& out) { out << shader.text; });
}

void writePageFile(const Context& c, const Arguments&, const std::string& file) {
    const AnyFlow& flow = c.anyFlow("what");
    FlowPageOptions options{.title = "Curlew · " + std::filesystem::path(file).stem().string(),
                            .command = commandOf(c.graph())};
    if (const auto* spatial = std::get_if<Flow>(&flow)) addWall(c, *spatial, options);
    const std::string page =
        std::visit([&](const auto& one) { return flowPage(one, options, c.follow("write")); }, flow);
    writeAtomically(
        file, [&](std::ostream& out) { out << page; }, c.console().cancelFunction());
}

} // namespace curlew::app
