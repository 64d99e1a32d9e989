// SPDX-License-Identifier: Apache-2.0
#include "curlew/picture/ImageFile.h"
#include "support/Command.h"

#include <cmath>

using namespace curlew;
using namespace curlew::test;

TEST_CASE("panels action: arranges and colours the newest images with labels", "[app][command]") {
    const Folder folder;
    const std::string make = "-noise dimensions=2 -slice width=200 -noise dimensions=2 seed=1 -slice width=200 ";
    folder.mustRun(make + "-panels gap=0 legend=0 -write p.png");
    const Image sheet = readPng(folder / "p.png");
    CHECK((sheet.width == 400 && sheet.height == 200));

    // The older picture is on the left. Each has its own scale unless colorRange=common is given.
    folder.mustRun("-noise dimensions=2 -slice width=200 -write legend=0 a.png");
    const Image alone = readPng(folder / "a.png");
    bool same = true;
    for (int y = 0; y < 200; ++y)
        for (int x = 0; x < 200; ++x) same = same && alone.at(x, y) == sheet.at(x, y);
    CHECK(same);
    folder.mustRun(
        "-noise dimensions=2 -slice width=200 -noise dimensions=2 amplitude=9 -slice width=200 -panels gap=0 legend=0 "
        "colorRange=common -write c.png");
    CHECK_FALSE(readPng(folder / "c.png").at(100, 100) == alone.at(100, 100));

    folder.mustRun(make + "-panels columns=1 'labels=a|b' -write l.png -panels -write l2.png");
    CHECK(readPng(folder / "l.png").height > 2 * 200);
    // The two images are consumed unless they are kept.
    CHECK(readPng(folder / "l2.png").width < 300);
    folder.mustRun(make + "-panels keep=1 gap=0 -panels gap=0 -write k.png");
    CHECK(readPng(folder / "k.png").width == 200 + 200 + 400);

    folder.mustFail("-panels", {"panels", "an image", "none"});
    folder.mustFail(make + "-panels count=3", {"there are 2"});
    folder.mustFail(make + "-panels 'labels=a|b|c'", {"3 labels for 2"});

    // Labels can contain values of the report. The two slices are the same, so their difference is 0.
    const std::string alike = "-noise dimensions=2 -slice width=200 -slice width=200 -compare ";
    folder.mustRun(alike + "-panels 'labels=[compare/rmse] [compare/unmatched] [[x]|b' -write f.png");
    folder.mustRun("-noise dimensions=2 -slice width=200 -slice width=200 -panels 'labels=0.00 0 [[x]|b' -write g.png");
    CHECK(readPng(folder / "f.png").pixels == readPng(folder / "g.png").pixels);
    folder.mustFail(alike + "-panels 'labels=[compare/rms]|b'", {"no 'compare/rms'", "did you mean 'rmse'"});
    folder.mustFail(alike + "-panels 'labels=[compare|b'", {"[ without a ]"});
}

TEST_CASE("write half=1: halves the precision of an EXR and read brings pictures back", "[app][command]") {
    const Folder folder;
    folder.mustRun(
        "-noise dimensions=2 -slice width=100 -write a.exr -write half=1 b.exr -read a.exr b.exr -compare -write "
        "r.json -expect compare/largest max=0.0005 -expect compare/largest min=1e-9");
    CHECK(jsonOf(folder / "r.json")["compare"]["unmatched"] == 0);
    CHECK(readExr(folder / "a.exr").channels == std::vector<std::string>{"value"});
    CHECK(fs::file_size(folder / "b.exr") < fs::file_size(folder / "a.exr"));
    folder.mustRun(
        "-noise dimensions=2 -slice width=100 contours=5 -write p.png p.exr -read p.png p.exr -compare name=both "
        "-expect both/largest max=0.003");
    folder.mustFail("-noise dimensions=2 -slice width=50 -compare", {"-compare", "with=1", "there is 1"});
    folder.mustFail("-noise dimensions=2 -slice width=50 -slice width=60 -compare", {"cannot be compared"});
    folder.mustFail("-read missing.png", {"missing.png"});
}

TEST_CASE("write range=: fixes the colours", "[app][command]") {
    const Folder folder;
    folder.mustRun("-constant value=2 -slice width=20 map=gray -write legend=0 range=0,4 a.png");
    CHECK(readPng(folder / "a.png").at(5, 5) == Approx(0.5).margin(0.005));
}

TEST_CASE("slice action: shows vectors as colours with zero in the middle", "[app][command]") {
    const Folder folder;
    // The gradient is (3, -3, 0) at each point.
    folder.mustRun("-ramp gradient=3,-3,0 -slice width=20 show=gradient -write g.png g.exr");
    const Image exr = readExr(folder / "g.exr"), png = readPng(folder / "g.png");
    REQUIRE(exr.channels == std::vector<std::string>{"gradient.x", "gradient.y", "gradient.z"});
    CHECK(exr.at(4, 4, 1) == -3);
    CHECK(png.at(4, 4, 0) == 1);
    CHECK(png.at(4, 4, 1) == 0);
    CHECK(png.at(4, 4, 2) == Approx(0.5).margin(0.005));
    folder.mustRun("-ramp gradient=3,-4,0 -slice width=20 show=slope -write s.exr");
    CHECK(readExr(folder / "s.exr").at(3, 3) == 5);
    folder.mustFail("-ramp -slice show=speed", {"needs a flow"});
    folder.mustFail("-noise dimensions=2 -dfvn -slice show=slope", {"needs a field"});
}

