#include "Figures.h"
#include "Options.h"
#include "curlew/app/Registry.h"
#include "curlew/app/Session.h"
#include "curlew/app/Text.h"
#include "curlew/base/AtomicFile.h"
#include "curlew/base/Memory.h"
#include "curlew/base/Simd.h"
#include "curlew/vdb/GridDiagnostics.h"

#include <chrono>

namespace curlew::app {

namespace {

using namespace options;

const std::string kGroup = "program";

void writeJson(const std::string& file, const nlohmann::ordered_json& json) {
    writeAtomically(file, [&](std::ostream& out) { out << json.dump(2) << '\n'; });
}

std::string plain(const nlohmann::ordered_json& value) {
    return value.is_number_float() ? fmt::format("{:.3g}", value.get<double>()) : value.dump();
}

/// What the check found wrong: the promises that do not hold.
std::vector<std::string> brokenPromises(const nlohmann::ordered_json& check, bool staggered) {
    std::vector<std::string> broken;
    const auto require = [&](const char* name, double limit) {
        if (check.contains(name) && !(check[name].get<double>() <= limit))
            broken.push_back(fmt::format("{} is {:.3g}, above {:.3g}", name, check[name].get<double>(), limit));
    };
    if (check.value("divergence_free", true)) require("divergence_analytic", 1e-6);
    require("wall_flux", 1e-6);
    require("outside", 0);
    if (staggered) require("divergence_grid", 1e-6);
    return broken;
}

using Report = nlohmann::ordered_json;

/// The newest field: what values it takes.
void checkField(Session& s, const Arguments& a, Report& found) {
    const FieldObject& object = s.fields.at();
    std::visit(
        [&](const auto& field) {
            constexpr int kN = std::remove_cvref_t<decltype(field)>::kDimension;
            BoxN<kN> box = BoxN<kN>{}.padded(1);
            if (a.given("box")) {
                const Box given = a.box("box");
                for (int i = 0; i < kN; ++i) { // beyond z, as along x
                    box.lower[i] = given.lower[i < 3 ? i : 0];
                    box.upper[i] = given.upper[i < 3 ? i : 0];
                }
            } else if constexpr (kN == 3) {
                if (object.sdf && object.sdf->bounds.finite()) box = object.sdf->bounds;
            }
            const FieldDiagnostics check = diagnoseField(field, box, static_cast<size_t>(a.integer("samples")),
                                                         s.console.follow("checking the field"));
            found["field_min"] = check.range.lower;
            found["field_max"] = check.range.upper;
            found["field_rms"] = check.rms;
            found["field_rms_gradient"] = check.rmsGradient;
            found["gradient_by_differences"] = check.byDifferences;
            if (check.byHalfDifferences > 0)
                found["gradient_by_differences_order"] = std::log2(check.byDifferences / check.byHalfDifferences);
        },
        object.field);
}

/// The newest flow: divergence, and in space what happens at the wall.
void checkFlow(Session& s, const Arguments& a, Report& found) {
    const auto samples = static_cast<size_t>(a.integer("samples"));
    const Monitor monitor = s.console.follow("checking the flow");
    found["divergence_free"] = std::visit([](const auto& flow) { return flow.divergenceFree(); }, s.flows.at());
    const auto report = [&](const DivergenceDiagnostics& divergence, bool wall) {
        found["divergence_analytic"] = divergence.trace;
        found["divergence_by_differences"] = divergence.byDifferences;
        if (wall) found["divergence_analytic_beyond_wall_layer"] = divergence.traceBeyond;
    };
    if (dimensionOf(s.flows.at()) > 3) {
        std::visit(
            [&](const auto& flow) {
                report(diagnoseDivergence(flow, samples, monitor), false);
                found["rms_speed"] = magnitudesOf(flow, monitor).speed;
            },
            s.flows.at());
        return;
    }
    const Flow flow = s.flow();
    const FlowDiagnostics check = diagnoseFlow(flow, samples, monitor);
    const bool wall = flow.domain().wall.has_value();
    report(check.divergence, wall);
    if (wall) {
        found["wall_flux"] = check.wallFlux;
        found["wall_samples"] = check.wallSamples;
    }
    found["rms_speed"] = check.magnitudes.speed;
}

/// How far points leave their tracks: by the flow itself, and by the newest grid of it.
void checkTracks(Session& s, int steps, Report& found) {
    const auto velocity = s.velocity();
    if (s.flows.empty() || !velocity)
        throw ValueError("tracks= compares a flow with its grid; make one with -velocity");
    const TrackDiagnostics check =
        diagnoseTracks(s.flow(), *velocity, steps, 1000, s.console.follow("checking the tracks"));
    found["tracks_steps"] = check.steps;
    found["tracks_time"] = check.time;
    found["tracks_drift_f"] = check.field.driftF;
    found["tracks_drift_g"] = check.field.driftG;
    found["tracks_grid_drift_f"] = check.onGrid.driftF;
    found["tracks_grid_drift_g"] = check.onGrid.driftG;
    if (s.flow().domain().wall) {
        found["tracks_outside"] = check.field.outside;
        found["tracks_grid_outside"] = check.onGrid.outside;
    }
}

void check(Session& s, const Arguments& a) {
    Report found = Report::object();
    bool staggered = false;
    requireMemory(static_cast<double>(a.integer("samples")) * (Particles::kBytes + 64),
                  fmt::format("{} samples", a.integer("samples")), "give fewer");
    if (!s.flows.empty())
        checkFlow(s, a, found);
    else if (!s.fields.empty())
        checkField(s, a, found);
    if (const auto velocity = s.velocity()) {
        const GridDiagnostics grid = diagnoseGrid(*velocity);
        staggered = velocity->getGridClass() == openvdb::GRID_STAGGERED;
        found["divergence_grid"] = grid.divergence;
        found["divergence_grid_overall"] = grid.divergenceOverall;
        found["staggered"] = staggered;
        found["voxels"] = grid.voxels;
    }
    if (const int64_t steps = a.integer("tracks"); steps > 0) checkTracks(s, static_cast<int>(steps), found);
    if (s.hasParticles() && !s.flows.empty()) {
        const ParticleDiagnostics points =
            diagnoseParticles(s.flow(), s.particles(), s.console.follow("checking the points"));
        found["points"] = points.points;
        if (s.flow().domain().wall) {
            found["outside"] = points.outside;
            found["penetration_max"] = points.penetration;
        }
        if (s.particles().hasTrack()) {
            found["drift_f"] = points.driftF;
            found["drift_g"] = points.driftG;
        }
        found["not_converged"] = points.notConverged;
    }
    if (found.empty()) throw ValueError("there is nothing to check yet: no field, flow, velocity grid or points");
    if (s.report.contains("advect")) found["advect"] = s.report["advect"];
    found["seconds"] = s.seconds();
    found["peak_memory_bytes"] = peakMemory();
    for (const auto& [name, value] : found.items())
        if (!value.is_object()) s.console.say(fmt::format("check: {:<38} {}", name, plain(value)));
    s.report["check"] = found;
    if (a.given("report")) writeJson(a.text("report"), found);
    const auto broken = brokenPromises(found, staggered);
    for (const auto& promise : broken) s.console.warn(promise);
    if (a.flag("strict") && !broken.empty()) throw ValueError(join(broken, "; "));
}

void print(Session& s, const Arguments&) {
    const auto say = [&]<class... T>(fmt::format_string<T...> format, T&&... values) {
        s.console.print(fmt::format(format, std::forward<T>(values)...));
    };
    for (size_t k = 0; k < s.fields.size(); ++k) say("field {}: {}\n", k, s.fields.at(k).program);
    for (size_t k = 0; k < s.flows.size(); ++k) {
        std::visit(
            [&](const auto& flow) {
                const auto& domain = flow.domain();
                say("flow {}: {}{} in {:.4g} to {:.4g}{}\n", k,
                    flow.hasTracks() ? "with tracks" : fmt::format("sum of {}", flow.terms().size()),
                    flow.divergenceFree() ? "" : ", normalised", fmt::join(domain.box.lower.c, ","),
                    fmt::join(domain.box.upper.c, ","),
                    !domain.wall                         ? ""
                    : domain.wall->side == Side::inside  ? ", inside a wall"
                    : domain.wall->side == Side::outside ? ", outside a wall"
                                                         : ", on both sides of a wall");
            },
            s.flows.at(k));
    }
    for (size_t k = 0; k < s.grids.size(); ++k) {
        const auto& grid = *s.grids.at(k).grid;
        say("grid {}: '{}' {} {}, {} active voxels of {:.6g}, {}\n", k, grid.getName(), grid.valueType(),
            openvdb::GridBase::gridClassToString(grid.getGridClass()), grid.activeVoxelCount(), grid.voxelSize()[0],
            formatBytes(static_cast<double>(grid.memUsage())));
    }
    for (size_t k = 0; k < s.geometry.size(); ++k) {
        if (const auto* mesh = std::get_if<std::shared_ptr<const Mesh>>(&s.geometry.at(k)))
            say("geometry {}: mesh, {} points, {} faces\n", k, (*mesh)->points.size(), (*mesh)->faces());
        else if (const auto* curves = std::get_if<std::shared_ptr<const Curves>>(&s.geometry.at(k)))
            say("geometry {}: {} curves, {} vertices\n", k, (*curves)->size(), (*curves)->vertices());
        else
            say("geometry {}: {} points{}\n", k, std::get<Particles>(s.geometry.at(k)).size(),
                std::get<Particles>(s.geometry.at(k)).hasVelocity() ? ", with velocity" : "");
    }
    for (size_t k = 0; k < s.images.size(); ++k) {
        const Image& image = s.images.at(k).image;
        say("image {}: {} x {}, {}\n", k, image.width, image.height, join(image.channels, " "));
    }
}

void expect(Session& s, const Arguments& a) {
    const std::string& path = a.words()[0];
    if (!a.given("least") && !a.given("most") && !a.given("below")) throw ValueError("needs least=, most= or below=");
    const double value = figureOf(s.report, path);
    Report kept = {{"figure", path}, {"value", value}};
    for (const char* bound : {"least", "most"})
        if (a.given(bound)) kept[bound] = a.real(bound);
    if (a.given("least") && !(value >= a.real("least")))
        throw ValueError(fmt::format("{} is {:.6g}, below {:.6g}", path, value, a.real("least")));
    if (a.given("most") && !(value <= a.real("most")))
        throw ValueError(fmt::format("{} is {:.6g}, above {:.6g}", path, value, a.real("most")));
    if (a.given("below")) {
        const std::string other = a.text("below");
        const double bound = figureOf(s.report, other);
        if (!(value < bound))
            throw ValueError(fmt::format("{} is {:.6g}, not below {}, {:.6g}", path, value, other, bound));
        kept["below"] = {{"figure", other}, {"value", bound}};
    }
    s.report["expect"].push_back(std::move(kept));
}

Action expectDeclaration() {
    return {.name = "expect",
            .group = kGroup,
            .summary = "fail unless a figure of the report is within bounds",
            .inputs = "report",
            .takes = {stays("report", {Kind::report})},
            .options = {real("least", "", "", "the figure must not be below it"),
                        real("most", "", "", "the figure must not be above it"),
                        text("below", "", "another figure, which it must be below")},
            .positional = {"ACTION/FIGURE", 1, 1},
            .examples = {"curlew -config scenes/demo.txt -expect check/outside most=0",
                         "curlew -jitter -spacing name=curl -jitter method=random -spacing name=random "
                         "-expect random/minimum below=curl/minimum"},
            .run = expect};
}

void help(Session& s, const Arguments& a) {
    if (a.choice("format") == 1)
        s.console.print(helpTable());
    else if (a.words().empty())
        s.console.print(helpOverview());
    for (const auto& name : a.words())
        s.console.print(helpFor(findAction(name.starts_with('-') ? name.substr(1) : name)));
}

void list(Session& s, const Arguments& a) {
    if (a.choice("format") == 1) return s.console.print(registryJson());
    for (const auto& action : registry()) s.console.print(fmt::format("{:<12} {}\n", action.name, action.summary));
}

Action plainAction(std::string name, std::string summary, std::function<void(Session&, const Arguments&)> run) {
    return {.name = std::move(name), .group = kGroup, .summary = std::move(summary), .run = std::move(run)};
}

} // namespace

std::vector<Action> programActions() {
    std::vector<Action> actions;
    actions.push_back(
        {.name = "check",
         .group = kGroup,
         .summary = "measure what is promised: divergence, wall flux, penetration, drift; of a field, its range",
         .inputs = "the newest flow or else field, velocity grid and points (which stay)",
         .outputs = "report",
         .takes = {maybe(stays("what", {Kind::flow, Kind::field}), "where there is a grid or points"),
                   maybe(stays("velocity", {Kind::velocity}), "where there is one it is checked too"),
                   maybe(stays("points", {Kind::points}), "where there are some they are checked too")},
         .makes = {made("report", {Kind::report})},
         .options = {text("report", "", "a .json file for the figures"),
                     integer("samples", "100000", 1, 1e9, "points at which the flow or field is measured"),
                     box("box", "where a field is measured (default: -1,-1,-1,1,1,1, or its own box)"),
                     integer("tracks", "0", 0, 1e7,
                             "so many RK4 steps of 1000 points, by the flow and by its newest grid: how far they leave "
                             "their tracks"),
                     flag("strict", "0", "fail where a promise does not hold")},
         .examples = {"curlew -config scenes/demo.txt -check report=check.json strict=1"},
         .run = check,
         .prepare = [](const Arguments& a) {
             if (a.given("report")) checkWritable(a.text("report"));
         }});
    actions.push_back(plainAction("print", "list what is on the stacks", print));
    actions.push_back({.name = "report",
                       .group = kGroup,
                       .summary = "write what has been done so far, with times and measurements",
                       .outputs = "file",
                       .makes = {made("file", {Kind::file})},
                       .positional = {"FILE.json", 1, 1},
                       .examples = {"curlew -config scenes/demo.txt -report run.json"},
                       .run =
                           [](Session& s, const Arguments& a) {
                               s.report["seconds"] = s.seconds();
                               s.report["peak_memory_bytes"] = peakMemory();
                               writeJson(a.words()[0], s.report);
                           },
                       .prepare = [](const Arguments& a) { checkWritable(a.words()[0]); }});
    actions.push_back({.name = "config",
                       .group = kGroup,
                       .summary = "run the actions of a scene file: one a line, # comments",
                       .positional = {"SCENE …", 1, 100},
                       .examples = {"curlew -config scenes/demo.txt"},
                       .run = [](Session&, const Arguments&) {}, // the parser has put the scene's actions in its place
                       .prepare = {}});
    actions.push_back(
        {.name = "set",
         .group = kGroup,
         .summary = "give names to numbers, for the expressions that follow; the first value of a name counts",
         .positional = {"NAME=VALUE …", 1, 100},
         .examples = {"curlew -set count=1e4 -torus -scatter 'count={count/2}' -write half.ply",
                      "curlew -set scale=0.5 -config scenes/demo.txt"},
         .run = [](Session&, const Arguments&) {}, // the parser has put the values in place
         .prepare = {}});
    actions.push_back(expectDeclaration());
    actions.push_back(
        {.name = "help",
         .group = kGroup,
         .summary = "all actions, or those named in full",
         .options = {choice("format", {"text", "markdown"}, "markdown: the table of actions in the README")},
         .positional = {"[ACTION …]", 0, 100},
         .examples = {"curlew -help noise"},
         .run = help});
    actions.push_back({.name = "list",
                       .group = kGroup,
                       .summary = "the actions, one a line",
                       .options = {choice("format", {"text", "json"}, "json: all about them, for programs")},
                       .examples = {"curlew -list format=json"},
                       .run = list});
    actions.push_back(plainAction("version",
                                  "the versions of this program and of OpenVDB, and the instruction set in use",
                                  [](Session& s, const Arguments&) { s.console.print(versionText()); }));
    actions.push_back(plainAction("quiet", "say nothing but errors from here on",
                                  [](Session& s, const Arguments&) { s.console.setVerbosity(Verbosity::quiet); }));
    actions.push_back(plainAction("verbose", "say what each action took, and in the end its share of the time",
                                  [](Session& s, const Arguments&) { s.console.setVerbosity(Verbosity::verbose); }));
    actions.push_back(
        {.name = "threads",
         .group = kGroup,
         .summary = "use so many threads from here on; results do not depend on it",
         .positional = {"COUNT", 1, 1},
         .examples = {"curlew -threads 2 -config scenes/demo.txt"},
         .run = [](Session& s, const Arguments& a) {
             double count = 0;
             if (!parseReal(a.words()[0], count) || count != std::floor(count) || count < 0 || count > 4096)
                 throw ValueError(fmt::format(
                     "'{}' must be a whole number of threads up to 4096; 0 for one per processor", a.words()[0]));
             s.setThreads(static_cast<int>(count));
         }});
    return actions;
}

} // namespace curlew::app
