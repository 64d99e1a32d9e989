// SPDX-License-Identifier: Apache-2.0
#include "curlew/picture/ImageFile.h"
#include "support/Command.h"

using namespace curlew;
using namespace curlew::test;
using Catch::Matchers::ContainsSubstring;

namespace {

const std::string kFlow = "-sphere -noise frequency=2 -noise frequency=2 seed=1 -bound -dfvn speed=1 ";
const std::string kSize = " width=160 height=120 ";

/// Returns the mean of a picture's display values.
double meanOf(const Image& image) {
    double sum = 0;
    for (const float value : image.pixels) sum += static_cast<double>(value);
    return sum / static_cast<double>(image.pixels.size());
}

} // namespace

TEST_CASE("splat action: draws curves and points and reports their coverage", "[app][command]") {
    const Folder folder;
    const Outcome outcome = folder.mustRun(kFlow + "-scatter count=200 -trace maxLength=2 -splat" + kSize +
                                           "-write curves.png -scatter count=500 -splat show=height map=ice" + kSize +
                                           "-write points.png points.json");
    CHECK_THAT(outcome.err, ContainsSubstring("splat: ") && ContainsSubstring("500 of 500 points"));
    const auto report = jsonOf(folder / "points.json").at("splat");
    CHECK(report.at("drawn") == 500);
    CHECK(report.at("covered").get<double>() > 0.1);
    const Image curves = readPng(folder / "curves.png"), points = readPng(folder / "points.png");
    CHECK(curves.width == 160);
    CHECK(curves.height == 120);
    CHECK(meanOf(curves) > 0.05);
    CHECK(meanOf(points) > 0.03);
    for (const float value : curves.pixels) CHECK(value < 1); // no saturated white
}

TEST_CASE("splat action: the camera fits what is drawn with or without a box", "[app][command]") {
    const Folder folder;
    const auto covered = [&](const std::string& options) {
        folder.mustRun("-jitter count=1000 box=4,4,4,5,5,5 -splat pixels=4 glow=0 " + options + kSize +
                       "-write r.json");
        return jsonOf(folder / "r.json").at("splat").at("covered").get<double>();
    };
    CHECK(covered("") > 0.35);
    CHECK(covered("from=0,0,1 fov=0.1") > 0.35);
    CHECK(covered("viewBox=0,0,0,9,9,9") < covered(""));
    CHECK(covered("eye=4.5,4.5,12 aim=4.5,4.5,4.5 fov=10") > 0.2);
}

TEST_CASE("splat action: over=1 draws onto a picture with depth and hides what is behind", "[app][command]") {
    const Folder folder;
    const auto mean = [&](const std::string& later) {
        folder.mustRun(
            "-jitter spacing=0.1 box=-1,-1,0.5,1,1,0.7 -splat look=opaque pointRadius=0.08 fade=0 "
            "eye=0,0,5 aim=0,0,0" +
            kSize + later + "-write a.png");
        return meanOf(readPng(folder / "a.png"));
    };
    const std::string light = "-splat over=1 color=1,1,1 outline=0 ";
    const double alone = mean("");
    CHECK(mean("-scatter count=300 box=-1,-1,-1,1,1,-0.5 " + light) == Approx(alone).epsilon(0.02));
    CHECK(mean("-scatter count=300 box=-1,-1,0.9,1,1,1 " + light) > 1.02 * alone);
    CHECK(mean("-scatter count=300 box=-1,-1,0.9,1,1,1 -splat over=1 look=opaque color=1,1,1 pointRadius=0.05 ") >
          1.02 * alone);
    // An opaque picture has a depth channel, one of light has none.
    folder.mustRun("-jitter count=100 -splat look=opaque" + kSize + "-write a.exr -splat" + kSize + "-write b.exr");
    CHECK(readExr(folder / "a.exr").channels == std::vector<std::string>{"R", "G", "B", "A", "Z"});
    CHECK(readExr(folder / "b.exr").channels == std::vector<std::string>{"R", "G", "B"});
}

TEST_CASE("splat action: every colour option and the wall outline change the picture", "[app][command]") {
    const Folder folder;
    const std::string curves = kFlow + "-sphere -scatter count=50 -trace maxLength=1 ";
    std::set<std::string> pictures;
    for (const std::string by :
         {"show=speed", "show=id", "show=index", "show=height", "show=depth", "show=age", "color=1,0.5,0", "map=ember",
          "outline=0", "range=0,9", "background=0.1,0.1,0.1", "exposure=3"}) {
        folder.mustRun(curves + "-splat " + by + kSize + "-write a.png");
        pictures.insert(bytesOf(folder / "a.png"));
    }
    CHECK(pictures.size() == 12);
}

TEST_CASE("splat action: invalid inputs and options are refused", "[app][command]") {
    const Folder folder;
    folder.mustFail("-splat -write a.png", {"-splat", "points or curves", "none"});
    folder.mustFail("-sphere -scatter count=5 -splat show=speed", {"-splat", "velocity"});
    folder.mustFail("-sphere -scatter count=5 -splat show=age", {"-splat", "age"});
    folder.mustFail("-sphere -scatter count=5 -splat show=id color=1,1,1",
                    {"-splat", "show=", "color=", "one of them"});
    folder.mustFail("-sphere -scatter count=5 -splat over=1", {"-splat", "an image", "none"});
    folder.mustFail("-noise -slice width=20 -sphere -scatter count=5 -splat over=1", {"-splat", "perspective"});
    folder.mustFail("-sphere -scatter count=5 -splat pixels=0", {"-splat", "pixels"});
    folder.mustFail("-sphere -scatter count=5 -splat geo=1", {"-splat", "geometry"});
}

