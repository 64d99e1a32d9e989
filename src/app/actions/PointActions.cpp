// SPDX-License-Identifier: Apache-2.0
#include "Actions.h"
#include "AdvectAction.h"
#include "PointsN.h"
#include "ScatterDomain.h"
#include "curlew/base/Memory.h"
#include "curlew/base/Random.h"
#include "curlew/track/Distance.h"
#include "curlew/track/Neighbours.h"
#include "curlew/track/Scatter.h"
#include "curlew/track/Snap.h"
#include "curlew/vdb/SnapToLevelSet.h"

#include <algorithm>
#include <utility>

namespace curlew::app {

namespace {

using namespace options;

const std::string kPointGroup = "points";
const char* const kFewerPoints = "use fewer points, or make them in parts with part=";
constexpr double kSnapTolerance = 1e-9; ///< In the field's value, or relative to the surface's size or voxel size.

/// A range of points, by id.
struct PointRange {
    size_t first = 0, count = 0;
};

Part partGiven(const Arguments& a) { return a.given("part") ? partOf(a.text("part")) : Part{}; }

/// Returns the points of the current part.
PointRange rangeOfPart(const Context& c, const Arguments& a) {
    const Part part = partGiven(a);
    const auto count = a.integer<size_t>("count"), parts = static_cast<size_t>(part.count);
    if (parts > count) throw ValueError(fmt::format("{} points cannot be made in {} parts", count, parts));
    if (parts == 1) return {.first = 0, .count = count};
    const size_t k = static_cast<size_t>(c.moment().part) - 1;
    const size_t each = count / parts, longer = count % parts; // the first parts have one point more
    return {.first = each * k + std::min(k, longer), .count = each + (k < longer ? 1 : 0)};
}

/// Scatters points in the box of a domain of N > 3 dimensions.
template <int N>
void scatterPointsN(Context& c, const Arguments& a, const PointRange& range) {
    for (const char* option : {"on", "offset"})
        if (a.given(option)) throw ValueError(fmt::format("{}= needs points in 3D, not in {} dimensions", option, N));
    if (c.has("density")) throw ValueError(fmt::format("density= needs points in 3D, not in {} dimensions", N));
    const BoxN<N> box = domainOfPointsN<N>(c, a, "domain").box;
    if (!box.finite()) throw ValueError("the domain is infinite; give a box");
    requireMemory(static_cast<double>(range.count) * sizeof(Vec<double, N>), fmt::format("{} points", range.count),
                  kFewerPoints);
    const auto seed = a.integer<uint64_t>("seed");
    std::vector<Vec<double, N>> positions(range.count);
    for (size_t k = 0; k < range.count; ++k)
        for (int axis = 0; axis < N; ++axis)
            positions[k][axis] =
                box.lower[axis] + box.size()[axis] * randomUniform(seed, range.first + k, static_cast<uint64_t>(axis));
    givePointsN(c, std::move(positions));
}

void scatterAction(Context& c, const Arguments& a) {
    const PointRange range = rangeOfPart(c, a);
    if (const int dimension = pointDimension(c, a, "domain"); dimension > 3)
        return withDimension(dimension, [&](auto n) { scatterPointsN<n>(c, a, range); });
    const Birthplace birth = birthplaceOf(c, a, OffSurface::flowsOnly);
    requireMemory(static_cast<double>(range.count) * Points::kPlainBytes, fmt::format("{} points", range.count),
                  kFewerPoints);
    ScatterOptions place = birth.place;
    place.seed = a.integer<uint64_t>("seed");
    givePoints(c,
               scatterFrom(birth.domain, static_cast<int64_t>(range.first), range.count, place, c.follow("scatter")));
}

/// Moves points within reach to the isosurface of a field. The default reach is half the diagonal of the points' box.
SnapResult snapToValue(Context& c, const Arguments& a, Points& points, const std::optional<Box>& box) {
    const double size = box ? length(box->size()) : 0;
    const double reach = a.given("maxDistance") ? a.real("maxDistance") : size > 0 ? size / 2 : 1;
    return snap(inSpace(c.field("field").field), a.real("iso"), points, reach, kSnapTolerance, c.follow("snap"));
}

/// Moves points to a surface, from any distance unless maxDistance= is given.
SnapResult snapToSurface(Context& c, const Arguments& a, Points& points) {
    const double reach = a.given("maxDistance") ? a.real("maxDistance") : std::numeric_limits<double>::max();
    if (c.kind("surface") == Kind::levelSet) {
        const LevelSet levelSet = c.levelSet("surface", 0);
        return snapToLevelSet(levelSet, points, reach, kSnapTolerance * levelSet.voxelSize(), c.follow("snap"));
    }
    const Sdf shape = c.sdf("surface", 0);
    const double size = length(shape.bounds.size());
    return snap(shape.distance, 0, points, reach, kSnapTolerance * (std::isfinite(size) ? size : 1), c.follow("snap"));
}

void snapAction(Context& c, const Arguments& a) {
    const auto box = boxOf(c.value("points"));
    PointSet set = c.takePoints("points");
    const SnapResult result =
        a.given("iso") ? snapToValue(c, a, set.particles, box) : snapToSurface(c, a, set.particles);
    c.info(fmt::format("snap: {} points, moved by {:.4g} on average{}", result.points, result.moved,
                       result.missed > 0 ? fmt::format("; {} stay in place, since they are too far away or do not come "
                                                       "to lie on the surface",
                                                       result.missed)
                                         : ""));
    c.report("snap") = {{"points", result.points}, {"moved", result.moved}, {"missed", result.missed}};
    c.give(std::make_shared<PointSet>(std::move(set)));
}

void distanceAction(Context& c, const Arguments&) {
    const Monitor monitor = c.follow("distance");
    if (kindOf(c.value("what", 0)) != kindOf(c.value("what", 1)))
        throw ValueError("the two inputs must both be points or both be curves");
    const Distance d = c.kind("what") == Kind::points
                           ? distanceBetween(c.points("what", 0).particles, c.points("what", 1).particles, monitor)
                           : distanceBetween(*c.curves("what", 0), *c.curves("what", 1), monitor);
    c.info(fmt::format("distance: mean {:.6g}, maximum {:.6g}, of {} pairs", d.mean, d.max, d.pairs));
    Json& figures = c.memory().figures;
    const size_t earlier = figures.value("unmatched_all", size_t{0});
    figures = {{"pairs", d.pairs}, {"mean", d.mean},           {"rms", d.rms},
               {"max", d.max},     {"unmatched", d.unmatched}, {"unmatched_all", earlier + d.unmatched}};
    c.report("distance") = figures;
}

void spacingAction(Context& c, const Arguments& a) {
    const PointSet& set = c.anyPoints("points");
    const Monitor monitor = c.follow("spacing");
    const auto inSpace = [&] {
        const Points& particles = set.particles;
        requireMemory(static_cast<double>(particles.size()) * sizeof(Vec3d), fmt::format("{} points", particles.size()),
                      "use fewer points");
        std::vector<Vec3d> points(particles.size());
        for (size_t k = 0; k < points.size(); ++k) points[k] = particles.position(k);
        return spacingOf(points, monitor);
    };
    const Spacing spacing =
        set.positionsN ? std::visit([&](const auto& points) { return spacingOf(points, monitor); }, *set.positionsN)
                       : inSpace();
    const std::string name = a.text("name");
    c.info(fmt::format("{}: distance of {} points to their nearest neighbours: median {:.4g}, minimum {:.4g}", name,
                       set.size(), spacing.median, spacing.minimum));
    c.report(name) = {{"points", set.size()}, {"median", spacing.median}, {"minimum", spacing.minimum}};
}

} // namespace

Registry pointActions() {
    return {
        {.name = "scatter",
         .group = kPointGroup,
         .summary = "scatter random points (particles) in or on the newest flow, shape or level set",
         .takes = {domainInput(), densityInput()},
         .makes = {made("points", {Kind::points})},
         .options =
             {integer("count", "10000", 1, 1e15, "number of points"),
              text("part", "",
                   "part of the points to make: 3/500 is the third of 500 parts, for one of several machines; each/500 "
                   "makes one after the other, with all that depends on them, so that memory does not grow with the "
                   "count. The part is $P in the names of files"),
              integer("dimensions", "", 3, 7, "number of dimensions (default: as many as the newest flow has, else 3)"),
              integer("seed", "0", 0, 0x1p53 - 1, "random seed"), onOption(),
              offsetOption("0 on a shape or level set; at the wall of a flow 0.1 %"),
              box("box", "box to fill; dimensions beyond z have the range of x (default: the box of the domain)"),
              ages("grid", "", "level set to fill: 0 is the newest")},
         .examples =
             {"curlew -torus -scatter count=1e5 seed=3 -write torus.ply",
              "curlew -torus -scatter on=surface count=1e5 -splat -write skin.png",
              "curlew -noise -noise seed=1 -dfvn speed=1 -scatter count=1e6 part=each/4 -advect -write 'dust.$P3.vdb'",
              "curlew -noise frequency=3 as=patches -torus -scatter on=surface density=patches -write moss.ply"},
         .inFrames = InFrames::once,
         .partWith = partGiven,
         .run = scatterAction},
        advectAction(),
        {.name = "snap",
         .group = kPointGroup,
         .summary = "project the newest points onto the newest shape or level set, or onto an isosurface of a field",
         .takes = {onlyIf(stays("surface", {Kind::shape, Kind::levelSet}), "not used if iso= is given",
                          [](const Arguments& a) { return !a.given("iso"); }),
                   onlyIf(stays("field", {Kind::field}),
                          "only with iso=", [](const Arguments& a) { return a.given("iso"); }),
                   changed("points", {Kind::points})},
         .makes = {made("points", {Kind::points})},
         .options =
             {real("iso", "", "",
                   "isovalue of the newest field, onto whose isosurface points move instead of a shape or level set"),
              formerly(
                  {"reach"},
                  positive(
                      "maxDistance", "", "world units",
                      "maximum distance; points farther away stay where they are (default: unlimited; with iso= half "
                      "the diagonal of the points' box)")),
              keep()},
         .examples = {"curlew -torus -scatter count=3000 -snap -splat look=opaque pointRadius=0.02 -write skin.png"},
         .run = snapAction},
        {.name = "distance",
         .group = kPointGroup,
         .summary =
             "measure the distances between two sets of points or curves, matched by id, and count unmatched ids",
         .takes = {several(stays("what", {Kind::points, Kind::curves}, "geo"), 2, 2, "both points, or both curves")},
         .makes = {made("report", {Kind::report})},
         .options = {ages("geo", "0,1", "the two objects to compare: 0 is the newest")},
         .examples =
             {"curlew -sphere -noise frequency=2 -noise frequency=2 seed=1 -bound -dfvn speed=1 -scatter -advect "
              "steps=20 -scatter -advect steps=40 -distance"},
         .evaluation = Evaluation::effect,
         .run = distanceAction},
        {.name = "spacing",
         .group = kPointGroup,
         .summary = "measure each point's distance to its nearest neighbour: median and minimum",
         .takes = {stays("points", {Kind::points})},
         .makes = {made("report", {Kind::report})},
         .options = {text("name", "spacing", "name of the figures in the report")},
         .examples = {"curlew -jitter spacing=0.1 -spacing -expect spacing/median min=0.078 max=0.085"},
         .evaluation = Evaluation::effect,
         .run = spacingAction}};
}

} // namespace curlew::app
