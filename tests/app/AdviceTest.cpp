// SPDX-License-Identifier: Apache-2.0
#include "support/Catch.h"
#include "support/Command.h"

using namespace curlew;
using Catch::Matchers::ContainsSubstring;
using test::Folder;

namespace {

const std::string kFlow = "-noise frequency=2 -noise frequency=2 seed=1 -dfvn speed=1 ";

const std::string kBound = "-noise -noise seed=1 -bound -dfvn -scatter count=5 -write a.csv";

std::string said(const std::string& arguments) { return Folder().mustRun(arguments).err; }

} // namespace

TEST_CASE("advice: warns of points scattered anew in each frame and then advected", "[app]") {
    const std::string what = "warning: -scatter after -frames";
    CHECK_THAT(said(kFlow + "-frames 1-2 -scatter count=10 -advect -write a.##.ply"), ContainsSubstring(what));
    CHECK_THAT(said(kFlow + "-scatter count=10 -frames 1-2 -advect -write a.##.ply"), !ContainsSubstring("warning"));
    CHECK_THAT(said(kFlow + "-frames 1-2 -emit -advect -write a.##.ply"), !ContainsSubstring("warning"));
    CHECK_THAT(said(kFlow + "-frames 1-2 -scatter count=10 -write a.##.ply"), !ContainsSubstring("warning"));
}

TEST_CASE("advice: warns of a shape that nothing uses", "[app]") {
    CHECK_THAT(said("-sphere " + kFlow + "-scatter count=10 -write a.ply"),
               ContainsSubstring("warning: nothing uses the shape made by -sphere") && ContainsSubstring("-bound"));
    CHECK_THAT(said("-sphere -scatter count=10 -write a.ply"), !ContainsSubstring("warning"));
    CHECK_THAT(said("-sphere -print"), !ContainsSubstring("warning"));
}

TEST_CASE("advice: warns of a grid with fewer than four voxels per wavelength and suggests a voxel size", "[app]") {
    const std::string coarse = said(kFlow + "-velocity voxel=0.25 -write v.vdb");
    CHECK_THAT(coarse, ContainsSubstring("warning: the flow's wavelength of 0."));
    const size_t at = coarse.find("voxel=");
    REQUIRE(at != std::string::npos);
    const std::string advised = coarse.substr(at, coarse.find(' ', at) - at);
    CHECK_THAT(said(kFlow + "-velocity " + advised + " -write v.vdb"), !ContainsSubstring("wavelength"));
    CHECK_THAT(said(kFlow + "-velocity -write v.vdb"), !ContainsSubstring("warning"));
}

TEST_CASE("advice: warns of a layer wider than its object and of points inside the wall", "[app]") {
    const std::string bound = "-sphere radius=0.3 -noise frequency=2 -noise frequency=2 seed=1 -bound side=outside ";
    CHECK_THAT(said(bound + "layer=1 -dfvn -scatter count=10 -write a.ply"),
               ContainsSubstring("wider than the object, 0.6"));
    CHECK_THAT(said(bound + "layer=0.2 -dfvn -scatter count=10 -write a.ply"), !ContainsSubstring("warning"));
    CHECK_THAT(said(bound + "layer=0.2 -dfvn -scatter box=-0.1,-0.1,-0.1,0.1,0.1,0.1 domain=none count=10 -advect "
                            "duration=0.1 -write a.ply"),
               ContainsSubstring("all 10 points are on the wrong side"));
}

TEST_CASE("advice: warns of values that change with time but come before the frames", "[app]") {
    const std::string what = "warning: -noise changes with the frame or the time, but comes before -frames";
    CHECK_THAT(said("-noise alpha={T} -frames 1-2 -slice width=8 -write a.##.png"), ContainsSubstring(what));
    CHECK_THAT(said("-frames 1-2 -noise alpha={T} -slice width=8 -write a.##.png"), !ContainsSubstring("warning"));
    CHECK_THAT(said("-noise alpha={fps} -frames 1-2 -slice width=8 -write a.##.png"), !ContainsSubstring("warning"));
    CHECK_THAT(said("-noise alpha={T} -slice width=8 -write a.png"), !ContainsSubstring("warning"));
}

TEST_CASE("advice: warns of meshes that nothing uses", "[app]") {
    const std::string spot = test::sourceDir() + "/scenes/spot.obj", wall = "-mesh2ls dim=12 " + kBound;
    CHECK_THAT(said("-read " + spot + " " + spot + " " + wall),
               ContainsSubstring("nothing uses 1 of 2 meshes made by -read"));
    CHECK_THAT(said("-read " + spot + " " + wall), !ContainsSubstring("nothing uses"));
}

