// SPDX-License-Identifier: Apache-2.0
#include "curlew/app/registry/Expression.h"
#include "support/Catch.h"
#include "support/Command.h"
#include "support/SessionCommand.h"

using namespace curlew;
using namespace curlew::app;
using Catch::Matchers::ContainsSubstring;
using test::Folder;
namespace fs = std::filesystem;

namespace {

const std::string kDust = "-noise -noise seed=1 -dfvn -scatter count=10 ";

} // namespace

TEST_CASE("file names: hash marks and printf's %d stand for the frame as $F does", "[app]") {
    const Moment moment{.frame = 17, .time = 0.5};
    for (const auto& [pattern, text] : std::vector<std::pair<std::string, std::string>>{{"a.####.ply", "a.0017.ply"},
                                                                                        {"a.##.ply", "a.17.ply"},
                                                                                        {"a.%04d.ply", "a.0017.ply"},
                                                                                        {"a.%4d.ply", "a.0017.ply"},
                                                                                        {"a.%d.ply", "a.17.ply"},
                                                                                        {"##/a{F+1}.$F3", "17/a18.017"},
                                                                                        {"#1", "#1"},
                                                                                        {"5%", "5%"},
                                                                                        {"50%-d %x", "50%-d %x"},
                                                                                        {"$#$# $%d $$F", "## %d $F"}}) {
        CAPTURE(pattern);
        CHECK(expanded(pattern, moment) == text);
        CHECK(variablesOf(pattern).time == (pattern.find("a.") == 0 || pattern.find("##/") == 0));
    }
}

TEST_CASE("file names: a file that each frame would overwrite is refused without overwrite=1", "[app][command]") {
    const Folder folder;
    for (const char* name : {"o.vdb", "o..vdb", "o.{floor(F/10)}.vdb"}) {
        CAPTURE(name);
        folder.mustFail(kDust + "-frames 1-3 -advect -write '" + name + "'",
                        {"-write", "frame 1 and again in frame 2", ".####.vdb", "overwrite=1"});
    }
    // The check considers all frames, even if this process computes one part of them.
    folder.mustFail("-frames 1-4 part=1/4 -noise alpha={T} -slice width=8  -write o.png", {"overwrite=1"});
    folder.mustRun(kDust + "-frames 1-3 -advect -write o.vdb overwrite=1");
    folder.mustRun(kDust + "-frames 1-3 -advect -write a.####.ply b.%02d.ply 'c.$F4.ply'");
    for (const char* name : {"a.0001.ply", "a.0003.ply", "b.02.ply", "c.0003.ply"}) CHECK(fs::exists(folder / name));
    folder.mustRun(kDust + "-frames 4 -advect -write one.ply");       // a single frame
    folder.mustRun(kDust + "-frames 1-3 -advect -write report.json"); // the last report includes all frames
    folder.mustRun(kDust + "-write still.ply -frames 1-2 -advect -write p.##.ply"); // written once, before the frames
}

TEST_CASE("file names: an input cannot be overwritten but an own output may be read again", "[app][command]") {
    const Folder folder;
    folder.mustRun("-read " + test::sourceDir() + "/scenes/spot.obj -write ball.ply");
    const std::string before = test::bytesOf(folder / "ball.ply");
    folder.mustFail("-read ball.ply -write ball.ply", {"-write", "ball.ply", "overwrite an input"});
    folder.mustFail("-read ball.ply -write ball.ply overwrite=1", {"overwrite an input"});
    folder.mustFail("-read ball.ply -write ./ball.ply", {"overwrite an input"});
    folder.mustFail("-read ball.ply -mesh2ls dim=8 -check report=ball.ply", {"-check", "overwrite an input"});
    folder.mustFail("-read ball.ply -report ball.ply", {"-report", "overwrite an input"});
    folder.mustFail("-read ball.ply -frames 1-2 checkpoint=ball.ply -print", {"-read", "checkpoint of -frames"});
    test::store(folder / "in.csv", "x,y,z\n0,0,0\n");
    folder.mustFail("-noise -probe in.csv in.csv", {"-probe", "overwrite an input"});
    folder.mustFail("-plot in.csv in.csv", {"-plot", "overwrite an input"});
    folder.mustFail("-plot in.csv a.png", {"a.png", ".svg"});
    folder.mustRun("-noise -probe in.csv out.csv -plot out.csv out.svg");
    folder.mustFail("-noise -probe in.csv o.csv -noise -dfvn -velocity dim=8 -spectrum plot=in.csv",
                    {"-spectrum", "overwrite an input"});
    // Inputs of frames that another process computes need not be there.
    test::store(folder / "in.1.csv", "x,y,z\n0,0,0\n");
    folder.mustRun("-frames 1-2 part=1/2 -noise -probe 'in.$F.csv' 'out.$F.csv'");
    folder.mustFail("-frames 1-2 -noise -probe 'in.$FF.csv' 'out.$F.csv'", {"in.$FF.csv", "stands for nothing"});
    folder.mustFail("-frames 1-2 part=2/2 -noise -probe 'in.$F.csv' 'out.$F.csv'", {"in.2.csv", "no such file"});
    folder.mustFail("-frames 1-2 -read ball.ply -write ball.ply overwrite=1", {"overwrite an input"});
    CHECK(test::bytesOf(folder / "ball.ply") == before);
    folder.mustRun("-read ball.ply -write b.ply -read b.ply -write b.ply");
    folder.mustRun("-read ball.ply -write f.0.ply -frames 1-3 -read 'f.{F-1}.ply' -write 'f.{F}.ply'");
}

TEST_CASE("write: reports the content and size of each file", "[app][command]") {
    const Folder folder;
    const auto said = [&](const std::string& arguments) { return folder.mustRun(arguments).err; };
    CHECK_THAT(said("-noise -noise seed=1 -dfvn -scatter count=5000 -advect steps=1 -write v.vdb"),
               ContainsSubstring("wrote v.vdb: 5,000 points (P v id f g), "));
    CHECK_THAT(
        said("-scatter box=0,0,0,1,1,1 count=12 -write target=blender p.vdb p.ply"),
        ContainsSubstring("wrote p.vdb: 12 points (P id), ") && ContainsSubstring("wrote p.ply: 12 points (P id), "));
    CHECK_THAT(said("-noise -noise seed=1 -dfvn -velocity dim=16 staggered=1 density=1 -write grid=0,1 g.vdb"),
               ContainsSubstring("vel (vec3s, staggered, ") && ContainsSubstring(" active voxels in ") &&
                   ContainsSubstring("density (float, "));
    CHECK_THAT(said("-noise -slice width=8 -write s.png"), ContainsSubstring("wrote s.png: 8 x 8 pixels (value), "));
    CHECK_THAT(said("-sphere -write r.json"), ContainsSubstring("wrote r.json: JSON, "));
}

TEST_CASE("file names: two actions that write the same file need overwrite=1", "[app][command]") {
    const Folder folder;
    const std::string first = "-scatter count=5 box=0,0,0,1,1,1 -write a.csv ",
                      second = "-scatter count=7 box=0,0,0,1,1,1 -write a.csv";
    folder.mustFail(first + second, {"a.csv", "also written by -write", "overwrite=1"});
    folder.mustRun(first + second + " overwrite=1");
    CHECK(test::linesOf(test::bytesOf(folder / "a.csv")).size() == 8);
}
