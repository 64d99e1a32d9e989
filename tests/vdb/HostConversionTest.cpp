// SPDX-License-Identifier: Apache-2.0
#include "curlew/field/NoiseField.h"
#include "curlew/vdb/HostConversion.h"
#include "curlew/vdb/VelocityGrid.h"
#include "support/HostObjects.h"

#include <openvdb/tools/LevelSetSphere.h>

#include <cmath>

using namespace curlew;
using namespace curlew::test;
using Catch::Matchers::ContainsSubstring;

namespace {

const HostProfile& host(std::string_view name) {
    return *std::find_if(kHostProfiles.begin(), kHostProfiles.end(), [&](const auto& h) { return h.name == name; });
}

openvdb::Vec3d mapped(std::string_view name, UpAxis up) { return axesFor(host(name), up)(openvdb::Vec3d(1, 2, 3)); }

} // namespace

TEST_CASE("HostConversion: axes match the importers of the hosts", "[vdb]") {
    using V = openvdb::Vec3d;
    CHECK(mapped("houdini", UpAxis::y) == V(1, 2, 3));
    CHECK(mapped("houdini", UpAxis::z) == V(1, 3, -2));
    CHECK(mapped("blender", UpAxis::y) == V(1, -3, 2));
    CHECK(mapped("blender", UpAxis::z) == V(1, 2, 3)); // there and back again
    CHECK(mapped("unreal", UpAxis::y) == V(100, 300, 200));
    CHECK(mapped("unreal", UpAxis::z) == V(100, -200, 300));
    CHECK(mapped("unity", UpAxis::y) == V(-1, 2, 3));
    // What points up in the scene points up in every host; only the left-handed ones mirror.
    for (const HostProfile& profile : kHostProfiles)
        for (const UpAxis up : {UpAxis::y, UpAxis::z}) {
            CAPTURE(profile.name);
            const AxisMap axes = axesFor(profile, up);
            const bool zUp = profile.axes == HostAxes::zUp || profile.axes == HostAxes::zUpLeftHanded;
            const V above = axes(up == UpAxis::y ? V(0, 1, 0) : V(0, 0, 1));
            CHECK(above == profile.unitsPerMetre * (zUp ? V(0, 0, 1) : V(0, 1, 0)));
            const double handed = axes(V(1, 0, 0)).cross(axes(V(0, 1, 0))).dot(axes(V(0, 0, 1)));
            const bool left = profile.axes == HostAxes::zUpLeftHanded || profile.axes == HostAxes::yUpLeftHanded;
            CHECK((handed < 0) == left);
        }
}

TEST_CASE("HostConversion: points turn with their velocities and can have them per frame", "[vdb]") {
    const Points p = forHost(particlesWithEverything(3), {.host = &host("blender"), .velocityScale = 0.25});
    CHECK(p.position(2) == Vec3d{{2, 2, 1}});
    CHECK((p.vx[2] == 0.25f && p.vy[2] == 0.5f && p.vz[2] == 0.5f));
    const Curves c = forHost(curvesOfSizes({3}), {.host = &host("unreal")});
    CHECK(c.along[2] == 50);
    CHECK(c.position(2) == Vec3d{{200, -200, 0}});
}

TEST_CASE("HostConversion: rotated axes rotate positions and velocities of a grid", "[vdb]") {
    const auto ramp = rampGrid();
    for (const HostProfile& profile : kHostProfiles) {
        CAPTURE(profile.name);
        const auto made = forHost(ramp, {.host = &profile});
        REQUIRE(made.size() == 1);
        const auto grid = openvdb::GridBase::grid<openvdb::Vec3SGrid>(made.front());
        CHECK(grid->getName() == profile.gridVelocity);
        CHECK((grid->getGridClass() == openvdb::GRID_FOG_VOLUME) == profile.fogVectors);
        CHECK(grid->activeVoxelCount() == 60);
        const AxisMap axes = axesFor(profile, UpAxis::y);
        const openvdb::Coord ijk(1, 4, 9);
        const openvdb::Vec3d there = axes(ramp->indexToWorld(ijk));
        const auto index = grid->worldToIndex(there);
        CHECK(grid->tree().getValue(openvdb::Coord::round(index)) == axes(ramp->tree().getValue(ijk)));
        CHECK((index - openvdb::Coord::round(index).asVec3d()).length() < 1e-9);
    }
    CHECK(ramp->getName() == "vel"); // the given grid is not changed
    CHECK(ramp->tree().getValue({1, 4, 9}) == openvdb::Vec3s(1, 4, 90));
}