TEST_CASE("advect pathlines=1: records pathlines as curves, and -distance compares them", "[app][command]") {
    const Folder folder;
    const std::string points = "-scatter count=100 seed=2 -advect duration=0.5 pathlines=1 ";
    folder.mustRun(kFlow + points + "steps=10 -write a.csv " + points +
                   "steps=20 -distance geo=0,2 -write curves.json -distance geo=1,3 -write points.json");
    CHECK(linesIn(bytesOf(folder / "a.csv")) == 1 + 100 * 11);
    const auto curves = jsonOf(folder / "curves.json").at("distance"),
               ends = jsonOf(folder / "points.json").at("distance");
    CHECK(curves.at("pairs") == 100 * 21);
    CHECK(ends.at("pairs") == 100);
    CHECK(curves.at("mean").get<double>() > 0);
    CHECK(curves.at("mean").get<double>() < 0.02);
    folder.mustFail("-sphere -scatter -distance", {"-distance", "geometry"});
    folder.mustFail(kFlow + points + "-distance", {"-distance", "both"});
    folder.mustFail("-sphere -scatter -distance geo=0", {"-distance", "2 objects", "there is 1"});
}

TEST_CASE("snap action: moves points onto a shape or a terrain", "[app][command]") {
    const Folder folder;
    folder.mustRun(
        "-torus -scatter count=200 -snap -write r.json -noise dimensions=2 -height -scatter count=300 "
        "box=-1,-1,-0.5,1,1,0.5 -snap iso=0 maxDistance=2 -write h.json");
    CHECK(jsonOf(folder / "r.json").at("snap").at("missed") == 0);
    CHECK(jsonOf(folder / "h.json").at("snap").at("missed") == 0);
    folder.mustFail("-scatter count=3 box=0,0,0,1,1,1 -snap", {"-snap", "shape"});
    folder.mustFail("-torus -snap", {"-snap", "points"});
    folder.mustFail("-torus -scatter count=3 -snap maxDistance=0", {"-snap", "maxDistance"});
}

TEST_CASE("splat action: empty points give an empty picture", "[app][command]") {
    const Folder folder;
    folder.mustRun("-scatter box=0,0,0,1,1,1 count=5 -kill box=5,5,5,6,6,6 -splat background=0.5,0.5,0.5" + kSize +
                   "-write a.png a.json");
    for (const float value : readPng(folder / "a.png").pixels) REQUIRE(value == Approx(0.5).margin(0.003));
    CHECK(jsonOf(folder / "a.json").at("splat").at("drawn") == 0);
    // The first frame of -emit has no points.
    folder.mustRun(kFlow + "-frames 1-3 -emit rate=500 -advect -splat" + kSize + "-write e.##.png");
    CHECK(meanOf(readPng(folder / "e.01.png")) < meanOf(readPng(folder / "e.03.png")));
}

TEST_CASE("splat action: one camera is used for a whole sequence", "[app][command]") {
    const Folder folder;
    // A growing cube of points. With a separate camera for each frame, all pictures would be the same.
    const auto growing = [&](const std::string& wall) {
        folder.mustRun(wall +
                       "-frames 1-3 -jitter spacing='{0.1*F}' 'box={-F},{-F},{-F},{F},{F},{F}' -splat glow=0 "
                       "outline=0.5" +
                       kSize + "-write g.##.png -write g.##.json");
        return std::pair(jsonOf(folder / "g.01.json").at("splat").at("covered").get<double>(),
                         jsonOf(folder / "g.03.json").at("splat").at("covered").get<double>());
    };
    const auto [first, third] = growing("");
    CHECK(third > 1.3 * first);
    const auto [inWall, thirdInWall] = growing("-sphere radius=6 ");
    CHECK(inWall < 0.5 * first);
    CHECK(thirdInWall > 3 * inWall);
}

TEST_CASE("splat action: warns once of colours that jump from frame to frame", "[app][command]") {
    const Folder folder;
    const auto said = [&](const std::string& speed, const std::string& range) {
        return folder
            .mustRun("-sphere -scatter count=200 -noise -noise seed=1 -dfvn 'speed=" + speed +
                     "' -frames 1-4 -sphere -noise -noise seed=1 -bound -dfvn 'speed=" + speed + "' -advect -splat " +
                     range + kSize + "-write 's.$F.png'")
            .err;
    };
    const std::string jumps = said("{1+F}", "");
    CHECK_THAT(jumps, ContainsSubstring("the colours stand for") && ContainsSubstring("range="));
    CHECK(jumps.find("the colours") == jumps.rfind("the colours"));
    CHECK_THAT(said("{1+F}", "range=0,5"), !ContainsSubstring("the colours"));
    CHECK_THAT(said("{1}", ""), !ContainsSubstring("the colours"));
}

TEST_CASE("splat action: an obstacle hides the points behind it and a container does not", "[app][command]") {
    const Folder folder;
    const auto covered = [&](const std::string& side, const std::string& box) {
        folder.mustRun("-sphere radius=0.5 -noise -noise seed=1 -bound layer=0.2 side=" + side +
                       " -dfvn -scatter count=300 seed=2 domain=none box=" + box +
                       " -splat color=1,1,1 glow=0 fade=0 eye=0,0,5 aim=0,0,0 fov=30" + kSize + "-write a.png a.json");
        return jsonOf(folder / "a.json").at("splat").at("covered").get<double>();
    };
    const std::string behind = "-0.2,-0.2,-1.2,0.2,0.2,-1", before = "-0.2,-0.2,1,0.2,0.2,1.2";
    CHECK(covered("outside", behind) == 0);
    CHECK(covered("outside", before) > 0.01);
    CHECK(covered("inside", behind) > 0.01);
}
