// SPDX-License-Identifier: Apache-2.0
#include "support/ProbeCommand.h"

using namespace curlew;
using namespace curlew::test;
using Catch::Matchers::ContainsSubstring;

namespace {

std::vector<Vec3d> pointsOf(const Folder& folder, const std::string& actions) {
    folder.mustRun(actions + " -write a.csv");
    const Table table = tableOf(folder / "a.csv");
    REQUIRE(table.header == "x,y,z,id");
    std::vector<Vec3d> points;
    for (const auto& row : table.rows) points.push_back({{row[0], row[1], row[2]}});
    return points;
}

size_t beyond(const std::vector<Vec3d>& points) {
    return static_cast<size_t>(
        std::count_if(points.begin(), points.end(), [](const Vec3d& p) { return !(length(p) < 1); }));
}

} // namespace

TEST_CASE("jitter action: fills a shape and keeps to its wall", "[app]") {
    const Folder folder;
    const auto points = pointsOf(folder, "-sphere -jitter count=3000 seed=3");
    CHECK(static_cast<double>(points.size()) == Approx(3000).epsilon(0.05));
    CHECK(beyond(points) == 0);
    // Without conforming, and with random points, some points leave the shape.
    CHECK(beyond(pointsOf(folder, "-sphere -jitter count=3000 seed=3 conform=0")) > 5);
    CHECK(beyond(pointsOf(folder, "-sphere -jitter count=3000 seed=3 method=random")) > 5);
    // Outside a sphere, and outside the obstacle of a flow.
    const auto around = pointsOf(folder, "-sphere -noise -noise seed=1 -bound side=outside -dfvn -jitter count=3000");
    CHECK(beyond(around) == around.size());
    const auto outside = pointsOf(folder, "-sphere -jitter count=500 side=outside box=-2,-2,-2,2,2,2");
    CHECK(beyond(outside) == outside.size());
}

TEST_CASE("jitter action: moves lattice points in 3D and in a plane", "[app]") {
    const Folder folder;
    const std::string plane = "-jitter dimensions=2 spacing=0.25 box=0,0,-1,2,1,1 ";
    const auto lattice = pointsOf(folder, plane + "amount=0"), moved = pointsOf(folder, plane);
    REQUIRE(lattice.size() == 32);
    REQUIRE(moved.size() == 32);
    CHECK(lattice[0] == Vec3d{{0.125, 0.125, 0}});
    CHECK(lattice[31] == Vec3d{{1.875, 0.875, 0}});
    for (size_t k = 0; k < 32; ++k) {
        CHECK(moved[k][2] == 0);
        CHECK(moved[k] != lattice[k]);
        CHECK(length(moved[k] - lattice[k]) <
              0.25 * 1.2072 * 0.16 + 1e-6); // the amount, relative to the mean distance of 8 neighbours
    }
    CHECK(pointsOf(folder, plane + "seed=1") != moved);
    CHECK(pointsOf(folder, plane + "time=0") != pointsOf(folder, plane + "time=0.1"));
    CHECK(pointsOf(folder, plane + "displacement=noise") != moved);
    CHECK(pointsOf(folder, "-jitter spacing=0.5").size() == 64);
    // For a flow in 2D, the points are in 2D by default.
    const auto flat = pointsOf(folder, "-noise dimensions=2 -dfvn -jitter spacing=0.25");
    CHECK(flat.size() == 64);
    CHECK(std::all_of(flat.begin(), flat.end(), [](const Vec3d& p) { return p[2] == 0; }));
    // A section through a ball.
    const auto disc = pointsOf(folder, "-sphere -jitter dimensions=2 count=1000");
    CHECK(static_cast<double>(disc.size()) == Approx(1000).epsilon(0.05));
    CHECK(beyond(disc) == 0);
}

TEST_CASE("jitter action: invalid options are refused", "[app][command]") {
    const Folder folder;
    folder.mustFail("-jitter count=10 spacing=1", {"-jitter", "count=", "spacing=", "one of them"});
    folder.mustFail("-jitter spacing=1e-9", {"-jitter", "memory", "spacing"});
    folder.mustFail("-jitter spacing=0", {"-jitter", "spacing"});
    folder.mustFail("-jitter dimensions=8", {"-jitter", "dim"});
    folder.mustFail("-plane -jitter side=outside box=0,-3,0,1,-2,1 spacing=0.1", {"-jitter", "in the domain"});
    const Outcome outcome = folder.mustRun("-sphere -jitter count=100 -write r.json");
    CHECK_THAT(outcome.err, ContainsSubstring("jitter:") && ContainsSubstring("none of which crosses the wall"));
    CHECK(jsonOf(folder / "r.json").at("jitter").at("conforms") == true);
}
