#include "Options.h"
#include "curlew/app/Registry.h"
#include "curlew/app/Session.h"
#include "curlew/app/Text.h"
#include "curlew/base/AtomicFile.h"
#include "curlew/base/Memory.h"
#include "curlew/vdb/Check.h"

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
    require("divergence_analytic", 1e-6);
    require("wall_flux", 1e-6);
    require("outside", 0);
    if (staggered) require("divergence_grid", 1e-6);
    return broken;
}

void check(Session& s, const Arguments& a) {
    nlohmann::ordered_json found = nlohmann::ordered_json::object();
    bool staggered = false;
    if (!s.flows.empty()) {
        requireMemory(static_cast<double>(a.integer("samples")) * (Particles::kBytes + 32),
                      fmt::format("{} samples", a.integer("samples")), "give fewer");
        const FlowCheck flow =
            checkFlow(s.flows.at(), static_cast<size_t>(a.integer("samples")), s.console.follow("checking the flow"));
        found["divergence_analytic"] = flow.divergence;
        found["divergence_by_differences"] = flow.divergenceByDifferences;
        if (s.flows.at().domain().wall) {
            found["divergence_analytic_beyond_wall_layer"] = flow.divergenceBeyond;
            found["wall_flux"] = flow.wallFlux;
            found["wall_samples"] = flow.wallSamples;
        }
        found["rms_speed"] = flow.magnitudes.speed;
    }
    if (const auto velocity = s.velocity()) {
        const GridCheck grid = checkVelocity(*velocity);
        staggered = velocity->getGridClass() == openvdb::GRID_STAGGERED;
        found["divergence_grid"] = grid.divergence;
        found["divergence_grid_overall"] = grid.divergenceOverall;
        found["staggered"] = staggered;
        found["voxels"] = grid.voxels;
    }
    if (s.hasParticles() && !s.flows.empty()) {
        const ParticleCheck points =
            checkParticles(s.flows.at(), s.particles(), s.console.follow("checking the points"));
        found["points"] = points.points;
        if (s.flows.at().domain().wall) {
            found["outside"] = points.outside;
            found["penetration_max"] = points.penetration;
        }
        if (s.particles().hasTrack()) {
            found["drift_f"] = points.driftF;
            found["drift_g"] = points.driftG;
        }
        found["not_converged"] = points.notConverged;
    }
    if (found.empty()) throw ValueError("there is nothing to check yet: no flow, velocity grid or points");
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
    for (size_t k = 0; k < s.fields.size(); ++k) fmt::print("field {}: {}\n", k, s.fields.at(k).program);
    for (size_t k = 0; k < s.flows.size(); ++k) {
        const Domain& domain = s.flows.at(k).domain();
        const Vec3d lower = domain.box.lower, upper = domain.box.upper;
        fmt::print("flow {}: in {:.4g},{:.4g},{:.4g} to {:.4g},{:.4g},{:.4g}{}\n", k, lower[0], lower[1], lower[2],
                   upper[0], upper[1], upper[2],
                   !domain.wall                         ? ""
                   : domain.wall->side == Side::inside  ? ", inside a wall"
                   : domain.wall->side == Side::outside ? ", outside a wall"
                                                        : ", on both sides of a wall");
    }
    for (size_t k = 0; k < s.grids.size(); ++k) {
        const auto& grid = *s.grids.at(k).grid;
        fmt::print("grid {}: '{}' {} {}, {} active voxels of {:.6g}, {}\n", k, grid.getName(), grid.valueType(),
                   openvdb::GridBase::gridClassToString(grid.getGridClass()), grid.activeVoxelCount(),
                   grid.voxelSize()[0], formatBytes(static_cast<double>(grid.memUsage())));
    }
    for (size_t k = 0; k < s.geometry.size(); ++k) {
        if (const auto* mesh = std::get_if<std::shared_ptr<const Mesh>>(&s.geometry.at(k)))
            fmt::print("geometry {}: mesh, {} points, {} faces\n", k, (*mesh)->points.size(), (*mesh)->faces());
        else
            fmt::print("geometry {}: {} points{}\n", k, std::get<Particles>(s.geometry.at(k)).size(),
                       std::get<Particles>(s.geometry.at(k)).hasVelocity() ? ", with velocity" : "");
    }
    for (size_t k = 0; k < s.images.size(); ++k) {
        const Image& image = s.images.at(k).image;
        fmt::print("image {}: {} x {}, {}\n", k, image.width, image.height, join(image.channels, " "));
    }
}

void help(Session&, const Arguments& a) {
    if (a.choice("format") == 1)
        fmt::print("{}", helpTable());
    else if (a.words().empty())
        fmt::print("{}", helpOverview());
    for (const auto& name : a.words())
        fmt::print("{}", helpFor(findAction(name.starts_with('-') ? name.substr(1) : name)));
}

void list(Session&, const Arguments&) {
    for (const auto& action : registry()) fmt::print("{:<12} {}\n", action.name, action.summary);
}

Action plainAction(std::string name, std::string summary, std::function<void(Session&, const Arguments&)> run) {
    return {.name = std::move(name), .group = kGroup, .summary = std::move(summary), .run = std::move(run)};
}

} // namespace

std::vector<Action> programActions() {
    std::vector<Action> actions;
    actions.push_back({.name = "check",
                       .group = kGroup,
                       .summary = "measure what is promised: divergence, wall flux, penetration, drift",
                       .inputs = "the newest flow, velocity grid and points (which stay)",
                       .outputs = "report",
                       .options = {text("report", "", "a .json file for the figures"),
                                   integer("samples", "100000", 1, 1e9, "points at which the flow is measured"),
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
        {.name = "help",
         .group = kGroup,
         .summary = "all actions, or those named in full",
         .options = {choice("format", {"text", "markdown"}, "markdown: the table of actions in the README")},
         .positional = {"[ACTION …]", 0, 100},
         .examples = {"curlew -help noise"},
         .run = help});
    actions.push_back(plainAction("list", "the actions, one a line", list));
    actions.push_back(
        plainAction("version", "the version of this program and of OpenVDB", [](Session&, const Arguments&) {
            fmt::print("curlew {} (OpenVDB {})\n", CURLEW_VERSION, openvdb::getLibraryVersionString());
        }));
    actions.push_back(plainAction("quiet", "say nothing but errors from here on",
                                  [](Session& s, const Arguments&) { s.console.setVerbosity(Verbosity::quiet); }));
    actions.push_back(plainAction("verbose", "say what each action took",
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
