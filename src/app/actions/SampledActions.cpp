// SPDX-License-Identifier: Apache-2.0
#include "Actions.h"
#include "BetweenFrames.h"
#include "curlew/app/registry/Text.h"
#include "curlew/field/Algebra.h"
#include "curlew/picture/ImageField.h"
#include "curlew/vdb/GridField.h"
#include "curlew/vdb/HostConversion.h"
#include "curlew/vdb/Openvdb.h"
#include "curlew/vdb/ScalarGrids.h"

#include <openvdb/tools/GridOperators.h>

#include <algorithm>
#include <array>

namespace curlew::app {

namespace {

using namespace options;

constexpr std::array<std::string_view, 4> kVelocityChannels{"x", "y", "z", "speed"};

/// Returns the grid, or the channel of a velocity grid.
openvdb::GridBase::ConstPtr scalarsOf(const openvdb::GridBase::ConstPtr& grid, const Arguments& a) {
    openvdb::Vec3SGrid::ConstPtr vectors = vectorsOf(grid);
    if (!vectors) return grid;
    const std::string channel = a.given("channel") ? a.text("channel") : "";
    const auto found = std::find(kVelocityChannels.begin(), kVelocityChannels.end(), channel);
    if (found == kVelocityChannels.end())
        throw ValueError(fmt::format("a grid of {} is a field by one of its channels: give channel=speed, x, y or z",
                                     grid->valueType()));
    if (vectors->getGridClass() == openvdb::GRID_STAGGERED) vectors = collocated(*vectors);
    if (channel == "speed") return openvdb::tools::magnitude(*vectors);
    return componentOf(*vectors, static_cast<int>(found - kVelocityChannels.begin()), channel);
}

ScalarField fieldOfGrid(const Context& c, const openvdb::GridBase& grid) {
    ScalarField field = gridField(grid, c.follow("field"));
    c.info(fmt::format("field: grid '{}', {} active voxels of {:.6g}, background {}", grid.getName(),
                       grid.activeVoxelCount(), grid.voxelSize()[0],
                       grid.isType<openvdb::FloatGrid>()
                           ? fmt::format("{:.4g}", static_cast<const openvdb::FloatGrid&>(grid).background())
                           : "its background"));
    return field;
}

ScalarField blendFields(const ScalarField& a, const ScalarField& b, double part) { return (1 - part) * a + part * b; }

void fieldFromSamples(Context& c, const Arguments& a) {
    if (c.kind("source") == Kind::image) {
        const auto wrap = a.choice<ImageWrap>("wrap");
        c.give(FieldValue{imageField(c.image("source").image, a.text("channel"), wrap)});
        return;
    }
    if (a.given("wrap")) throw ValueError("wrap= is for pictures, but the newest input is a grid");
    if (c.kind("source") != Kind::velocity && a.given("channel"))
        throw ValueError("channel= is for pictures and velocity grids, but the newest input is another grid");
    const auto make = [&](const Grids& grids) { return fieldOfGrid(c, *scalarsOf(grids.front(), a)); };
    FieldValue value{blendedInTime(c, "source", make, blendFields)};
    value.sampled = sampledRegionOf(*c.grid("source").grid);
    c.give(std::move(value));
}

/// Returns the region to bake: box=, or that of a shape or grid.
Box bakedRegion(const Context& c, const Arguments& a) {
    if (a.given("box")) return a.box("box");
    const FieldValue& field = c.field("field");
    if (field.sampled) return field.sampled->box;
    if (const auto region = regionOfSurface(field, 0)) return *region;
    throw ValueError("give box=, since a field has no box of its own");
}

void bake(Context& c, const Arguments& a) {
    const BakeOptions options{
        .box = bakedRegion(c, a), .voxel = a.given("voxel") ? a.real("voxel") : 0, .dim = a.integer<int>("dim")};
    const auto grid = bakedGrid(inSpace(c.field("field").field), options, a.text("name"), c.follow("bake"));
    grid->setSaveFloatAsHalf(a.flag("half"));
    grid->setCreator("Curlew");
    c.info(fmt::format("bake: {} voxels of {:.6g}", grid->activeVoxelCount(), grid->voxelSize()[0]));
    c.give(GridValue{grid});
}

} // namespace

Registry sampledActions() {
    return {
        {.name = "field",
         .group = "fields",
         .summary = "field from samples: the newest scalar grid (3D) or picture (2D), as a smooth (C²) spline",
         .details = "The longer edge of a picture reaches from -1 to 1; place it with -transform. In a sequence of "
                    "grids, one for each frame, "
                    "the field changes linearly from frame to frame.",
         .takes = {taken("source", {Kind::grid, Kind::image})},
         .makes = {made("field", {Kind::field})},
         .options = {text("channel", "",
                          "picture: channel (default: the only one, or the luminance of R, G and B); velocity grid: x, "
                          "y, z or speed"),
                     choice("wrap", kImageWrapNames,
                            "picture: what lies beyond its edges: clamp repeats the pixels at the edge, repeat the "
                            "picture, mirror its mirror image"),
                     keep()},
         .examples = {"curlew -read smoke.vdb grids=density -field -noise -dfvn -velocity dim=64 box=-1,-1,-1,1,1,1 "
                      "-write around.vdb",
                      "curlew -read paint.png -field -noise frequency=3 -lift -slice -write painted.png"},
         .evaluation = Evaluation::anyTime,
         .run = fieldFromSamples,
         .makesWith =
             [](const Arguments&, const std::vector<std::vector<Object>>& inputs, const World&) {
                 const bool picture = !inputs.at(0).empty() && inputs[0].front().kind == Kind::image;
                 return std::vector<Object>{{.kind = Kind::noise, .dimension = picture ? 2 : 3, .name = "field"}};
             }},
        {.name = "bake",
         .group = "fields",
         .summary = "sample the newest field at the voxels of a box, as a scalar grid (OpenVDB)",
         .details =
             "Samples are at the centres of the voxels, so a box that is a period of the field gives a grid that "
             "tiles without a seam.",
         .takes = {stays("field", {Kind::field})},
         .makes = {made("grid", {Kind::grid})},
         .options = {integer("dim", std::to_string(BakeOptions{}.dim), 1, 1e6,
                             "number of voxels along the longest edge of the box"),
                     instead(positive("voxel", "", "world units", "voxel size (default: from dim=)"), {"dim"}),
                     box("box",
                         "region to sample, rounded to whole voxels (default: the box of a shape, padded, or of a "
                         "grid; required for other fields and for unbounded shapes)"),
                     text("name", "density", "name of the grid"), flag("half", "0", "1: store 16-bit floats")},
         .examples = {"curlew -noise frequency=4 period=4 -bake box=0,0,0,1,1,1 dim=64 -write tile.vdb"},
         .run = bake}};
}

} // namespace curlew::app
