// SPDX-License-Identifier: Apache-2.0
#include "Actions.h"
#include "BetweenFrames.h"
#include "FlowInSpace.h"
#include "curlew/flow/Flows.h"
#include "curlew/vdb/GridFlow.h"
#include "curlew/vdb/Openvdb.h"

#include <algorithm>

namespace curlew::app {

namespace {

using namespace options;

/// Returns where the components x, y and z are among names that only differ in the last letter, x, y and z or u, v and
/// w; nullopt if they are not there. The first name is that of one of them.
std::optional<std::array<size_t, 3>> componentsAmong(const std::vector<std::string>& names) {
    const std::string& some = names.front();
    if (some.empty()) return {};
    const std::string stem = some.substr(0, some.size() - 1);
    for (const std::string_view letters : {"xyz", "XYZ", "uvw", "UVW"}) {
        if (letters.find(some.back()) == std::string_view::npos) continue;
        std::array<size_t, 3> found{};
        for (size_t k = 0; k < 3; ++k)
            found[k] = static_cast<size_t>(std::ranges::find(names, stem + letters[k]) - names.begin());
        if (std::ranges::count(found, names.size()) == 0) return found;
    }
    return {};
}

/// Returns which grids are a velocity, of those on the stacks from the newest on: the newest grid of vectors, or three
/// scalar grids whose names say that they are the components. Other scalar grids, such as a density, are left.
std::vector<size_t> velocityAmong(const std::vector<Object>& grids) {
    for (size_t k = 0; k < grids.size(); ++k) {
        if (grids[k].kind == Kind::velocity) return {k};
        std::vector<std::string> names;
        for (size_t n = k; n < grids.size(); ++n) names.push_back(grids[n].kind == Kind::grid ? grids[n].name : "");
        if (const auto found = componentsAmong(names)) return {k + (*found)[0], k + (*found)[1], k + (*found)[2]};
    }
    return {};
}

/// Declares the input: one grid of vectors, or three of scalars.
Input velocityInput() {
    Input input = several(taken("grid", {Kind::grid}), 1, 3,
                          "the newest velocity: a grid of vectors, or three scalar grids whose names end in x, y, z or "
                          "u, v, w; or else the newest three scalar grids: x, y and z in this order");
    input.choose = velocityAmong;
    input.amountWith = [](const Arguments&, const Scope& scope) {
        const auto newest = scope.newest({Kind::grid});
        const bool scalar = newest && newest->kind != Kind::velocity;
        return scope.linked() ? Amount{1, 3} : scalar ? Amount{3, 3} : Amount{1, 1};
    };
    return input;
}

/// Sorts three grids by the letters of their components, if they have them.
VelocityGrids inOrderOfNames(VelocityGrids grids) {
    std::vector<std::string> names;
    for (const auto& grid : grids) names.push_back(grid->getName());
    const auto found = componentsAmong(names);
    return found ? VelocityGrids{grids[(*found)[0]], grids[(*found)[1]], grids[(*found)[2]]} : grids;
}

/// Returns the wall of the flow. Its layer is two voxels wide by default.
std::optional<Wall> wallOf(const Context& c, const Arguments& a, double voxel) {
    if (!c.has("wall")) return std::nullopt;
    if (!c.steady("wall")) throw ValueError("the wall must be at rest; put its actions before -frames");
    const double width = a.given("layer") ? a.real("layer") : 2 * voxel;
    return Wall{.sdf = c.sdf("wall", width), .side = a.choice<Side>("side"), .width = width};
}

Flow flowOfPotentials(const Context& c, const Arguments& a, const VelocityGrids& grids) {
    const PotentialFlowOptions options{.wall = wallOf(c, a, grids.front()->voxelSize()[0])};
    const PotentialFlow made = potentialFlow(grids, options, c.follow("flow"));
    c.info(
        fmt::format("flow: potentials of {} x {} x {} voxels; divergence per voxel {:.1e} of the rms velocity in "
                    "the grid, {:.1e} in the flow; the velocities through the faces changed by {:.1e}",
                    made.cells[0], made.cells[1], made.cells[2], made.divergence, made.residual, made.change));
    constexpr double kMuch = 0.05;
    if (made.change > kMuch)
        c.warn(fmt::format("the velocities changed by {:.0f} % to become divergence-free{}", 100 * made.change,
                           options.wall ? " and tangent to the wall" : ""));
    if (made.channels > 0 && options.wall)
        c.warn(
            "the flow passes through a hole of the wall, or between closed sides of the box; single terms cross "
            "closed sides, and the flow is slower beside a wall with a hole");
    return made.flow;
}

Flow interpolatedFlow(const Context& c, const Arguments& a, const VelocityGrids& grids) {
    const auto sampling = a.choice<GridSampling>("interpolation");
    Flow flow = sampledFlow(grids, sampling, c.follow("flow"));
    c.info(fmt::format("flow: {} interpolation of {}; not divergence-free, no tracks (exact=1 makes potentials)",
                       kGridSamplingNames.at(static_cast<size_t>(sampling)),
                       grids.size() == 1
                           ? fmt::format("the {} velocity grid '{}'", isStaggered(grids) ? "staggered" : "collocated",
                                         grids.front()->getName())
                           : fmt::format("a {} velocity grid", isStaggered(grids) ? "staggered" : "collocated")));
    return flow;
}

/// Returns (1 - part) a + part b in the box around both domains. It is divergence-free if both flows are.
Flow blendFlows(const Flow& a, const Flow& b, double part) {
    Domain domain = b.domain();
    for (int k = 0; k < 3; ++k) {
        domain.box.lower[k] = std::min(domain.box.lower[k], a.domain().box.lower[k]);
        domain.box.upper[k] = std::max(domain.box.upper[k], a.domain().box.upper[k]);
    }
    return (scaled(a, 1 - part) + scaled(b, part)).within(domain);
}

void flowOfGrid(Context& c, const Arguments& a) {
    const bool exact = a.flag("exact");
    if (!exact && (c.has("wall") || a.given("side") || a.given("layer")))
        throw ValueError("a wall needs exact=1: without potentials, the flow cannot be made tangent to it");
    const auto make = [&](const VelocityGrids& given) {
        const VelocityGrids grids = given.size() == 3 ? inOrderOfNames(given) : given;
        if (grids.size() == 3)
            c.info(fmt::format("flow: the components x, y and z are the grids '{}', '{}' and '{}'", grids[0]->getName(),
                               grids[1]->getName(), grids[2]->getName()));
        return exact ? flowOfPotentials(c, a, grids) : interpolatedFlow(c, a, grids);
    };
    c.give(AnyFlow(blendedInTime(c, "grid", make, blendFlows)));
}

void gradient(Context& c, const Arguments& a) {
    const auto make = [&]<int N>(const ScalarFieldN<N>& field) -> AnyFlow {
        if constexpr (N == 2 || N == 3) {
            DomainN<N> domain;
            if (a.given("box")) {
                const Box box = a.box("box");
                for (int k = 0; k < N; ++k) {
                    domain.box.lower[k] = box.lower[k];
                    domain.box.upper[k] = box.upper[k];
                }
            }
            const FlowN<N> flow = gradientFlow(field, domain);
            return a.given("speed") ? withSpeed(flow, a.real("speed"), c.follow("measuring the speed")) : flow;
        } else {
            throw ValueError(fmt::format("needs a field of 2 or 3 dimensions, but the newest has {}", N));
        }
    };
    c.give(std::visit(make, c.field("field").field));
}

} // namespace

Registry gridFlowActions() {
    return {
        {.name = "flow",
         .group = "flows",
         .summary = "flow from a velocity grid (of a solver, or our own): as it is, or with exact potentials",
         .details =
             "Without exact=1, the velocity is interpolated between the voxels, as hosts do. Such a flow is not "
             "divergence-free: points gather and thin out, and may enter obstacles. With exact=1, the flow has vector "
             "potentials. It is divergence-free at every point, has the same fluxes through the faces of the voxels, "
             "and "
             "is tangent to the wall. To follow its terms one by one, which never cross the wall, use -advect "
             "splitting=strang. In a sequence of grids, one for each frame, the velocity changes linearly from frame "
             "to frame.",
         .takes = {velocityInput(), onRequest(stays("wall", {Kind::shape, Kind::levelSet}),
                                              "only if it is linked, or with side=: an obstacle or a container",
                                              [](const Arguments& a) { return a.given("side"); })},
         .makes = {made("flow", {Kind::flow})},
         .options =
             {flag("exact", "0", "1: a flow with vector potentials, divergence-free at every point"),
              instead(choice("interpolation", kGridSamplingNames, "how the velocity is interpolated without exact=1"),
                      {"exact"}),
              choice("side", {"inside", "outside", "both"}, "exact=1: side of the wall on which the flow is",
                     "outside"),
              positive("layer", "", "world units",
                       "exact=1: width of the layer in which the flow turns along the wall (default: two voxels)"),
              keep()},
         .examples = {"curlew -noise frequency=2 -noise frequency=2 seed=1 -dfvn -velocity dim=32 staggered=1 -flow "
                      "exact=1 -scatter count=1000 -advect splitting=strang -write points.ply"},
         .evaluation = Evaluation::anyTime,
         .run = flowOfGrid,
         .makesWith = flowInSpace},
        {.name = "gradient",
         .group = "flows",
         .summary = "the gradient of the newest field as a velocity: with sources and sinks, not divergence-free",
         .details =
             "Points move towards the maxima of the field. A counterexample to divergence-free flows, and a way to "
             "attract points.",
         .takes = {taken("field", {Kind::field})},
         .makes = {made("flow", {Kind::flow})},
         .options = {positive("speed", "", "world units / s",
                              "rms speed over the domain to which the flow is scaled (default: not scaled)"),
                     box("box", "domain of the flow (default: -1,-1,-1,1,1,1)"), keep()},
         .examples = {"curlew -noise frequency=2 -gradient -scatter count=1000 -advect duration=0.5 -write sinks.ply"},
         .evaluation = Evaluation::anyTime,
         .run = gradient}};
}

} // namespace curlew::app
