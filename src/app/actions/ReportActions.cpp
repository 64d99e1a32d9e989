// SPDX-License-Identifier: Apache-2.0
#include "../run/Figures.h"
#include "Actions.h"
#include "PointsN.h"
#include "WallSolids.h"
#include "curlew/app/registry/Text.h"
#include "curlew/base/AtomicFile.h"
#include "curlew/base/Memory.h"
#include "curlew/vdb/GridDiagnostics.h"
#include "curlew/vdb/HostCheck.h"
#include "curlew/vdb/Openvdb.h"
#include "curlew/vdb/ScalarGrids.h"

namespace curlew::app {

namespace {

using namespace options;

const std::string kReportGroup = "program";

void writeJson(const std::string& file, const Json& json) {
    writeAtomically(
        file, [&](std::ostream& out) { out << json.dump(2, ' ', false, Json::error_handler_t::replace) << '\n'; });
}

std::string plain(const Json& value) {
    return value.is_number_float() ? fmt::format("{:.3g}", value.get<double>()) : value.dump();
}

/// How far points may be on the wrong side of the mesh of a wall, in voxels of its level set.
constexpr double kMaxMeshDepth = 0.5;

/// Describes points that are beyond the mesh of a wall. The names of their figures begin with `prefix`.
std::string beyondMesh(const Json& check, const std::string& prefix) {
    const auto figure = [&](const char* name) { return check[prefix + name].get<double>(); };
    return fmt::format(
        "{} of {} {} are on the wrong side of the wall's mesh, by up to {:.3g} voxels ({:.3g} world units){}",
        figure("mesh_outside"), figure(prefix.empty() ? "points" : "vertices"),
        prefix.empty() ? "points" : "vertices of curves", figure("mesh_depth_max_voxels"), figure("mesh_depth_max"),
        figure("outside") > 0 ? ""
                              : ", though on the right side of its level set, whose voxels are too large "
                                "for the mesh; use smaller ones (-mesh2ls voxel=)");
}

/// Returns the guarantees that the measurements violate.
std::vector<std::string> violations(const Json& check, bool staggered) {
    std::vector<std::string> broken;
    const auto require = [&](const char* name, double limit) {
        if (check.contains(name) && !(check[name].get<double>() <= limit))
            broken.push_back(fmt::format("{} is {:.3g}, above {:.3g}", name, check[name].get<double>(), limit));
    };
    if (check.value("divergence_free", true) || check.value("preserves_area", false)) {
        require("divergence_analytic", 1e-6);
        if (!check.value("divergence_vanishes", true))
            broken.push_back(
                fmt::format("divergence_by_differences is {:.3g} and does not decrease with the step size (order "
                            "{:.2g}): the velocity jumps, as at the kink of a potential (-min smoothing=0), or a "
                            "gradient is not that of its potential",
                            check["divergence_by_differences"].get<double>(),
                            check["divergence_by_differences_order"].get<double>()));
    }
    require("wall_flux", 1e-6);
    for (const std::string what : {"", "curves_"}) {
        require((what + "outside").c_str(), 0);
        if (check.value(what + "mesh_depth_max_voxels", 0.0) > kMaxMeshDepth) broken.push_back(beyondMesh(check, what));
    }
    if (staggered) require("divergence_grid", 1e-6);
    return broken;
}

/// Returns a warning if the grid's fastest voxel is so fast that figures relative to the grid's rms speed say nothing
/// of the other voxels; otherwise "".
std::string tooFast(const Json& check) {
    constexpr double kMost = 100; // times the flow's rms speed
    if (!check.contains("grid_max_speed") || !check.contains("rms_speed")) return "";
    const double times = check["grid_max_speed"].get<double>() / check["rms_speed"].get<double>();
    if (times <= kMost) return "";
    return fmt::format(
        "the fastest voxel of the grid is {:.3g} times as fast as the flow's rms speed; unless its wall "
        "moves that fast, the grid is not one of this flow",
        times);
}

bool ofFlow(const Context& c) { return c.has("what") && c.kind("what") == Kind::flow; }

openvdb::Vec3SGrid::ConstPtr velocityOf(const Context& c) { return vectorsOf(c.grid("velocity").grid); }

/// Measures the range of a field's values.
void checkField(const Context& c, const Arguments& a, Json& found) {
    const FieldValue& object = c.field("what");
    std::visit(
        [&](const auto& field) {
            constexpr int kN = std::remove_cvref_t<decltype(field)>::kDimension;
            BoxN<kN> box = BoxN<kN>{}.padded(1);
            if (a.given("box")) {
                box = boxInDimension<kN>(a.box("box"));
            } else if constexpr (kN == 2 || kN == 3) {
                if (object.sdf)
                    if (const auto& bounds = std::get<SdfN<kN>>(*object.sdf).bounds; bounds.finite()) box = bounds;
                if constexpr (kN == 3)
                    if (object.sampled) box = object.sampled->box;
            }
            const FieldDiagnostics check =
                diagnoseField(field, box, a.integer<size_t>("samples"), c.follow("checking the field"));
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

/// Measures the divergence of a flow, and in 3D its flux at the wall.
void checkFlow(const Context& c, const Arguments& a, Json& found) {
    const auto samples = a.integer<size_t>("samples");
    const Monitor monitor = c.follow("checking the flow");
    found["divergence_free"] = std::visit([](const auto& flow) { return flow.divergenceFree(); }, c.anyFlow("what"));
    if (std::visit([](const auto& flow) { return flow.preservesArea(); }, c.anyFlow("what")))
        found["preserves_area"] = true;
    const auto report = [&](const DivergenceDiagnostics& divergence, bool wall) {
        found["divergence_analytic"] = divergence.trace;
        found["divergence_by_differences"] = divergence.byDifferences;
        if (const auto order = divergence.order()) found["divergence_by_differences_order"] = *order;
        found["divergence_vanishes"] = divergence.vanishes();
        if (wall) found["divergence_analytic_beyond_wall_layer"] = divergence.traceBeyond;
    };
    if (dimensionOf(c.anyFlow("what")) > 3) {
        std::visit(
            [&](const auto& flow) {
                report(diagnoseDivergence(flow, samples, monitor), false);
                found["rms_speed"] = rmsOf(flow, monitor).speed;
            },
            c.anyFlow("what"));
        return;
    }
    const Flow flow = c.flow("what");
    const FlowDiagnostics check = diagnoseFlow(flow, samples, monitor);
    const bool wall = flow.domain().wall.has_value();
    report(check.divergence, wall);
    if (wall) {
        found["wall_flux"] = check.wallFlux;
        found["wall_samples"] = check.wallSamples;
    }
    found["rms_speed"] = check.rms.speed;
}

/// Measures how far points drift from their tracks, in the flow itself and in its grid.
void checkTracks(const Context& c, int steps, Json& found) {
    if (!ofFlow(c) || !c.has("velocity"))
        throw ValueError("tracks= compares a flow with its velocity grid; make one with -velocity");
    const Flow flow = c.flow("what");
    const TrackDiagnostics check = diagnoseTracks(flow, *velocityOf(c), steps, 1000, c.follow("checking the tracks"));
    found["tracks_steps"] = check.steps;
    found["tracks_time"] = check.time;
    found["tracks_drift_f"] = check.field.driftF;
    found["tracks_drift_g"] = check.field.driftG;
    found["tracks_grid_drift_f"] = check.onGrid.driftF;
    found["tracks_grid_drift_g"] = check.onGrid.driftG;
    if (flow.domain().wall) {
        found["tracks_outside"] = check.field.outside;
        found["tracks_grid_outside"] = check.onGrid.outside;
    }
}

/// Judges positions by the meshes of the flow's wall. The names of the figures begin with `prefix`.
void checkMesh(const Context& c, const std::optional<WallSolids>& solids, const std::string& prefix,
               const std::vector<double>& x, const std::vector<double>& y, const std::vector<double>& z, Json& found) {
    if (!solids) return;
    const WrongSide wrong = solids->wrongSide(x, y, z, c.follow("judging points by the wall's mesh"));
    found[prefix + "mesh_outside"] = wrong.points;
    found[prefix + "mesh_depth_max"] = wrong.depth;
    found[prefix + "mesh_depth_max_voxels"] = wrong.depth / solids->voxel();
}

/// Compares points with the flow and its wall.
void checkPoints(const Context& c, const Flow& flow, const std::optional<WallSolids>& solids, Json& found) {
    const Points& particles = c.points("points").particles;
    const ParticleDiagnostics points = diagnoseParticles(flow, particles, c.follow("checking the points"));
    found["points"] = points.points;
    if (flow.domain().wall) {
        found["outside"] = points.outside;
        found["penetration_max"] = points.penetration;
        checkMesh(c, solids, "", particles.x, particles.y, particles.z, found);
    }
    // The track of points from a file belongs to another flow.
    const bool tracked = c.points("points").tracked.identity != Digest{};
    if (tracked && particles.hasTrack() && flow.hasTracks()) {
        found["drift_f"] = points.driftF;
        found["drift_g"] = points.driftG;
    }
    found["not_converged"] = points.notConverged;
}

/// Compares curves with the wall of the flow.
void checkCurves(const Context& c, const Flow& flow, const std::optional<WallSolids>& solids, Json& found) {
    const Curves& curves = *c.curves("curves");
    Points points;
    points.x = curves.x, points.y = curves.y, points.z = curves.z;
    const ParticleDiagnostics vertices = diagnoseParticles(flow, points, c.follow("checking the curves"));
    found["curves_vertices"] = vertices.points;
    found["curves_outside"] = vertices.outside;
    found["curves_penetration_max"] = vertices.penetration;
    checkMesh(c, solids, "curves_", curves.x, curves.y, curves.z, found);
}

void checkPositions(const Context& c, Json& found) {
    // Pathlines in a flow that changes were elsewhere than its wall is now.
    const bool curves = c.has("curves") && c.steady("what") && dimensionOf(c.anyFlow("what")) <= 3;
    const bool points = c.has("points") && !c.anyPoints("points").positionsN; // those have no wall and no track
    if (!points && !curves) return;
    const Flow flow = c.flow("what");
    const auto solids = WallSolids::of(c, "what");
    if (points) checkPoints(c, flow, solids, found);
    if (curves && flow.domain().wall) checkCurves(c, flow, solids, found);
}

/// Checks .vdb files against the conventions of a host. Returns what they lack.
std::vector<std::string> checkFiles(const Context& c, const Arguments& a, Json& found) {
    const HostProfile& host = kHostProfiles.at(a.choice("target"));
    std::vector<std::string> problems;
    for (const std::string& file : a.words()) {
        const auto lacks = hostProblems(file, host);
        for (const std::string& problem : lacks) problems.push_back(fmt::format("'{}': {}", file, problem));
        if (lacks.empty()) c.info(fmt::format("check: '{}' has what {} looks for", file, host.name));
    }
    found["files"] = a.words().size();
    found["host_problems"] = problems.size();
    return problems;
}

void checkTarget(const Arguments& a) {
    if (a.given("target") != !a.words().empty())
        throw ValueError("target= and .vdb files belong together: -check target=blender smoke.vdb");
}

void check(Context& c, const Arguments& a) {
    Json found = Json::object();
    bool staggered = false;
    constexpr double kBytesPerSample = 64;
    requireMemory(a.integer<double>("samples") * kBytesPerSample, fmt::format("{} samples", a.integer("samples")),
                  "use fewer samples");
    if (ofFlow(c))
        checkFlow(c, a, found);
    else if (c.has("what"))
        checkField(c, a, found);
    if (c.has("velocity")) {
        const auto velocity = velocityOf(c);
        const bool spatial = ofFlow(c) && dimensionOf(c.anyFlow("what")) <= 3;
        const GridDiagnostics grid = diagnoseGrid(*velocity, spatial ? c.flow("what").domain().wall : std::nullopt);
        staggered = velocity->getGridClass() == openvdb::GRID_STAGGERED;
        found["divergence_grid"] = grid.divergence;
        found["divergence_grid_overall"] = grid.divergenceOverall;
        found["staggered"] = staggered;
        found["grid_rms_speed"] = grid.rmsSpeed;
        found["grid_max_speed"] = grid.maxSpeed;
        found["voxels"] = grid.voxels;
        if (grid.beyondWall > 0) found["voxels_beyond_wall"] = grid.beyondWall;
    }
    if (const int64_t steps = a.integer("tracks"); steps > 0) checkTracks(c, static_cast<int>(steps), found);
    if (ofFlow(c)) checkPositions(c, found);
    const auto lacks = a.words().empty() ? std::vector<std::string>() : checkFiles(c, a, found);
    if (found.empty()) throw ValueError("nothing to check yet: no field, flow, velocity grid or points");
    if (c.wholeReport().contains("advect")) found["advect"] = c.wholeReport()["advect"];
    found["seconds"] = c.session().seconds();
    found["peak_memory_bytes"] = peakMemory();
    for (const auto& [name, value] : found.items())
        if (!value.is_object()) c.info(fmt::format("check: {:<38} {}", name, plain(value)));
    c.report("check") = found;
    if (a.given("report")) writeJson(a.text("report"), found);
    auto broken = violations(found, staggered);
    broken.insert(broken.end(), lacks.begin(), lacks.end());
    for (const auto& violation : broken) c.warn(violation);
    if (const std::string warning = tooFast(found); !warning.empty()) c.warn(warning);
    if (a.flag("strict") && !broken.empty()) throw ValueError(join(broken, "; "));
}

void expect(Context& c, const Arguments& a) {
    const std::string& path = a.words()[0];
    if (!a.given("min") && !a.given("max") && !a.given("below")) throw ValueError("needs min=, max= or below=");
    const double value = figureOf(c.wholeReport(), path);
    Json kept = {{"figure", path}, {"value", value}};
    for (const char* bound : {"min", "max"})
        if (a.given(bound)) kept[bound] = a.real(bound);
    if (a.given("min") && !(value >= a.real("min")))
        throw ValueError(fmt::format("{} is {:.6g}, below {:.6g}", path, value, a.real("min")));
    if (a.given("max") && !(value <= a.real("max")))
        throw ValueError(fmt::format("{} is {:.6g}, above {:.6g}", path, value, a.real("max")));
    if (a.given("below")) {
        const std::string other = a.text("below");
        const double bound = figureOf(c.wholeReport(), other);
        if (!(value < bound))
            throw ValueError(fmt::format("{} is {:.6g}, not below {}, {:.6g}", path, value, other, bound));
        kept["below"] = {{"figure", other}, {"value", bound}};
    }
    Json& all = c.wholeReport()["expect"];
    all.push_back(std::move(kept));
}

Action expectDeclaration() {
    return {.name = "expect",
            .group = kReportGroup,
            .summary = "fail unless a figure of the report is within bounds (assertion)",
            .options = {formerly({"least"}, real("min", "", "", "smallest value allowed")),
                        formerly({"most"}, real("max", "", "", "largest value allowed")),
                        text("below", "", "another figure of the report, which is an exclusive upper bound")},
            .positional = {"ACTION/FIGURE", 1, 1},
            .examples = {"curlew -config scenes/demo.txt -expect check/outside max=0",
                         "curlew -jitter -spacing name=curl -jitter method=random -spacing name=random "
                         "-expect random/minimum below=curl/minimum"},
            .evaluation = Evaluation::effect,
            .run = expect};
}

/// Declares the input: a flow if there is one, otherwise the newest field.
Input flowOrField() {
    Input input = maybe(stays("what", {Kind::flow, Kind::field}), "optional if there is a grid or points");
    input.firstKindFirst = true;
    return input;
}

} // namespace

Registry reportActions() {
    return {
        {.name = "check",
         .group = kReportGroup,
         .summary =
             "measure divergence, wall flux, penetration (of level set and mesh) and drift of a flow, or the value "
             "range of a field; or say what .vdb files lack for an application",
         .details = "figures: divergence_analytic is the largest trace of the Jacobian relative to its norm; "
                    "divergence_by_differences the rms of the divergence by central differences relative to that "
                    "of the Jacobian, and its order how fast it falls with the step; divergence_grid the rms of a "
                    "grid's divergence times voxel / rms speed, and divergence_grid_overall also at the edge of its "
                    "active voxels; grid_max_speed the speed of its fastest voxel; wall_flux the largest velocity "
                    "through the wall relative to the rms speed; "
                    "outside the number of points on the wrong side of the wall; penetration_max how far "
                    "the deepest point is beyond the wall, negative if all are on the right side.",
         .takes = {flowOrField(), maybe(stays("velocity", {Kind::velocity}), "also checked if there is one"),
                   maybe(stays("points", {Kind::points}), "also checked if there are any"),
                   maybe(stays("curves", {Kind::curves}), "also checked if there are any and the flow is steady")},
         .makes = {made("report", {Kind::report})},
         .options = {text("report", "", ".json file to write the figures to; -: standard output"),
                     integer("samples", "100000", 1, 1e9, "number of sample points in the flow or field"),
                     box("box", "region in which a field is measured (default: -1,-1,-1,1,1,1, or its own box)"),
                     integer("tracks", "0", 0, 1e7,
                             "number of RK4 steps for which 1000 points follow the flow and its velocity grid, to "
                             "measure how far they leave their tracks; needs a velocity grid"),
                     choice("target", hostNames(), "application for which the .vdb files are checked"),
                     flag("strict", "0", "1: fail if a guarantee does not hold, or a file lacks something")},
         .positional = {"FILE.vdb …", 0, 1000},
         .examples = {"curlew -config scenes/demo.txt -check report=check.json strict=1",
                      "curlew -check target=blender smoke-0001.vdb"},
         .evaluation = Evaluation::effect,
         .run = check,
         .prepare =
             [](const Arguments& a) {
                 checkTarget(a);
                 if (a.given("report")) checkWritable(a.text("report"));
             },
         .files =
             [](const Arguments& a) {
                 FileUse use{.read = a.words()};
                 if (a.given("report")) use.written = {a.text("report")};
                 return use;
             }},
        expectDeclaration(),
        {.name = "report",
         .group = kReportGroup,
         .summary =
             "write the report as .json (-: standard output): what has been done so far, with times and measurements",
         .makes = {made("file", {Kind::file})},
         .positional = {"FILE.json", 1, 1},
         .examples = {"curlew -config scenes/demo.txt -report run.json"},
         .evaluation = Evaluation::effect,
         .run =
             [](Context& c, const Arguments& a) {
                 c.wholeReport()["seconds"] = c.session().seconds();
                 c.wholeReport()["peak_memory_bytes"] = peakMemory();
                 writeJson(a.words()[0], c.wholeReport());
             },
         .prepare = [](const Arguments& a) { checkWritable(a.words()[0]); },
         .files = [](const Arguments& a) { return FileUse{.written = {a.words()[0]}}; }}};
}

} // namespace curlew::app