TEST_CASE("HostConversion: staggered velocities of a linear field are exact at voxel centres", "[vdb]") {
    const auto faces = rampGrid();
    faces->setGridClass(openvdb::GRID_STAGGERED);
    // Component k lies half a voxel below the centre, so the value at the centre is half a step further.
    const auto centres = collocated(*faces);
    CHECK(centres->getGridClass() == openvdb::GRID_UNKNOWN);
    CHECK(centres->tree().getValue({0, 3, 8}) == openvdb::Vec3s(0.5f, 3.5f, 85));
    CHECK_FALSE(centres->tree().isValueOn({-2, 3, 8}));
    CHECK(forHost(faces, {.host = &host("houdini")}).front()->getGridClass() == openvdb::GRID_STAGGERED);
    CHECK(forHost(faces, {.host = &host("arnold")}).front()->getGridClass() == openvdb::GRID_UNKNOWN);
}

TEST_CASE("HostConversion: staggered velocities at voxel centres are those of the box and end at the wall", "[vdb]") {
    const auto flowIn = [](const Domain& domain) {
        const ScalarField f = noiseField<Psrd3>({.seed = 1}, {}), g = noiseField<Psrd3>({.seed = 2}, {});
        return Flow(f, domain.wall ? bounded(g, *domain.wall) : g, domain);
    };
    const Domain box{.box = Box{}.padded(0.5), .wall = {}}; // centres of voxels are on its sides
    const Domain inBall = Domain::of({.sdf = sphereSdf(0.8), .side = Side::inside, .width = 0.2});
    for (const Domain& domain : {box, inBall}) {
        const Flow flow = flowIn(domain);
        const auto centres = collocated(*velocityGrid(flow, {.voxel = 0.05, .layout = Layout::staggered}));
        const auto expected = velocityGrid(flow, {.voxel = 0.05});
        const bool walled = domain.wall.has_value();
        if (!walled) CHECK(centres->evalActiveVoxelBoundingBox() == expected->evalActiveVoxelBoundingBox());
        double off = 0, all = 0, offInLast = 0, allInLast = 0;
        for (auto value = expected->cbeginValueOn(); value; ++value) {
            const openvdb::Coord ijk = value.getCoord();
            if (walled && length(Vec3d{{ijk[0] * 0.05, ijk[1] * 0.05, ijk[2] * 0.05}}) > 0.8) continue;
            REQUIRE(centres->tree().isValueOn(ijk));
            const auto error = static_cast<double>((centres->tree().getValue(ijk) - *value).lengthSqr());
            const auto square = static_cast<double>(value->lengthSqr());
            off += error, all += square;
            if (ijk[0] == 10) offInLast += error, allInLast += square;
        }
        CHECK(std::sqrt(off / all) < 0.1);                          // second order: 0.08 with 20 voxels per wavelength
        if (!walled) CHECK(std::sqrt(offInLast / allInLast) < 0.1); // about 0.3 with half of the normal velocity
    }
}

TEST_CASE("HostConversion: splits vectors into the components that a host looks for", "[vdb]") {
    const auto parts = forHost(rampGrid(), {.host = &host("redshift"), .split = true});
    REQUIRE(parts.size() == 3);
    CHECK(parts[1]->getName() == "velocity.y");
    const auto z = openvdb::GridBase::grid<openvdb::FloatGrid>(parts[2]);
    CHECK(z->tree().getValue({1, 4, 9}) == 90);
    CHECK(z->activeVoxelCount() == 60);
    CHECK_THAT(messageOf([] { forHost(rampGrid(), {.host = &host("karma"), .split = true}); }),
               ContainsSubstring("karma takes velocities as one vector grid"));
    CHECK(forHost(openvdb::FloatGrid::create(), {.host = &host("karma"), .split = true}).size() == 1);
}

