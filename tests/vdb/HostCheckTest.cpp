// SPDX-License-Identifier: Apache-2.0
#include "curlew/vdb/HostCheck.h"
#include "curlew/vdb/HostConversion.h"
#include "curlew/vdb/Openvdb.h"
#include "curlew/vdb/PointFile.h"
#include "curlew/vdb/VdbFile.h"
#include "support/HostObjects.h"

using namespace curlew;
using namespace curlew::test;
using Catch::Matchers::ContainsSubstring;
using Folder = ScratchFolder;

namespace {

const HostProfile& host(std::string_view name) {
    return *std::find_if(kHostProfiles.begin(), kHostProfiles.end(), [&](const auto& h) { return h.name == name; });
}

openvdb::GridBase::ConstPtr density() {
    auto grid = openvdb::FloatGrid::create();
    grid->setName("density");
    grid->tree().setValue({0, 0, 0}, 1);
    grid->setGridClass(openvdb::GRID_FOG_VOLUME);
    return grid;
}

/// What a file with these grids lacks for a host, as one text.
std::string lacks(const std::vector<openvdb::GridBase::ConstPtr>& grids, std::string_view name,
                  const std::string& file = "smoke.vdb", const openvdb::MetaMap& metadata = {}) {
    const Folder folder;
    writeVdb(folder / file, grids, metadata);
    std::string all;
    for (const std::string& problem : hostProblems(folder / file, host(name))) all += problem + "\n";
    return all;
}

} // namespace

TEST_CASE("HostCheck: files written for a host lack nothing", "[vdb]") {
    for (const HostProfile& profile : kHostProfiles) {
        if (!profile.readsVdb) continue;
        CAPTURE(profile.name);
        auto faces = rampGrid();
        faces->setGridClass(openvdb::GRID_STAGGERED);
        auto grids = forHost(faces, {.host = &profile});
        grids.push_back(density());
        CHECK(lacks(grids, profile.name) == "");
        if (profile.componentSuffix.empty()) continue;
        auto parts = forHost(rampGrid(), {.host = &profile, .split = true});
        CHECK(lacks(parts, profile.name) == "");
    }
}

TEST_CASE("HostCheck: names what is missing", "[vdb]") {
    auto staggered = rampGrid("velocity");
    staggered->setGridClass(openvdb::GRID_STAGGERED);
    CHECK_THAT(lacks({staggered}, "blender"), ContainsSubstring("'velocity' is staggered"));
    CHECK_THAT(lacks({density()}, "redshift"), ContainsSubstring("no velocity grid 'velocity'"));
    CHECK_THAT(lacks({rampGrid("wind")}, "houdini"), ContainsSubstring("its vector grids are 'wind'"));
    CHECK(lacks({rampGrid("v")}, "houdini") == "");
    CHECK_THAT(lacks({rampGrid(), density()}, "renderman"), ContainsSubstring("fog volume"));
    CHECK_THAT(lacks({rampGrid()}, "arnold"), ContainsSubstring("no density beside 'vel'"));
    auto invariant = rampGrid();
    invariant->setVectorType(openvdb::VEC_INVARIANT);
    CHECK_THAT(lacks({invariant}, "houdini"), ContainsSubstring("contravariant relative"));
    auto doubles = openvdb::Vec3DGrid::create();
    doubles->setName("vel");
    CHECK_THAT(lacks({doubles}, "houdini"), ContainsSubstring("of type vec3d"));
    CHECK_THAT(lacks({rampGrid(), pointGrid(particlesWithEverything(3))}, "blender"),
               ContainsSubstring("points 'points'"));
    CHECK_THAT(lacks({rampGrid()}, "unity"), ContainsSubstring("does not read .vdb"));
    CHECK_THAT(lacks({rampGrid()}, "houdini", "smoke.0001.vdb"), ContainsSubstring("no frame rate"));
    openvdb::MetaMap rate;
    rate.insertMeta("fps", openvdb::DoubleMetadata(24));
    CHECK(lacks({rampGrid()}, "houdini", "smoke.0001.vdb", rate) == "");
}

TEST_CASE("HostCheck: a damaged file is refused", "[vdb]") {
    const Folder folder;
    writeVdb(folder / "a.vdb", {rampGrid()});
    const std::string bytes = bytesOf(folder / "a.vdb");
    store(folder / "b.vdb", bytes.substr(0, 100));
    CHECK_THROWS_AS(hostProblems(folder / "b.vdb", host("houdini")), FileError);
    CHECK_THROWS_AS(hostProblems(folder / "none.vdb", host("houdini")), FileError);
}
