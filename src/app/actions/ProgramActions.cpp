// SPDX-License-Identifier: Apache-2.0
#include "../run/Figures.h"
#include "Actions.h"
#include "GpuOption.h"
#include "curlew/app/Version.h"
#include "curlew/app/actions/Actions.h"
#include "curlew/app/registry/Text.h"
#include "curlew/base/Memory.h"
#include "curlew/vdb/Openvdb.h"

#include <memory>
#include <utility>

namespace curlew::app {

namespace {

using namespace options;

const std::string kProgramGroup = "program";

/// Describes a value, for example "flow 'wind': with tracks in -1,-1,-1 to 1,1,1".
std::string described(const Value& value) {
    struct Describe {
        std::string operator()(std::monostate) const { return "nothing"; }
        std::string operator()(const FieldValue& field) const { return field.program; }
        std::string operator()(const AnyFlow& any) const {
            return std::visit(
                [](const auto& flow) {
                    const auto& domain = flow.domain();
                    return fmt::format("{}{} in {:.4g} to {:.4g}{}",
                                       flow.hasTracks() ? "with tracks"
                                       : flow.terms().empty()
                                           ? "without potentials"
                                           : fmt::format("sum of {}", flow.terms().size() + flow.components().size()),
                                       flow.uniformSpeed() > 0 ? ", normalised"
                                       : flow.preservesArea()  ? ", preserves the area of level sets"
                                                               : "",
                                       fmt::join(domain.box.lower.c, ","), fmt::join(domain.box.upper.c, ","),
                                       !domain.wall                         ? ""
                                       : domain.wall->side == Side::inside  ? "; domain: inside a wall"
                                       : domain.wall->side == Side::outside ? "; domain: outside a wall"
                                                                            : "; domain: both sides of a wall");
                },
                any);
        }
        std::string operator()(const GridValue& value) const {
            const auto& grid = *value.grid;
            return fmt::format("'{}' {} {}, {} active voxels of {:.6g}, {}", printable(grid.getName()),
                               grid.valueType(), openvdb::GridBase::gridClassToString(grid.getGridClass()),
                               grid.activeVoxelCount(), grid.voxelSize()[0],
                               formatBytes(static_cast<double>(grid.memUsage())));
        }
        std::string operator()(const MeshPointer& mesh) const {
            return fmt::format("mesh, {} points, {} faces", mesh->points.size(), mesh->faces());
        }
        std::string operator()(const PointsPointer& points) const {
            if (points->positionsN)
                return fmt::format("{} points of {} dimensions", points->size(), dimensionOf(*points->positionsN));
            return fmt::format("{} points{}", points->particles.size(),
                               points->particles.hasVelocity() ? ", with velocity" : "");
        }
        std::string operator()(const CurvesPointer& curves) const {
            return fmt::format("{} curves, {} vertices", curves->size(), curves->vertices());
        }
        std::string operator()(const std::shared_ptr<const ImageValue>& value) const {
            const Image& image = value->image;
            return fmt::format("{} x {}, {}", image.width, image.height, join(image.channels, " "));
        }
    };
    return std::visit(Describe(), value);
}

void printValues(Context& c, const Arguments& a) {
    if (a.flag("graph")) {
        if (!std::exchange(c.memory().object, std::make_shared<bool>(true))) c.console().print(sceneOf(c.graph()));
        return; // once, and not in every frame
    }
    const std::vector<std::pair<const char*, std::vector<Kind>>> stacks{
        {"field", {Kind::field}},
        {"flow", {Kind::flow}},
        {"grid", {Kind::grid}},
        {"geometry", {Kind::mesh, Kind::points, Kind::curves}},
        {"image", {Kind::image}}};
    for (const auto& [name, kinds] : stacks) {
        size_t age = 0;
        for (size_t k = c.count("what"); k-- > 0;)
            if (accepts(kinds, kindOf(c.value("what", k))))
                c.console().print(fmt::format("{} {}: {}\n", name, age++, described(c.value("what", k))));
    }
}

void help(Context& c, const Arguments& a) {
    if (a.given("search")) return c.console().print(helpSearch(registry(), a.text("search")));
    if (a.choice("format") == 1)
        c.console().print(helpTable(registry()));
    else if (a.words().empty())
        c.console().print(helpOverview(registry()));
    for (const auto& name : a.words())
        c.console().print(helpFor(findAction(registry(), name.starts_with('-') ? name.substr(1) : name)));
}

void list(Context& c, const Arguments& a) {
    if (a.choice("format") == 1) return c.console().print(registryJson(registry()));
    for (const auto& action : registry()) c.console().print(fmt::format("{:<12} {}\n", action.name, action.summary));
}

Action setting(std::string name, std::string summary, std::function<void(Context&, const Arguments&)> run) {
    return {.name = std::move(name),
            .group = kProgramGroup,
            .summary = std::move(summary),
            .evaluation = Evaluation::effect,
            .setting = true,
            .run = std::move(run)};
}

Action printDeclaration() {
    return {.name = "print",
            .group = kProgramGroup,
            .summary = "list the objects on the stacks, or print the program as a scene",
            .takes = {several(stays("what", {Kind::field, Kind::flow, Kind::grid, Kind::mesh, Kind::points,
                                             Kind::curves, Kind::image}),
                              0, 100000, "all objects")},
            .options = {flag(
                "graph", "0",
                "1: print the whole program as a scene, with names where an object other than the newest is used")},
            .examples = {"curlew -sphere -noise -print", "curlew -config scenes/demo.txt -print graph=1"},
            .evaluation = Evaluation::effect,
            .run = printValues};
}

/// Declares the actions that the parser and the evaluator carry out themselves.
Registry declaredOnly() {
    return {
        {.name = "frames",
         .group = kProgramGroup,
         .summary = "animation: run the actions that follow once per frame; points continue from the previous frame",
         .options = {positive("fps", "24", "1 / s", "frames per second"),
                     integer("start", "", 0, 1e7,
                             "frame at which T is 0 (default: the first). To divide 1-48 among several machines, if "
                             "frames do not depend on each other, one of them evaluates 12-24 start=1"),
                     integer("by", "1", 1, 1e6, "step between frames, as in FIRST-LASTxBY"),
                     integer("substeps", "1", 1, 1e6,
                             "minimum number of intervals per frame in which a flow that changes is held constant; for "
                             "schemes without error estimate, the number of steps. It does not affect adaptive steps "
                             "in a steady flow"),
                     text("checkpoint", "", "checkpoint file, written after each frame, from which -resume continues"),
                     text("part", "",
                          "part of the frames to evaluate, if frames do not depend on each other: 3/8 is the third of "
                          "eight parts; each part has every eighth frame")},
         .positional = {"FIRST-LAST", 1, 1},
         .examples = {"curlew -frames 1-48 fps=24 -noise 'alpha={2*pi*T}' -noise seed=1 -dfvn -velocity -write "
                      "'vel.$F4.vdb'",
                      "curlew -noise -noise seed=1 -dfvn speed=1 -scatter -frames 1-48 substeps=4 "
                      "checkpoint=points.checkpoint -advect -write 'points.$F4.vdb' -resume"},
         .run = [](Context&, const Arguments&) {}},
        {.name = "resume",
         .group = kProgramGroup,
         .summary = "continue -frames after the last frame of its checkpoint file; may be anywhere in the command",
         .examples = {"curlew -resume -sphere -scatter -frames 1-48 checkpoint=run.checkpoint -noise alpha={T} -noise "
                      "seed=1 -dfvn -advect -write 'points.$F4.ply'"},
         .run = [](Context&, const Arguments&) {}}};
}

} // namespace

Registry programActions() {
    Registry actions = declaredOnly();
    actions.push_back(printDeclaration());
    actions.push_back({.name = "config",
                       .group = kProgramGroup,
                       .summary = "run the actions of a scene file: one per line, # starts a comment",
                       .positional = {"SCENE …", 1, 100},
                       .examples = {"curlew -config scenes/demo.txt"},
                       .run = [](Context&, const Arguments&) {}, // the parser has replaced it by the scene's actions
                       .prepare = {}});
    actions.push_back(
        {.name = "set",
         .group = kProgramGroup,
         .summary = "define named constants for the expressions that follow; the first definition of a name counts",
         .positional = {"NAME=VALUE …", 1, 100},
         .examples = {"curlew -set count=1e4 -torus -scatter 'count={count/2}' -write half.ply",
                      "curlew -set scale=0.5 -config scenes/demo.txt"},
         .run = [](Context&, const Arguments&) {}, // the parser has substituted the values
         .prepare = {}});
    actions.push_back({.name = "help",
                       .group = kProgramGroup,
                       .summary = "list all actions, or show the full help of those named",
                       .shortName = "h",
                       .options = {text("search", "", "word: list the actions and options that mention it"),
                                   choice("format", {"text", "markdown"}, "markdown: the table of docs/actions.md")},
                       .positional = {.what = "[ACTION …]", .maximum = 100, .actions = true},
                       .examples = {"curlew -help noise", "curlew -help search=wavelength"},
                       .evaluation = Evaluation::effect,
                       .run = help});
    actions.push_back(
        {.name = "list",
         .group = kProgramGroup,
         .summary = "list the actions, one per line",
         .options = {choice("format", {"text", "json"}, "json: complete descriptions, for other programs")},
         .examples = {"curlew -list format=json"},
         .evaluation = Evaluation::effect,
         .run = list});
    actions.push_back(
        {.name = "version",
         .group = kProgramGroup,
         .summary = "print the versions of this program and of its libraries, and the SIMD instruction set in use",
         .shortName = "v",
         .evaluation = Evaluation::effect,
         .run = [](Context& c, const Arguments&) {
             c.console().print(fmt::format("{}\nbuilt with {}\n", versionLine(), kLibraries));
         }});
    actions.push_back(setting("quiet", "print only errors from here on", [](Context& c, const Arguments&) {
        c.session().console.setVerbosity(Verbosity::quiet);
    }));
    actions.push_back(
        setting("verbose", "print the time that each action takes, and at the end its share of the total",
                [](Context& c, const Arguments&) { c.session().console.setVerbosity(Verbosity::verbose); }));
    actions.push_back(
        {.name = "threads",
         .group = kProgramGroup,
         .summary = "set the number of threads from here on; results do not depend on it",
         .positional = {"COUNT", 1, 1},
         .examples = {"curlew -threads 2 -config scenes/demo.txt"},
         .evaluation = Evaluation::effect,
         .setting = true,
         .run = [](Context& c, const Arguments& a) {
             double count = 0;
             if (!parseReal(a.words()[0], count) || count != std::floor(count) || count < 0 || count > 4096)
                 throw ValueError(fmt::format(
                     "'{}' must be a whole number of threads from 0 to 4096; 0 means one per processor", a.words()[0]));
             c.session().setThreads(static_cast<int>(count));
         }});
    actions.push_back(deviceAction());
    return actions;
}

} // namespace curlew::app
