// SPDX-License-Identifier: Apache-2.0
#include "support/Command.h"

#include <fmt/format.h>

using namespace curlew::test;

namespace {

/// A flow in a ball and points in it, followed by `rest`.
std::string inBall(const std::string& rest) {
    return "-sphere -noise frequency=1.5 -noise frequency=1.5 seed=1 -bound layer=0.2 -dfvn speed=1 "
           "-scatter count=300 seed=3 " +
           rest;
}

/// A ball that moves through points around it, in a flow that changes, from frame 1 on.
std::string aroundBall(const std::string& advect, int last = 4) {
    const std::string flow =
        "-noise frequency=1.5 'alpha={2*pi*T}' -noise frequency=1.5 seed=1 -bound layer=0.2 side=outside -dfvn speed=1 "
        "padding=0.6 ";
    return "-sphere radius=0.5 " + flow + "-scatter count=400 seed=3 -frames 1-" + std::to_string(last) +
           " fps=4 substeps=2 -sphere radius=0.5 'translate={T},0,0' 'rotate=0,{90*T},0' " + flow + advect;
}

} // namespace

TEST_CASE("advect action: adaptive steps and step limits", "[app][command]") {
    const Folder folder;
    folder.mustRun(inBall("-advect duration=1 scheme=rk23 accuracy=1e-3 -report a.json"));
    folder.mustRun(inBall("-advect duration=1 scheme=rk23 accuracy=1e-5 -report b.json"));
    folder.mustRun(inBall("-advect duration=1 steps=4 maxStep=0.02 -report c.json"));
    const auto a = jsonOf(folder / "a.json")["advect"], b = jsonOf(folder / "b.json")["advect"],
               c = jsonOf(folder / "c.json")["advect"];
    CHECK(b["substeps"].get<double>() > 2 * a["substeps"].get<double>());
    CHECK(b["error_mean"].get<double>() < 0.1 * a["error_mean"].get<double>());
    CHECK(b["error_max"].get<double>() > b["error_mean"].get<double>());
    CHECK(a["coarse"] == 0);
    CHECK(a["outside"] == 0);
    CHECK(c["substeps"] > 300 * 30); // 1 s at a speed of about 1
    CHECK(c["speed_max"] > 1);
    CHECK_FALSE(c.contains("error_mean")); // rk4 has no error estimate

    const auto warned = folder.mustRun(inBall("-advect steps=1 maxStep=1e-3 maxSubdivisions=1"));
    CHECK_THAT(warned.err, Catch::ContainsSubstring("exceed the requested error"));
    folder.mustRun(inBall("-advect duration=1 steps=7 -write steps.csv"));
    folder.mustRun(inBall("-advect duration=1 dt=0.15 -write dt.csv"));
    CHECK(bytesOf(folder / "steps.csv") == bytesOf(folder / "dt.csv"));
    // If both are given, the accuracy determines the steps.
    folder.mustRun(inBall("-advect duration=1 accuracy=1e-4 -write accurate.csv"));
    folder.mustRun(inBall("-advect duration=1 accuracy=1e-4 steps=3 -write both.csv"));
    CHECK(bytesOf(folder / "accurate.csv") == bytesOf(folder / "both.csv"));
    // A scheme without an error estimate takes 100 equal steps by default.
    folder.mustRun(inBall("-advect duration=1 scheme=rk4 -write alone.csv -report alone.json"));
    folder.mustRun(inBall("-advect duration=1 steps=100 -write hundred.csv"));
    CHECK(bytesOf(folder / "alone.csv") == bytesOf(folder / "hundred.csv"));
    folder.mustFail(inBall("-advect scheme=rk4 accuracy=1e-3"), {"rk4", "rk45"});
    folder.mustFail(inBall("-advect steps=7 dt=0.15"), {"dt"});
    folder.mustFail(inBall("-advect dt=1e-12"), {"-advect", "1e-12", "steps"});
    folder.mustFail(inBall("-advect scheme=rk23 accuracy=0"), {"accuracy"});
    folder.mustFail(inBall("-advect maxStep=-1"), {"maxStep"});
}