TEST_CASE("advice: warns of a velocity grid that does not tile", "[app]") {
    const auto grid = [](const std::string& noise, const std::string& box) {
        return said("-noise " + noise + " -noise seed=1 " + noise + " -dfvn -velocity tile=1 dim=8 box=0,0,0," + box +
                    " -write v.vdb");
    };
    CHECK_THAT(grid("frequency=2 period=4", "2,2,2"), !ContainsSubstring("does not tile"));
    CHECK_THAT(grid("frequency=2", "2,2,2"), ContainsSubstring("warning: the grid does not tile along z"));
    CHECK_THAT(grid("frequency=2 period=4", "2,1,2"),
               ContainsSubstring("does not tile along y") && !ContainsSubstring("does not tile along x"));
}

TEST_CASE("advice: warns of probed positions beyond the band of a level set", "[app][command]") {
    const Folder folder;
    test::store(folder / "in.csv", "x,y,z\n0.5,0,0\n3,0,0\n");
    const std::string spot = "-read " + test::sourceDir() + "/scenes/spot.obj -mesh2ls dim=24 -probe in.csv out.csv";
    CHECK_THAT(folder.mustRun(spot).err,
               ContainsSubstring("warning: ") && ContainsSubstring("of 2 positions are farther"));
    CHECK_THAT(folder.mustRun("-sphere -probe in.csv out.csv").err, !ContainsSubstring("warning"));
}

TEST_CASE("advice: says why a picture of a surface is empty", "[app]") {
    const std::string size = " width=16 height=16 -write a.png";
    CHECK_THAT(said("-noise -shade iso=-5" + size), ContainsSubstring("no isosurface at iso=-5") &&
                                                        ContainsSubstring("samples of the field are between -0."));
    CHECK_THAT(said("-noise -shade iso=0" + size), !ContainsSubstring("warning"));
    CHECK_THAT(said("-noise -shade iso=0 eye=0,0,5 aim=0,0,9" + size), ContainsSubstring("outside the camera's view"));
}

TEST_CASE("advice: warns of options that have no effect with the others", "[app]") {
    const std::string look = "-scatter box=0,0,0,1,1,1 count=10 -splat width=16 height=16 look=";
    const std::string what = "warning: -splat: glow= has no effect without look=luminous";
    CHECK_THAT(said(look + "opaque glow=0.3 -write a.png"), ContainsSubstring(what));
    CHECK_THAT(said(look + "luminous glow=0.3 -write a.png"), !ContainsSubstring("warning"));
    CHECK_THAT(said(look + "opaque -write a.png"), !ContainsSubstring("warning"));
    CHECK_THAT(said("-jitter count=50 method=random layer=2 frequency=1 -write a.csv"),
               ContainsSubstring("-jitter: frequency= has no effect without method=curl") &&
                   ContainsSubstring("-jitter: layer= has no effect without method=curl"));
    CHECK_THAT(said("-jitter count=50 layer=2 -write a.csv"), !ContainsSubstring("warning")); // method=curl by default
    CHECK_THAT(said("-sphere -shade width=16 height=16 sheet=1 -write a.png"),
               ContainsSubstring("-shade: sheet= has no effect without iso="));
    CHECK_THAT(said(kFlow + "-scatter count=5 -advect steps=2 reproject=none tolerance=1e-5 -write a.csv"),
               ContainsSubstring("tolerance= has no effect without reproject=gauss-newton or reproject=newton"));
    CHECK_THAT(said(kFlow + "-scatter count=5 -trace maxLength=0.1 reproject=none iterations=3 -write a.ply"),
               ContainsSubstring("iterations= has no effect"));
    const std::string codec = "-write: codec= has no effect without a .vdb or .nvdb or .npz file";
    const std::string points = "-scatter box=0,0,0,1,1,1 count=10 -write codec=zip ";
    CHECK_THAT(said(points + "a.ply"), ContainsSubstring(codec));
    CHECK_THAT(said(points + "format=ply a.vdb overwrite=1"), ContainsSubstring(codec));
    CHECK_THAT(said(points + "a.vdb"), !ContainsSubstring("warning"));
    CHECK_THAT(said(points + "a.ply a.vdb"), !ContainsSubstring("warning")); // one of the files
    CHECK_THAT(said(points + "format=vdb a"), !ContainsSubstring("warning"));
    CHECK_THAT(said(points + "A.VDB"), !ContainsSubstring("warning"));
    for (const std::string option : {"legend=0", "range=0,1"})
        CHECK_THAT(said("-noise -slice width=16 -write a.exr " + option),
                   ContainsSubstring("has no effect without a .png"));
    CHECK_THAT(said("-noise -slice width=16 -write a.png half=1"), ContainsSubstring("half= has no effect"));
    CHECK_THAT(said("-noise -slice width=16 -write a.exr half=1"), !ContainsSubstring("warning"));
    CHECK_THAT(said("-frames 1-2 -sphere -emit rate=10 spread=0.5 speed=1 -write a.##.csv"),
               ContainsSubstring("-emit: spread= has no effect without life=") &&
                   ContainsSubstring("-emit: speed= has no effect without on=surface"));
}
