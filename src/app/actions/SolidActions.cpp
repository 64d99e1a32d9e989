// SPDX-License-Identifier: Apache-2.0
#include "SolidActions.h"

#include "Actions.h"
#include "Kink.h"
#include "curlew/app/run/Value.h"
#include "curlew/vdb/LevelSetBoolean.h"
#include "curlew/vdb/Openvdb.h"

namespace curlew::app {

namespace {

using namespace options;

const std::vector<Kind> kSolids{Kind::shape, Kind::levelSet, Kind::mesh};

bool isShape(const Context& c, const char* input) { return kindOf(c.value(input)) == Kind::shape; }

/// Returns combine(a, b) for two shapes of the same dimension; otherwise for both in 3D.
template <class Combine>
AnySdf combinedShapes(const AnySdf& a, const AnySdf& b, const Combine& combine) {
    const auto *p = std::get_if<SdfN<2>>(&a), *q = std::get_if<SdfN<2>>(&b);
    if (p && q) return combine(*p, *q);
    return combine(inSpace(a), inSpace(b));
}

AnySdf combinedShapes(const Context& c, Boolean operation, double smoothing) {
    return combinedShapes(*c.field("first").sdf, *c.field("second").sdf, [&](const auto& p, const auto& q) -> AnySdf {
        switch (operation) {
            case Boolean::unite:
                return unite(p, q, smoothing);
            case Boolean::intersect:
                return intersect(p, q, smoothing);
            default:
                return subtract(p, q, smoothing);
        }
    });
}

/// Returns a level set; if `earlier` and the level set is between two frames, returns that of the earlier frame.
const GridValue& gridIn(const Context& c, const char* input, bool earlier) {
    const GridValue& value = c.grid(input);
    return earlier && value.earlier ? *value.earlier : value;
}

/// Returns a level set, or a mesh converted to one, with the voxels of `like` if it is given.
LevelSet solidIn(const Context& c, const Arguments& a, const char* input, const std::optional<LevelSet>& like,
                 bool earlier) {
    if (kindOf(c.value(input)) == Kind::levelSet) {
        const GridValue& value = gridIn(c, input, earlier);
        LevelSet levelSet = levelSetOf(value.grid);
        levelSet.mesh = value.mesh;
        return levelSet;
    }
    const double voxel = a.given("voxel") ? a.real("voxel") : like ? like->voxelSize() : 0;
    return meshToLevelSet(c.mesh(input), {.voxel = voxel, .dim = a.integer<int>("dim")}, c.follow("mesh to level set"));
}

/// Combines two solids that are not both shapes.
LevelSet combinedSolids(const Context& c, const Arguments& a, Boolean operation, bool earlier) {
    const Monitor monitor = c.follow("combining");
    std::optional<LevelSet> first, second;
    if (kindOf(c.value("first")) == Kind::levelSet) first = solidIn(c, a, "first", {}, earlier);
    if (kindOf(c.value("second")) == Kind::levelSet) second = solidIn(c, a, "second", {}, earlier);
    if (!first && !isShape(c, "first")) first = solidIn(c, a, "first", second, earlier);
    if (!second && !isShape(c, "second")) second = solidIn(c, a, "second", first, earlier);
    if (operation == Boolean::unite)
        for (const char* input : {"first", "second"})
            if (isShape(c, input) && !c.sdf(input, 0).bounds.finite())
                throw ValueError(
                    "the union of a level set and an unbounded shape is unbounded; cut the shape off first (-box "
                    "-intersection)");
    if (!first) return combined(c.sdf("first", 0), *second, operation, monitor);
    if (!second) return combined(*first, c.sdf("second", 0), operation, monitor);
    return combined(*first, *second, operation, monitor);
}

void combine(Context& c, const Arguments& a, Boolean operation) {
    if (isShape(c, "first") && isShape(c, "second")) {
        sayKink(c, a);
        c.give(fieldOfShape(combinedShapes(c, operation, a.real("smoothing"))));
        return;
    }
    const LevelSet levelSet = combinedSolids(c, a, operation, false);
    GridValue result{levelSet.grid, levelSet.mesh};
    for (const char* input : {"first", "second"}) { // between two frames
        if (kindOf(c.value(input)) != Kind::levelSet || result.earlier) continue;
        const GridValue& value = c.grid(input);
        if (!value.earlier || value.part >= 1) continue;
        const LevelSet before = combinedSolids(c, a, operation, true);
        result.earlier = std::make_shared<GridValue>(GridValue{before.grid, before.mesh});
        result.part = value.part;
    }
    c.give(std::move(result));
}

std::vector<Object> combinedObject(const Arguments&, const std::vector<std::vector<Object>>& inputs, const World&) {
    const auto is = [&](size_t k, Kind kind) { return !inputs[k].empty() && inputs[k].front().kind == kind; };
    if (!is(0, Kind::shape) || !is(1, Kind::shape)) return {{.kind = Kind::levelSet, .name = "levelSet"}};
    const bool flat = inputs[0].front().dimension == 2 && inputs[1].front().dimension == 2;
    return {{.kind = Kind::shape, .dimension = flat ? 2 : 3, .name = "shape"}};
}

Action combiningAction(const std::string& name, const std::string& summary, std::vector<std::string> examples,
                       Boolean operation) {
    return {
        .name = name,
        .group = "shapes",
        .summary = summary,
        .takes = {taken("first", kSolids), taken("second", kSolids)},
        .makes = {made("solid", {Kind::shape, Kind::levelSet})},
        .options = {notNegative("smoothing", "0.1", "world units",
                                "for two shapes: distance over which the edge between them is rounded (C²); 0: a sharp "
                                "edge. Level sets meet in a sharp edge"),
                    integer(
                        "dim", fmt::format("{}", SolidOptions{}.dim), 1, 1e6,
                        "for meshes, if no level set gives the voxel size: number of voxels along the longest edge"),
                    instead(positive("voxel", "", "world units", "for meshes: voxel size"), {"dim"}), keep()},
        .examples = std::move(examples),
        .evaluation = Evaluation::anyTime,
        .run = [operation](Context& c, const Arguments& a) { combine(c, a, operation); },
        .makesWith = combinedObject};
}

// --- moving

/// Returns where a level set is once it has been placed, perhaps not for the first time.
PlacedGrid placedFrom(const GridValue& levelSet, const Placement& placement) {
    const PlacedGrid from = levelSet.placed.value_or(PlacedGrid{.original = levelSet.grid});
    const Matrix3 turn = rotationOf(placement);
    const double scale = placement.scale[0];
    return {.original = from.original,
            .pose = {turn * from.pose.axes, turn * (from.pose.origin * scale) + placement.offset},
            .scale = from.scale * scale};
}

void move(Context& c, const Arguments& a) {
    const double scale = a.real("scale");
    const Placement placement{
        .offset = a.vector("translate"), .rotate = a.vector("rotate"), .scale = {{scale, scale, scale}}};
    const Kind kind = kindOf(c.value("what"));
    if (kind == Kind::mesh) {
        c.give(std::make_shared<const Mesh>(placed(*c.mesh("what"), placement)));
    } else if (kind == Kind::levelSet) {
        const LevelSet levelSet = placed(solidIn(c, a, "what", {}, false), placement);
        c.give(
            GridValue{.grid = levelSet.grid, .mesh = levelSet.mesh, .placed = placedFrom(c.grid("what"), placement)});
    } else {
        c.give(GridValue{placed(*c.grid("what").grid, placement)});
    }
}

Action moveAction() {
    return {.name = "move",
            .group = "shapes",
            .summary = "scale, rotate and translate the newest mesh or grid (-transform does it for fields and shapes)",
            .takes = {taken("what", {Kind::mesh, Kind::grid})},
            .makes = {made("moved", {Kind::mesh, Kind::grid})},
            .options = {formerly({"offset"}, vector("translate", "0,0,0", "world units", "translation")),
                        vector("rotate", "0,0,0", "degrees", "rotation about x, then y, then z"),
                        positive("scale", "1", "", "scale, applied before the rotation and the translation"), keep()},
            .examples = {"curlew -read bunny.obj -move rotate=0,90,0 translate=1,0,0 -mesh2ls -write bunny.vdb"},
            .run = move,
            .makesWith = [](const Arguments&, const std::vector<std::vector<Object>>& inputs, const World&) {
                Object moved = inputs[0].empty() ? Object{.kind = Kind::mesh} : inputs[0].front();
                moved.name = "moved";
                return std::vector{moved};
            }};
}

} // namespace

Registry solidActions() {
    return {combiningAction(
                "union", "CSG union of the newest two shapes, level sets or meshes; a level set unless both are shapes",
                {"curlew -sphere radius=0.5 -box translate=0,-0.6,0 size=2,0.6,2 -union smoothing=0.2 -slice "
                 "axis=z -write union.png",
                 "curlew -read body.obj head.obj -union -write both.vdb"},
                Boolean::unite),
            combiningAction("intersection", "CSG intersection of the newest two shapes, level sets or meshes",
                            {"curlew -gyroid -sphere radius=1 -intersection -noise -noise seed=1 -bound layer=0.05 "
                             "-dfvn -velocity -write ball.vdb"},
                            Boolean::intersect),
            combiningAction(
                "difference",
                "CSG difference A - B of shapes, level sets or meshes, where B is the newest and A the one before it",
                {"curlew -sphere radius=1 -capsule radius=0.4 length=3 -difference -noise -noise seed=1 "
                 "-bound -dfvn -velocity -write bead.vdb"},
                Boolean::subtract),
            moveAction()};
}

} // namespace curlew::app
