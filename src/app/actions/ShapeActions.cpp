// SPDX-License-Identifier: Apache-2.0
#include "Actions.h"
#include "SolidActions.h"
#include "curlew/app/registry/Expression.h"
#include "curlew/field/ShapeModels.h"

#include <limits>

namespace curlew::app {

namespace {

using namespace options;

const std::string kShapeGroup = "shapes";

std::vector<Option> placementOptions() {
    return {formerly({"offset"}, vector("translate", "0,0,0", "world units", "translation")),
            vector("rotate", "0,0,0", "degrees", "rotation about x, then y, then z"),
            positive("scale", "1", "", "scale, applied before the rotation and the translation")};
}

template <int N>
PlacementN<N> placementOf(const Arguments& a) {
    PlacementN<N> placement{.rotate = a.vector("rotate")};
    // The box of a rotated shape suits any rotation. A rotation that changes and happens to be zero is replaced by an
    // unnoticeable one, so that the box does not jump.
    const auto written = a.written().find("rotate");
    const bool changes = written != a.written().end() && variablesOf(written->second).time;
    if (changes && placement.rotate == Vec3d{}) placement.rotate[2] = std::numeric_limits<double>::min();
    const Vec3d offset = a.vector("translate");
    if (N == 2 && offset[2] != 0) throw ValueError("translate= of a 2D shape must have z = 0");
    for (int axis = 0; axis < N; ++axis) {
        placement.offset[axis] = offset[axis];
        placement.scale[axis] = a.real("scale");
    }
    return placement;
}

AnySdf put(const AnySdf& shape, const Arguments& a) {
    return std::visit(
        [&](const auto& sdf) -> AnySdf {
            return placed(sdf, placementOf<std::remove_cvref_t<decltype(sdf.distance)>::kDimension>(a));
        },
        shape);
}

bool hasDimension(const Action& action) { return action.option("dimensions") != nullptr; }

std::vector<Object> shapeOf(const Arguments& a, const std::vector<std::vector<Object>>&, const World&) {
    const int dimension = hasDimension(a.action()) ? a.integer<int>("dimensions") : 3;
    return {{.kind = Kind::shape, .dimension = dimension, .name = "shape"}};
}

Option dimensions(const std::string& what) {
    return formerly({"dim"}, integer("dimensions", "3", 2, 3, "2: " + what + ", for 2D noises"));
}
bool isFlat(const Arguments& a) { return a.integer("dimensions") == 2; }
Vec<double, 2> inPlane(const Vec3d& v) { return {{v[0], v[1]}}; }

Action shapeAction(std::string name, std::string summary, std::vector<Option> shape, std::string example,
                   AnySdf (*make)(const Arguments&)) {
    for (auto& option : placementOptions()) shape.push_back(option);
    return {.name = std::move(name),
            .group = kShapeGroup,
            .summary = std::move(summary),
            .makes = {made("shape", {Kind::shape})},
            .options = std::move(shape),
            .examples = {std::move(example)},
            .evaluation = Evaluation::anyTime,
            .run = [make](Context& c, const Arguments& a) { c.give(fieldOfShape(put(make(a), a))); },
            .makesWith = shapeOf};
}

Registry primitives() {
    return {
        shapeAction("sphere", "sphere, as an exact signed distance (SDF)",
                    {positive("radius", "1", "world units", "radius"), dimensions("a disc")},
                    "curlew -sphere radius=0.5 -noise -noise seed=1 -bound -dfvn -velocity -write ball.vdb",
                    [](const Arguments& a) -> AnySdf {
                        if (isFlat(a)) return sphereSdf<2>(a.real("radius"));
                        return sphereSdf(a.real("radius"));
                    }),
        shapeAction(
            "box", "rounded box (cuboid), as an exact signed distance (SDF)",
            {vector("size", "2,2,2", "world units", "edge lengths"),
             notNegative("rounding", "0.2", "world units",
                         "radius of the rounded edges; keep the layer= of -bound below it"),
             dimensions("a rectangle")},
            "curlew -box size=2,1,1 rounding=0.2 -noise -noise seed=1 -bound layer=0.15 -dfvn -velocity -write box.vdb",
            [](const Arguments& a) -> AnySdf {
                if (isFlat(a)) return boxSdf<2>(inPlane(a.vector("size")), a.real("rounding"));
                return boxSdf(a.vector("size"), a.real("rounding"));
            }),
        shapeAction(
            "torus", "torus about the y axis, as an exact signed distance (SDF)",
            {positive("radius", "0.7", "world units", "major radius: from the centre to the middle of the tube"),
             positive("tube", "0.3", "world units", "minor radius: of the tube")},
            "curlew -torus radius=1 tube=0.4 rotate=90,0,0 -slice -write torus.png",
            [](const Arguments& a) -> AnySdf {
                return sdfOf(shapes::Torus{a.real("radius"), a.real("tube")});
            }),
        shapeAction("capsule", "capsule along the y axis, as an exact signed distance (SDF)",
                    {positive("length", "1", "world units", "length of the cylinder between the hemispheres"),
                     positive("radius", "0.5", "world units", "radius")},
                    "curlew -capsule length=2 radius=0.5 -noise -noise seed=1 -bound -dfvn -velocity -write pill.vdb",
                    [](const Arguments& a) -> AnySdf {
                        return sdfOf(shapes::Capsule{a.real("length"), a.real("radius")});
                    }),
        shapeAction(
            "cylinder", "cylinder along the y axis with rounded edges, as an exact signed distance (SDF)",
            {positive("length", "2", "world units", "length, with the rounded edges"),
             positive("radius", "0.5", "world units", "radius, with the rounded edges"),
             notNegative("rounding", "0.1", "world units", "radius of the rounded edges")},
            "curlew -cylinder length=3 -noise -noise seed=1 -bound side=outside -dfvn -velocity -write pillar.vdb",
            [](const Arguments& a) -> AnySdf {
                return sdfOf(shapes::Cylinder{a.real("length"), a.real("radius"), a.real("rounding")});
            }),
        shapeAction("plane", "half space (ground plane), inside below its distance along its normal",
                    {vector("normal", "0,1,0", "", "normal vector, which points outside"),
                     formerly({"height"}, real("distance", "0", "world units",
                                               "signed distance of the plane from the origin, along its normal")),
                     dimensions("a half plane")},
                    "curlew -plane -noise -noise seed=1 -bound side=outside -dfvn -velocity box=-1,-0.1,-1,1,1,1 "
                    "-write ground.vdb",
                    [](const Arguments& a) -> AnySdf {
                        if (isFlat(a)) return planeSdf<2>(inPlane(a.vector("normal")), a.real("distance"));
                        return planeSdf(a.vector("normal"), a.real("distance"));
                    }),
        shapeAction("gyroid", "sheet of a gyroid, as a lower bound of its signed distance (SDF)",
                    {positive("wavelength", "1", "world units", "period along each axis"),
                     positive("thickness", "0.2", "world units", "thickness of the sheet")},
                    "curlew -gyroid wavelength=1 thickness=0.3 -slice box=-1,-1,-1,1,1,1 -write gyroid.png",
                    [](const Arguments& a) -> AnySdf {
                        return sdfOf(shapes::Gyroid{a.real("wavelength"), a.real("thickness")});
                    }),
    };
}

} // namespace

Registry shapeActions() {
    Registry actions = primitives();
    for (Action& action : solidActions()) actions.push_back(std::move(action));
    return actions;
}

} // namespace curlew::app
