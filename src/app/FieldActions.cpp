#include "Options.h"
#include "curlew/app/Registry.h"
#include "curlew/app/Session.h"
#include "curlew/field/Algebra.h"
#include "curlew/field/NoiseField.h"

namespace curlew::app {

namespace {

using namespace options;

const std::string kGroup = "fields";

std::vector<Option> placementOptions() {
    return {vector("offset", "0,0,0", "world units", "where its origin goes"),
            vector("rotate", "0,0,0", "degrees", "turn about x, then y, then z"),
            positive("scale", "1", "", "size, before it is turned and moved")};
}

Placement placementOf(const Arguments& a) {
    const double scale = a.real("scale");
    return {.offset = a.vector("offset"), .rotate = a.vector("rotate"), .scale = {{scale, scale, scale}}};
}

Action shapeAction(std::string name, std::string summary, std::vector<Option> shape, std::string example,
                   Sdf (*make)(const Arguments&)) {
    for (auto& option : placementOptions()) shape.push_back(option);
    return {.name = std::move(name),
            .group = kGroup,
            .summary = std::move(summary),
            .outputs = "field (signed distance)",
            .options = std::move(shape),
            .examples = {std::move(example)},
            .run = [make](Session& s, const Arguments& a) {
                const Sdf sdf = placed(make(a), placementOf(a));
                s.fields.push({sdf.distance, a.program(), sdf, {}}, s.now());
            }};
}

std::vector<Action> shapeActions() {
    return {
        shapeAction("sphere", "a sphere as an exact signed distance",
                    {positive("radius", "1", "world units", "radius")},
                    "curlew -sphere radius=0.5 -noise -noise seed=1 -bound -dfvn -velocity -write ball.vdb",
                    [](const Arguments& a) { return sphereSdf(a.real("radius")); }),
        shapeAction(
            "box", "a rounded box as an exact signed distance",
            {vector("size", "2,2,2", "world units", "edge lengths"),
             notNegative("rounding", "0.2", "world units", "radius of its edges; keep a wall's width below it")},
            "curlew -box size=2,1,1 rounding=0.2 -noise -noise seed=1 -bound width=0.15 -dfvn -velocity -write box.vdb",
            [](const Arguments& a) { return boxSdf(a.vector("size"), a.real("rounding")); }),
        shapeAction("torus", "a torus about the y axis as an exact signed distance",
                    {positive("radius", "0.7", "world units", "from the centre to the middle of the tube"),
                     positive("tube", "0.3", "world units", "radius of the tube")},
                    "curlew -torus radius=1 tube=0.4 rotate=90,0,0 -slice -write torus.png",
                    [](const Arguments& a) { return torusSdf(a.real("radius"), a.real("tube")); }),
        shapeAction("capsule", "a capsule along y as an exact signed distance",
                    {positive("length", "1", "world units", "of the cylinder between the hemispheres"),
                     positive("radius", "0.5", "world units", "radius")},
                    "curlew -capsule length=2 radius=0.5 -noise -noise seed=1 -bound -dfvn -velocity -write pill.vdb",
                    [](const Arguments& a) { return capsuleSdf(a.real("length"), a.real("radius")); }),
        shapeAction("plane", "a half space, inside below the height along its normal",
                    {vector("normal", "0,1,0", "", "points outside"),
                     real("height", "0", "world units", "of the plane along its normal")},
                    "curlew -plane -noise -noise seed=1 -bound side=outside -dfvn -velocity box=-1,-0.1,-1,1,1,1 "
                    "-write ground.vdb",
                    [](const Arguments& a) { return planeSdf(a.vector("normal"), a.real("height")); }),
        shapeAction("gyroid", "a sheet of a gyroid as a signed distance (a lower bound on it)",
                    {positive("wavelength", "1", "world units", "period along each axis"),
                     positive("thickness", "0.2", "world units", "of the sheet")},
                    "curlew -gyroid wavelength=1 thickness=0.3 -slice box=-1,-1,-1,1,1,1 -write gyroid.png",
                    [](const Arguments& a) { return gyroidSdf(a.real("wavelength"), a.real("thickness")); }),
    };
}

ScalarField makeNoise(const Arguments& a) {
    PsrdOptions noise{.alpha = a.real("alpha"), .seed = static_cast<uint64_t>(a.integer("seed"))};
    const Vec3d period = a.vector("period");
    for (int axis = 0; axis < 3; ++axis) {
        if (period[axis] != std::floor(period[axis]) || std::abs(period[axis]) > 1e6)
            throw ValueError(fmt::format("period={} must be whole numbers of cells, 0 for none", period[axis]));
        noise.period[axis] = static_cast<int>(period[axis]);
    }
    const OctaveOptions octaves{.frequency = a.real("frequency"),
                                .octaves = static_cast<int>(a.integer("octaves")),
                                .lacunarity = a.real("lacunarity"),
                                .gain = a.real("gain"),
                                .amplitude = a.real("amplitude"),
                                .normalize = a.flag("normalize")};
    return placed(psrdField(noise, octaves), {.offset = a.vector("offset"), .rotate = a.vector("rotate")});
}

/// Takes the two newest fields and pushes what `combine` makes of them.
void combineFields(Session& s, const Arguments& a, ScalarField (*combine)(const ScalarField&, const ScalarField&)) {
    if (s.fields.size() < 2) throw ValueError("needs two fields; make them with -noise, -ramp, -constant or a shape");
    const FieldObject second = s.fields.at(0), first = s.fields.at(1);
    if (!a.flag("keep")) {
        s.fields.take();
        s.fields.take();
    }
    s.fields.push({combine(first.field, second.field),
                   fmt::format("{} of ({}) and ({})", a.program(), first.program, second.program),
                   {},
                   {}},
                  s.now());
}

void transform(Session& s, const Arguments& a) {
    const FieldObject old = a.flag("keep") ? s.fields.at() : s.fields.take();
    const Placement placement{.offset = a.vector("offset"), .rotate = a.vector("rotate"), .scale = a.vector("scale")};
    FieldObject moved{placed(old.field, placement), fmt::format("{} of ({})", a.program(), old.program), {}, {}};
    // A distance stays one if all axes are scaled alike.
    const Vec3d& scale = placement.scale;
    if (old.sdf && scale[0] > 0 && scale[0] == scale[1] && scale[0] == scale[2]) {
        moved.sdf = placed(*old.sdf, placement);
        moved.field = moved.sdf->distance;
    }
    s.fields.push(std::move(moved), s.now());
}

std::vector<Option> noiseOptions() {
    return {
        choice("type", {"psrd"}, "psrd: tiling simplex noise with rotating gradients (Gustavson and McEwan 2021)"),
        choice("dim", {"3"}, "its dimensions"),
        positive("frequency", "1", "1 / world unit", "cells per world unit of the first octave"),
        integer("octaves", "1", 1, 32, "copies at rising frequency that are summed"),
        positive("lacunarity", "2", "", "each octave's frequency over the one before"),
        real("gain", "0.5", "", "each octave's amplitude over the one before"),
        integer("seed", "0", 0, 0x1p53 - 1,
                "0 is the published function; others are independent of it and of each other"),
        vector("offset", "0,0,0", "world units", "where the origin of the noise goes"),
        vector("rotate", "0,0,0", "degrees", "turn about x, then y, then z"),
        vector("period", "0,0,0", "cells", "tile after so many cells of the first octave along each axis; 0: never"),
        real("alpha", "0", "radians", "rotation of the gradients (flow noise); a full turn is 6.2832"),
        real("amplitude", "1", "", "factor on the whole"),
        flag("normalize", "1", "divide by the sum of the octaves' amplitudes")};
}

} // namespace

std::vector<Action> fieldActions() {
    std::vector<Action> actions = shapeActions();
    actions.push_back(
        {.name = "noise",
         .group = kGroup,
         .summary = "a noise with exact derivatives",
         .outputs = "field",
         .options = noiseOptions(),
         .examples = {"curlew -noise frequency=2 octaves=3 seed=7 -slice box=-2,-2,-2,2,2,2 -write noise.png"},
         .run = [](Session& s, const Arguments& a) {
             s.fields.push({makeNoise(a), a.program(), {}, {}}, s.now());
         }});
    actions.push_back(
        {.name = "ramp",
         .group = kGroup,
         .summary = "a linear ramp, direction·x + offset",
         .outputs = "field",
         .options = {vector("direction", "0,1,0", "1 / world unit", "its gradient"),
                     real("offset", "0", "", "its value at the origin")},
         .examples = {"curlew -noise -ramp direction=0,0,1 -dfvn -velocity -write sheets.vdb"},
         .run = [](Session& s, const Arguments& a) {
             s.fields.push({rampField(a.vector("direction"), a.real("offset")), a.program(), {}, {}}, s.now());
         }});
    actions.push_back({.name = "constant",
                       .group = kGroup,
                       .summary = "the same value everywhere",
                       .outputs = "field",
                       .options = {real("value", "1", "", "the value")},
                       .examples = {"curlew -noise -constant value=0.5 -sum -probe in.csv out.csv"},
                       .run = [](Session& s, const Arguments& a) {
                           s.fields.push({constantField(a.real("value")), a.program(), {}, {}}, s.now());
                       }});
    actions.push_back(
        {.name = "sum",
         .group = kGroup,
         .summary = "the sum of two fields",
         .inputs = "2 fields",
         .outputs = "field",
         .options = {keep()},
         .examples = {"curlew -noise -ramp direction=0,2,0 -sum -noise seed=1 -dfvn -velocity -write drift.vdb"},
         .run = [](Session& s, const Arguments& a) {
             combineFields(s, a, [](const ScalarField& p, const ScalarField& q) { return p + q; });
         }});
    actions.push_back({.name = "product",
                       .group = kGroup,
                       .summary = "the product of two fields",
                       .inputs = "2 fields",
                       .outputs = "field",
                       .options = {keep()},
                       .examples = {"curlew -noise -constant value=3 -product -probe in.csv out.csv"},
                       .run = [](Session& s, const Arguments& a) {
                           combineFields(s, a, [](const ScalarField& p, const ScalarField& q) { return p * q; });
                       }});
    actions.push_back(
        {.name = "transform",
         .group = kGroup,
         .summary = "scale, turn and move the newest field",
         .inputs = "field",
         .outputs = "field",
         .options = {vector("offset", "0,0,0", "world units", "where its origin goes"),
                     vector("rotate", "0,0,0", "degrees", "turn about x, then y, then z"),
                     vector("scale", "1,1,1", "", "size along each axis, first"), keep()},
         .examples =
             {"curlew -noise -transform scale=1,4,1 rotate=0,0,30 -slice box=-2,-2,-2,2,2,2 -write stretched.png"},
         .run = transform});
    return actions;
}

} // namespace curlew::app