TEST_CASE("slice action: fills the picture without a wall and has a margin with one", "[app][command]") {
    const Folder folder;
    folder.mustRun("-noise dimensions=2 -dfvn box=0,0,0,2,1,1 -slice width=64 show=velocity -write a.exr");
    const Image open = readExr(folder / "a.exr");
    CHECK((open.width == 64 && open.height == 32));
    CHECK(std::none_of(open.pixels.begin(), open.pixels.end(), [](float v) { return std::isnan(v); }));
    folder.mustRun("-sphere -noise -noise seed=1 -bound -dfvn -slice width=64 -write b.exr");
    const Image walled = readExr(folder / "b.exr");
    for (int k = 0; k < 64; ++k) REQUIRE(std::isnan(walled.at(k, 0) + walled.at(0, k)));
    CHECK_FALSE(std::isnan(walled.at(32, 32)));
}

TEST_CASE("slice action: draws contours and arrows", "[app][command]") {
    const Folder folder;
    const std::string noise = "-noise dimensions=2 frequency=2 ";
    folder.mustRun(noise +
                   "-slice width=100 -write plain.png legend=0 -slice width=100 contours=7 -write lines.png "
                   "-slice width=100 arrows=8 -write arrows.png");
    const Image plain = readPng(folder / "plain.png");
    for (const char* name : {"lines.png", "arrows.png"}) {
        const Image drawn = readPng(folder / name);
        REQUIRE((drawn.width == 100 && drawn.height == 100));
        size_t other = 0;
        for (size_t k = 0; k < plain.pixels.size(); ++k) other += std::abs(drawn.pixels[k] - plain.pixels[k]) > 0.1f;
        CAPTURE(name, other);
        CHECK(other > 500);
        CHECK(other < 20000);
    }
}

TEST_CASE("lic action: draws streaks with and without colour and with the wall", "[app][command]") {
    const Folder folder;
    const std::string flow = "-sphere -noise -noise seed=1 -bound -dfvn ";
    folder.mustRun(flow + "-lic width=80 show=none drawWall=0 -write a.exr -lic width=80 -write b.exr");
    const Image gray = readExr(folder / "a.exr"), colored = readExr(folder / "b.exr");
    CHECK(gray.channels == std::vector<std::string>{"lic"});
    CHECK(std::isnan(gray.at(0, 0)));
    CHECK(colored.channels == std::vector<std::string>{"R", "G", "B"});
    // The middle row crosses the wall, which is drawn nearly white.
    float brightest = 0;
    for (int x = 0; x < 20; ++x) brightest = std::max(brightest, std::min(colored.at(x, 40, 0), colored.at(x, 40, 2)));
    CHECK(brightest > 0.6f);
    folder.mustFail("-noise -lic", {"a flow", "none"});
}

TEST_CASE("warp action: carries patterns and images along a 2D flow", "[app][command]") {
    const Folder folder;
    const std::string flow = "-noise type=gradient dimensions=2 frequency=3 -dfvn box=0,0,0,2,1,1 ";
    folder.mustRun(flow +
                   "-warp pattern=waves width=64 duration=0 supersampling=1 -write still.png -warp pattern=waves "
                   "width=64 -compare -expect compare/rmse min=0.1");
    const Image still = readPng(folder / "still.png");
    CHECK((still.width == 64 && still.height == 32));
    // Forward and back: only blur remains.
    folder.mustRun(
        "-noise dimensions=2 -slice width=80 box=0,0,0,2,1,1 -write in.png legend=0 " + flow +
        "-read in.png -warp duration=0.02 -warp duration=-0.02 -read in.png -compare -expect compare/rmse max=0.05");
    folder.mustFail(flow + "-warp", {"an image", "none"});
    folder.mustFail("-noise -noise seed=1 -dfvn -warp pattern=waves", {"3 dimensions"});
    folder.mustFail("-warp", {"a flow", "none"});
    folder.mustFail(flow + "-warp pattern=waves image=0", {"image=", "no effect", "pattern=none"});
}

TEST_CASE("plot action: draws the curves of a table", "[app][command]") {
    const Folder folder;
    store(folder / "t.csv", "n,error\n1,1\n10,0.1\n");
    folder.mustRun("-plot t.csv t.svg logx=1 logy=1 title='the error'");
    CHECK_THAT(bytesOf(folder / "t.svg"), Catch::StartsWith("<svg") && Catch::ContainsSubstring("the error"));
    folder.mustFail("-plot none.csv n.svg", {"none.csv"});
}

TEST_CASE("slice action: shows the velocity component along a direction", "[app][command]") {
    const Folder folder;
    const std::string flow = "-constant value=0 -slice width=20 -uniform velocity=3,4,0 -slice width=20 show=along ";
    folder.mustRun(flow + "direction=0,2,0 -compare -expect compare/rmse min=3.999 max=4.001");
    folder.mustRun(flow +
                   "direction=4,-3,0 -slice width=20 -compare with=2 name=speed -compare -expect speed/rmse "
                   "min=4.999 max=5.001");
    folder.mustFail(flow + "direction=0,0,0", {"not a direction"});
}