TEST_CASE("advect action: positions do not depend on frame rate or substeps", "[app][command]") {
    const Folder folder;
    for (const auto& [fps, substeps] : {std::pair(24, 1), {24, 4}, {48, 1}}) {
        CAPTURE(fps, substeps);
        // The first second, computed frame by frame, and in one call for each frame.
        folder.mustRun(
            inBall(fmt::format("-frames 1-{} fps={} substeps={} -advect -scatter count=300 seed=3 "
                               "-advect 'duration={{T}}' accuracy=1e-9 -distance -report report.json",
                               fps + 1, fps, substeps)));
        const auto distance = jsonOf(folder / "report.json")["distance"];
        CHECK(distance["pairs"] == 300);
        CHECK(distance["mean"] > 0);
        CHECK(distance["mean"] < 2e-4); // 1e-4 of the ball's size
        CHECK(distance["max"] < 2e-2);
    }
}

TEST_CASE("advect action: jacobian= measures the change of volumes", "[app][command]") {
    const Folder folder;
    folder.mustRun(inBall("-advect duration=0.2 jacobian=100 -report a.json"));
    const auto kept = jsonOf(folder / "a.json")["volume"];
    CHECK(kept["samples"] == 100);
    CHECK(kept["farthest"] < 1e-6);
    folder.mustRun(
        "-noise -noise seed=1 -dfvn speed=1 uniformSpeed=1 -scatter count=100 -advect duration=0.5 steps=40 "
        "jacobian=100 "
        "-report b.json");
    const auto changed = jsonOf(folder / "b.json")["volume"];
    CHECK(changed["upper"].get<double>() - changed["lower"].get<double>() > 0.1);
}

TEST_CASE("advect action: points follow a changing flow and a moving wall", "[app][command]") {
    const Folder folder;
    folder.mustRun(aroundBall("-advect -write 'p.$F.csv' -check samples=1000 'report=c.$F.json'"));
    for (const int frame : {1, 2, 3, 4}) {
        const auto check = jsonOf(folder / ("c." + std::to_string(frame) + ".json"));
        CHECK(check["outside"] == 0);
        CHECK(check["points"] == 400);
        CHECK(check["advect"]["overrun"] == 0);
    }
    CHECK(jsonOf(folder / "c.4.json")["advect"]["outside_most"] == 0);
    CHECK(bytesOf(folder / "p.1.csv") != bytesOf(folder / "p.2.csv"));
    // The first frame shows the initial points.
    CHECK(jsonOf(folder / "c.1.json")["advect"]["iterations_mean"] == 0);
    CHECK(jsonOf(folder / "c.4.json")["advect"]["iterations_mean"] > 0);

    // The ball runs over points that do not move.
    folder.mustRun(aroundBall("-check samples=1000 'report=left.$F.json'"));
    CHECK(jsonOf(folder / "left.4.json")["outside"] > 5);

    // Any number of threads and the scalar instruction set give the same bytes.
    const std::string again = "-threads 1 " + aroundBall("-advect -write 'one.$F.csv'", 2);
    CHECK(folder.shell("CURLEW_SIMD=scalar $curlew " + again).status == 0);
    CHECK(bytesOf(folder / "one.2.csv") == bytesOf(folder / "p.2.csv"));
}

TEST_CASE("check tracks=: compares tracks of the flow and of its grid", "[app][command]") {
    const Folder folder;
    folder.mustRun(inBall("-velocity dim=48 -check samples=1000 tracks=300 report=a.json"));
    const auto check = jsonOf(folder / "a.json");
    CHECK(check["tracks_drift_f"] < 1e-7);
    CHECK(check["tracks_grid_drift_f"] > 1e-3);
    CHECK(check["tracks_outside"] == 0);
    folder.mustFail(inBall("-check tracks=10"), {"-velocity"});
}

TEST_CASE("spacing action: measures nearest-neighbour distances", "[app][command]") {
    const Folder folder;
    folder.mustRun(
        "-jitter spacing=0.25 amount=0 -spacing -jitter dimensions=2 spacing=0.125 amount=0 -spacing name=flat "
        "-report r.json");
    const auto report = jsonOf(folder / "r.json");
    CHECK(report["spacing"]["points"] == 512);
    CHECK(report["spacing"]["median"] == 0.25);
    CHECK(report["spacing"]["minimum"] == 0.25);
    CHECK(report["flat"]["points"] == 256);
    CHECK(report["flat"]["median"] == 0.125);
    folder.mustFail("-spacing", {"-spacing", "points", "none"});
    folder.mustFail("-scatter box=0,0,0,1,1,1 count=1 -spacing", {"-spacing", "at least 2"});
}
