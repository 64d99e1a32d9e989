// SPDX-License-Identifier: Apache-2.0
#include "support/Command.h"
#include "support/Meshes.h"
#include "support/SessionCommand.h"

#include <openvdb/tools/LevelSetMeasure.h>

using namespace curlew;
using Catch::Matchers::ContainsSubstring;

namespace {

double volumeOf(const app::Value& value) {
    const auto grid = openvdb::GridBase::grid<openvdb::FloatGrid>(std::get<app::GridValue>(value).grid);
    return openvdb::tools::levelSetVolume(*grid);
}

} // namespace

TEST_CASE("solid actions: shapes stay shapes and other operands become level sets", "[app]") {
    const test::Folder folder;
    writeMesh(folder / "ball.ply", test::ball(4));
    const std::string ball =
        '"' + (folder / "ball.ply").string() + '"'; // the folder's name contains a quote and a space
    test::Scenes scenes;
    scenes.runAnew("sphere\nsphere translate=0.8,0,0\nunion");
    CHECK(test::countOf(scenes.session, app::Kind::shape) == 1);
    const double whole = 4.0 / 3 * M_PI;
    scenes.runAnew("read " + ball + "\nmesh2ls dim=50\nsphere radius=0.5\ndifference");
    CHECK(volumeOf(test::valueOf(scenes.session, app::Kind::levelSet)) == Approx(whole * 7 / 8).epsilon(0.01));
    scenes.runAnew("read " + ball + "\nmove translate=3,0,0 scale=0.5\nread " + ball + "\nunion dim=50");
    CHECK(volumeOf(test::valueOf(scenes.session, app::Kind::levelSet)) == Approx(whole * 9 / 8).epsilon(0.01));
    scenes.runAnew("read " + ball + "\nmesh2ls dim=50\nplane\nintersection");
    CHECK(volumeOf(test::valueOf(scenes.session, app::Kind::levelSet)) == Approx(whole / 2).epsilon(0.01));
    CHECK_THAT(scenes.complaint("read " + ball + "\nmesh2ls dim=50\nplane\nunion"), ContainsSubstring("unbounded"));
    CHECK_THAT(scenes.complaint("sphere\nunion"), ContainsSubstring("union"));
}

TEST_CASE("mesh2ls action: an open mesh that encloses nearly nothing gets a warning with its thickness",
          "[app][command]") {
    const test::Folder folder;
    // A plate of 0.04 without one of its narrow sides.
    test::store(folder / "plate.obj",
                "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 .04\nv 1 0 .04\nv 1 1 .04\nv 0 1 .04\n"
                "f 4 3 2 1\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\n");
    const std::string thin = "voxels thick on average";
    CHECK_THAT(folder.mustRun("-read plate.obj -mesh2ls dim=32").err, ContainsSubstring("only 0.8 " + thin));
    CHECK_THAT(folder.mustRun("-read plate.obj -mesh2ls dim=128").err, !ContainsSubstring(thin));
}

TEST_CASE("bound action: several walls act as their union", "[app]") {
    const test::Folder folder;
    writeMesh(folder / "ball.ply", test::ball(4));
    const std::string ball =
        '"' + (folder / "ball.ply").string() + '"'; // the folder's name contains a quote and a space
    test::Scenes scenes;
    const std::string noises = "noise frequency=2\nnoise frequency=2 seed=1\n";
    scenes.runAnew("read " + ball + "\nmesh2ls dim=40\nsphere translate=4,0,0\n" + noises +
                   "bound grid=0,1 side=outside layer=0.2\ndfvn\n");
    const Flow flow = std::get<Flow>(std::get<app::AnyFlow>(test::valueOf(scenes.session, app::Kind::flow)));
    // The normal velocity at either wall is nearly zero.
    for (const double x : {0.0, 4.0})
        for (uint64_t k = 0; k < 50; ++k) {
            Vec3d normal = test::randomPoint(test::cube(1), 3, k);
            normal = normal * (1 / length(normal));
            const Vec3d v = flow.at(Vec3d{{x, 0, 0}} + normal).velocity;
            CHECK(std::abs(dot(v, normal)) < 0.05 * (length(v) + 0.1));
        }
    scenes.runAnew(
        "sphere dimensions=2\nsphere dimensions=2 translate=3,0,0\nnoise dimensions=2 frequency=2\nbound grid=0,1 "
        "layer=0.2\n");
    CHECK_THAT(scenes.complaint("sphere\n" + noises + "bound grid=0,1"), ContainsSubstring("age 1"));
}
