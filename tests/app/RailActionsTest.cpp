// SPDX-License-Identifier: Apache-2.0
#include "support/ProbeCommand.h"

#include <fstream>

using namespace curlew;
using namespace curlew::test;
using Catch::Matchers::ContainsSubstring;

namespace {

/// An open curve of four points, and a square that is closed.
void writeCurves(const Folder& folder) {
    std::ofstream(folder / "path.obj") << "# drawn\nv -1 0 0\nv -0.3 0.4 0.2\nv 0.3 -0.2 0\nv 1 0.2 0.1\nl 1 2 3 4\n";
    std::ofstream(folder / "loop.obj") << "v 1 0 0\nv 0 1 0\nv -1 0 0\nv 0 -1 0\nl 1 2 3 4 1\n";
    std::ofstream(folder / "path.csv") << "curve,x,y,z\n0,-1,0,0\n0,-0.3,0.4,0.2\n0,0.3,-0.2,0\n0,1,0.2,0.1\n";
}

} // namespace

TEST_CASE("rail action: particles stay in the tube, for long steps, with turns and with noise", "[app][command]") {
    const Folder folder;
    writeCurves(folder);
    const std::string check = "-check samples=10000 report=check.json -check samples=10000 strict=1";
    folder.mustRun("-read loop.obj -rail radius=0.2 twist=0.3 -scatter count=300 -advect duration=8 steps=8 " + check);
    CHECK(jsonOf(folder / "check.json")["outside"] == 0);
    CHECK(jsonOf(folder / "check.json")["divergence_free"] == true);
    CHECK(jsonOf(folder / "check.json")["drift_f"].get<double>() < 1e-6);
    // With noise that is bound to the tube.
    folder.mustRun(
        "-read loop.obj -rail radius=0.2 tubes=1 as=along -noise frequency=5 -noise frequency=5 seed=1 -bound "
        "wall=along.tubes layer=0.05 -dfvn speed=0.5 as=swirls -superpose first=along second=swirls -scatter count=100 "
        "-advect duration=2 steps=40 -check samples=10000 report=check.json");
    CHECK(jsonOf(folder / "check.json")["outside"] == 0);
    // Several rails, blended.
    folder.mustRun("-read path.obj -rail radius=0.1 profile=smooth -velocity dim=24 -write v.vdb");
}

TEST_CASE("rail action: curves come from .obj, .ply, .csv or -trace, and are the same", "[app][command]") {
    const Folder folder;
    writeCurves(folder);
    std::ofstream(folder / "points.csv") << "x,y,z\n-0.9,0.05,0\n0,0.1,0.05\n0.6,0,0\n";
    for (const char* file : {"path.obj", "path.csv"})
        folder.mustRun(fmt::format("-read {0} -rail radius=0.1 -probe points.csv {0}.values", file));
    // Numbers of an .obj may be off by 2 units in the last place.
    const Table obj = tableOf(folder / "path.obj.values"), csv = tableOf(folder / "path.csv.values");
    REQUIRE(obj.rows.size() == 3);
    for (size_t k = 0; k < 3; ++k)
        for (size_t column = 0; column < obj.rows[k].size(); ++column)
            CHECK(obj.rows[k][column] == Approx(csv.rows[k][column]).margin(1e-12));
    // Curves that we wrote can be read again.
    folder.mustRun(
        "-vortex -scatter count=3 box=0.3,-0.1,-0.1,0.5,0.1,0.1 -trace maxLength=1 -write traced.obj traced.ply "
        "traced.csv");
    for (const char* file : {"traced.obj", "traced.ply", "traced.csv"}) {
        const auto run = folder.mustRun(fmt::format("-read {} -rail radius=0.02 profile=smooth -print", file));
        CHECK_THAT(run.err, ContainsSubstring("3 curves"));
        CHECK_THAT(run.out, ContainsSubstring("sum of 3"));
    }
}

TEST_CASE("rail action: unsuitable curves and damaged files are errors", "[app][command]") {
    const Folder folder;
    writeCurves(folder);
    folder.mustFail("-read path.obj -rail radius=3", {"radius 3", "bend"});
    folder.mustFail("-read loop.obj -rail speed=0", {"speed"});
    folder.mustFail("-rail", {"-rail", "curves"});
    std::ofstream(folder / "bad.obj") << "v 0 0 0\nv 1 0 0\nl 1 7\n";
    folder.mustFail("-read bad.obj", {"bad.obj", "line 3", "'7'"});
    std::ofstream(folder / "nan.obj") << "v 0 0 nan\nv 1 0 0\nl 1 2\n";
    folder.mustFail("-read nan.obj", {"line 1", "finite"});
    std::ofstream(folder / "bad.csv") << "curve,x,y\n0,1,2\n";
    folder.mustFail("-read bad.csv", {"bad.csv", "no z"});
    std::ofstream(folder / "half.csv") << "curve,x,y,z\n0.5,1,2,3\n";
    folder.mustFail("-read half.csv", {"0.5", "integer"});
}
