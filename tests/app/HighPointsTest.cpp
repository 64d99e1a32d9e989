// SPDX-License-Identifier: Apache-2.0
#include "support/ProbeCommand.h"

using namespace curlew;
using namespace curlew::test;
using Catch::Matchers::ContainsSubstring;

namespace {

/// A flow of N - 1 noises of N dimensions.
std::string flowIn(int n) {
    std::string flow;
    for (int k = 0; k + 1 < n; ++k) flow += fmt::format("-noise type=sine dimensions={} seed={} ", n, k + 1);
    return flow + "-dfvn speed=1 ";
}

} // namespace

TEST_CASE("points in 4 to 7 dimensions: jitter, spacing and .csv", "[app][command]") {
    const Folder folder;
    for (const int n : {4, 5, 7}) {
        CAPTURE(n);
        const auto run = folder.mustRun(
            fmt::format("-jitter dimensions={} spacing=0.5 box=0,0,0,2,1,1 seed=3 -spacing -print -write a.csv -report "
                        "report.json",
                        n));
        const Table table = tableOf(folder / "a.csv");
        CHECK(table.header == std::string("x0,x1,x2,x3,x4,x5,x6").substr(0, static_cast<size_t>(3 * n - 1)));
        // Axes beyond z have the range of x: 4 cells, and 2 along y and z.
        size_t expected = 16;
        for (int axis = 3; axis < n; ++axis) expected *= 4;
        CHECK(table.rows.size() == expected);
        CHECK_THAT(run.out, ContainsSubstring(fmt::format("points of {} dimensions", n)));
        const auto spacing = jsonOf(folder / "report.json")["spacing"];
        CHECK(spacing["median"].get<double>() == Approx(0.41).epsilon(0.1)); // 0.82 spacings
        folder.mustRun("-read a.csv -write b.csv");
        CHECK(bytesOf(folder / "b.csv") == bytesOf(folder / "a.csv"));
    }
    folder.mustRun("-jitter dimensions=4 count=100 method=random -spacing");
}

TEST_CASE("points in 4 dimensions: stay on their tracks when they are advected", "[app][command]") {
    const Folder folder;
    folder.mustRun(flowIn(4) + "-scatter count=200 seed=5 -write start.csv -advect duration=0.5 -write end.csv");
    for (const char* which : {"start", "end"})
        folder.mustRun(flowIn(4) + fmt::format("-probe {0}.csv {0}_values.csv", which));
    const Table start = tableOf(folder / "start_values.csv"), end = tableOf(folder / "end_values.csv");
    REQUIRE(start.rows.size() == 200);
    REQUIRE(start.rows[0].size() == 4 + 4 + 3); // positions, velocities, potentials
    double moved = 0;
    for (size_t k = 0; k < start.rows.size(); ++k) {
        for (size_t potential = 8; potential < 11; ++potential)
            CHECK(end.rows[k][potential] == Approx(start.rows[k][potential]).margin(1e-6));
        for (size_t axis = 0; axis < 4; ++axis) moved += std::abs(end.rows[k][axis] - start.rows[k][axis]) / 200;
    }
    CHECK(moved > 0.1);
    // With onLevelSets, too.
    std::string flow = flowIn(4);
    folder.mustRun(flow.replace(flow.find("speed"), 0, "onLevelSets=1 ") +
                   "-scatter count=20 -advect duration=0.1 -check report=check.json");
    CHECK(jsonOf(folder / "check.json")["preserves_area"] == true);
    CHECK(jsonOf(folder / "check.json")["divergence_analytic"].get<double>() < 1e-6);
}

TEST_CASE("points in more than 3 dimensions: actions that need 3D points refuse them", "[app][command]") {
    const Folder folder;
    const std::string points = "-scatter dimensions=5 count=10 box=0,0,0,1,1,1 ";
    folder.mustFail(points + "-splat", {"3D", "5 dimensions"});
    folder.mustFail(points + "-write a.ply", {".csv"});
    folder.mustFail("-noise -noise seed=1 -dfvn " + points + "-advect", {"5 dimensions", "3"});
    folder.mustFail(flowIn(4) + points + "-advect", {"5 dimensions", "4"});
    folder.mustFail(flowIn(4) + "-scatter count=10 on=surface", {"on=", "4 dimensions"});
    folder.mustFail(flowIn(4) + "-scatter count=10 -advect pathlines=1", {"pathlines=", "4 dimensions"});
    folder.mustFail(flowIn(4) + "-scatter count=10 -frames 1-2 -advect", {"frame to frame"});
    folder.mustFail(flowIn(4) + "-scatter dimensions=5 count=10", {"5 dimensions", "4"});
    folder.mustFail("-sphere -jitter dimensions=4 count=10", {"4 dimensions", "flow or a box"});
    CHECK(!std::filesystem::exists(folder / "a.ply"));
}