TEST_CASE("HostConversion: distances of a level set scale with the unit and densities do not", "[vdb]") {
    const openvdb::GridBase::ConstPtr sphere =
        openvdb::tools::createLevelSetSphere<openvdb::FloatGrid>(1, openvdb::Vec3f(0), 0.1f);
    const auto made = openvdb::GridBase::grid<openvdb::FloatGrid>(forHost(sphere, {.host = &host("unreal")}).front());
    CHECK(made->background() == Approx(30));
    CHECK(made->voxelSize()[0] == Approx(10));
    auto density = openvdb::FloatGrid::create();
    density->tree().setValue({0, 0, 0}, 0.5f);
    const auto kept = openvdb::GridBase::grid<openvdb::FloatGrid>(forHost(density, {.host = &host("unreal")}).front());
    CHECK(kept->tree().getValue({0, 0, 0}) == 0.5f);
    CHECK(forHost(sphere, {}).front() == sphere); // nothing to do, nothing copied
}

TEST_CASE("HostConversion: colours, which are invariant, stay, unless their name is that of a velocity", "[vdb]") {
    for (const bool velocity : {false, true}) {
        const auto grid = rampGrid(velocity ? "vel" : "Cd");
        grid->setVectorType(openvdb::VEC_INVARIANT);
        const auto made = forHost(grid, {.host = &host("unreal")});
        const auto vectors = openvdb::GridBase::grid<openvdb::Vec3SGrid>(made.front());
        CHECK(followsSpace(*grid) == velocity);
        CHECK(vectors->tree().getValue({1, 4, 9}) ==
              (velocity ? openvdb::Vec3s(100, 9000, 400) : openvdb::Vec3s(1, 4, 90)));
        CHECK(vectors->voxelSize()[0] == Approx(50));
    }
}

TEST_CASE("HostConversion: vectors and distances of doubles are converted as those of floats are", "[vdb]") {
    const auto ramp = rampGrid();
    const auto doubles = openvdb::Vec3DGrid::create();
    doubles->insertMeta(*ramp);
    doubles->setTransform(ramp->transform().copy());
    for (auto value = ramp->cbeginValueOn(); value; ++value)
        doubles->tree().setValueOn(value.getCoord(), openvdb::Vec3d(*value));
    const openvdb::GridBase::ConstPtr given = doubles;
    for (const char* name : {"unreal", "blender"}) {
        const auto a = openvdb::GridBase::grid<openvdb::Vec3SGrid>(forHost(ramp, {.host = &host(name)}).front());
        const auto b = openvdb::GridBase::grid<openvdb::Vec3SGrid>(forHost(given, {.host = &host(name)}).front());
        REQUIRE(b);
        CHECK(b->getName() == a->getName());
        CHECK(b->transform() == a->transform());
        for (auto value = a->cbeginValueOn(); value; ++value) REQUIRE(b->tree().getValue(value.getCoord()) == *value);
    }
    CHECK(forHost(given, {}).front() == given);
    const auto sphere = openvdb::tools::createLevelSetSphere<openvdb::FloatGrid>(1, openvdb::Vec3f(0), 0.1f);
    const auto precise = std::make_shared<openvdb::DoubleGrid>(*sphere);
    precise->setGridClass(openvdb::GRID_LEVEL_SET);
    const auto scaled =
        openvdb::GridBase::grid<openvdb::DoubleGrid>(forHost(precise, {.host = &host("unreal")}).front());
    CHECK(scaled->background() == 100 * precise->background());
    CHECK(scaled->tree().getValue({10, 0, 0}) == 100 * precise->tree().getValue({10, 0, 0}));
}

TEST_CASE("HostConversion: staggered velocities in tiles are averaged as those in voxels", "[vdb]") {
    const auto tiles = openvdb::Vec3SGrid::create();
    tiles->setGridClass(openvdb::GRID_STAGGERED);
    tiles->fill(openvdb::CoordBBox({0, 0, 0}, {23, 15, 15}), openvdb::Vec3s(2, 4, 6));
    REQUIRE(tiles->tree().activeTileCount() > 0);
    const auto voxels = tiles->deepCopy();
    voxels->tree().voxelizeActiveTiles();
    const auto a = collocated(*tiles), b = collocated(*voxels);
    CHECK(a->activeVoxelCount() == b->activeVoxelCount());
    for (auto value = b->cbeginValueOn(); value; ++value) REQUIRE(a->tree().getValue(value.getCoord()) == *value);
    CHECK(a->tree().getValue({23, 3, 3}) == openvdb::Vec3s(2, 4, 6)); // has no upper face along x
    CHECK_FALSE(a->tree().isValueOn({-1, 3, 3}));
    CHECK(a->tree().activeTileCount() > 0); // the middle is still constant
}
