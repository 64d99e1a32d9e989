// SPDX-License-Identifier: Apache-2.0
#include "support/Command.h"

#include <catch2/catch.hpp>

using namespace curlew;
using Catch::Matchers::Contains;
using test::Folder;

namespace {

const std::string kFlow = "-noise frequency=2 -noise frequency=2 seed=1 -dfvn speed=1 ";

std::string said(const std::string& arguments) { return Folder().mustRun(arguments).err; }

} // namespace

TEST_CASE("points that are scattered anew in each frame and then advected are warned of", "[app]") {
    const std::string what = "warning: -scatter after -frames";
    CHECK_THAT(said(kFlow + "-frames 1-2 -scatter count=10 -advect -write a.##.ply"), Contains(what));
    CHECK_THAT(said(kFlow + "-scatter count=10 -frames 1-2 -advect -write a.##.ply"), !Contains("warning"));
    CHECK_THAT(said(kFlow + "-frames 1-2 -emit -advect -write a.##.ply"), !Contains("warning"));
    CHECK_THAT(said(kFlow + "-frames 1-2 -scatter count=10 -write a.##.ply"), !Contains("warning"));
}

TEST_CASE("a shape that nothing uses is warned of", "[app]") {
    CHECK_THAT(said("-sphere " + kFlow + "-scatter count=10 -write a.ply"),
               Contains("warning: nothing uses the shape that -sphere makes") && Contains("-bound"));
    CHECK_THAT(said("-sphere -scatter count=10 -write a.ply"), !Contains("warning"));
    CHECK_THAT(said("-sphere -print"), !Contains("warning"));
}

TEST_CASE("a grid with fewer than four voxels to a wavelength is warned of, with a size that has them", "[app]") {
    const std::string coarse = said(kFlow + "-velocity voxel=0.25 -write v.vdb");
    CHECK_THAT(coarse, Contains("warning: the flow varies over a wavelength of 0."));
    const size_t at = coarse.find("voxel=");
    REQUIRE(at != std::string::npos);
    const std::string advised = coarse.substr(at, coarse.find(' ', at) - at);
    CHECK_THAT(said(kFlow + "-velocity " + advised + " -write v.vdb"), !Contains("wavelength"));
    CHECK_THAT(said(kFlow + "-velocity -write v.vdb"), !Contains("warning"));
}

TEST_CASE("a layer wider than its object, and points that all are in the wall, are warned of", "[app]") {
    const std::string bound = "-sphere radius=0.3 -noise frequency=2 -noise frequency=2 seed=1 -bound side=outside ";
    CHECK_THAT(said(bound + "width=1 -dfvn -scatter count=10 -write a.ply"), Contains("wider than the object, 0.6"));
    CHECK_THAT(said(bound + "width=0.2 -dfvn -scatter count=10 -write a.ply"), !Contains("warning"));
    CHECK_THAT(said(bound + "width=0.2 -dfvn -scatter box=-0.1,-0.1,-0.1,0.1,0.1,0.1 domain=none count=10 -advect "
                            "time=0.1 -write a.ply"),
               Contains("all 10 points are on the wrong side"));
}
