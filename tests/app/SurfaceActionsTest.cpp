// SPDX-License-Identifier: Apache-2.0
#include "curlew/picture/ImageFile.h"
#include "support/Command.h"

#include <fmt/format.h>

using namespace curlew;
using test::bytesOf;
using test::Folder;
using test::jsonOf;

namespace {

const std::string kSmall = " width=64 height=48 samples=2 ";

} // namespace

TEST_CASE("shade action: a shape and an isosurface of the same ball look the same", "[app][command]") {
    const Folder folder;
    const std::string shade = "-shade eye=0,0,4" + kSmall;
    folder.mustRun("-sphere radius=0.8 " + shade + "-write shape.exr shape.json");
    folder.mustRun("-sphere radius=1 " + shade + "iso=-0.2 -write iso.exr");
    const Image shape = readExr(folder / "shape.exr"), iso = readExr(folder / "iso.exr");
    REQUIRE(shape.channels == std::vector<std::string>{"R", "G", "B", "A", "Z"});
    double worst = 0;
    for (size_t k = 0; k < shape.pixels.size(); ++k)
        if (std::isfinite(shape.pixels[k]))
            worst = std::max(worst, static_cast<double>(std::abs(shape.pixels[k] - iso.pixels[k])));
    CHECK(worst < 1e-5);
    // The radius in the picture is f tan(asin(r / d)) = 20.7 pixels.
    CHECK(jsonOf(folder / "shape.json")["shade"]["coverage"].get<double>() == Approx(0.438).epsilon(0.01));
}

TEST_CASE("shade action: frames are framed one by one, and it says so once", "[app][command]") {
    const Folder folder;
    const auto said = [&](const std::string& frames, const std::string& options) {
        return folder
            .mustRun("-frames " + frames + " -sphere 'translate={T},0,0' 'radius=0.5' -shade " + options + kSmall +
                     "-write 's.$F.png'")
            .err;
    };
    const std::string moves = said("1-4 fps=4", "");
    CHECK_THAT(moves, Catch::ContainsSubstring("the camera moves with the surface"));
    CHECK(moves.find("the camera moves") == moves.rfind("the camera moves"));
    const std::string last = bytesOf(folder / "s.4.png");
    said("4-4 fps=4 start=1", ""); // on its own, a frame has the same bytes
    CHECK(bytesOf(folder / "s.4.png") == last);
    CHECK_THAT(said("1-4 fps=4", "viewBox=-1,-1,-1,2,1,1"), !Catch::ContainsSubstring("the camera moves"));
    CHECK_THAT(said("1-4 fps=4", "eye=0,0,5"), !Catch::ContainsSubstring("the camera moves"));
}

TEST_CASE("shade action: a mesh looks like its level set, but keeps its edges", "[app][command]") {
    const Folder folder;
    const std::string spot = "-read " + test::sourceDir() + "/scenes/spot.obj ",
                      camera = "eye=-2,1,-3 aim=0,0,0" + kSmall;
    folder.mustRun(spot + "-shade " + camera + "-write mesh.exr mesh.json");
    folder.mustRun(spot + "-shade dim=192 " + camera + "-write levelset.exr levelset.json");
    const auto coverage = [&](const std::string& name) {
        return jsonOf(folder / name)["shade"]["coverage"].get<double>();
    };
    CHECK(coverage("mesh.json") > 0.1);
    CHECK(coverage("mesh.json") == Approx(coverage("levelset.json")).epsilon(0.02));
    CHECK(test::bytesOf(folder / "mesh.exr") != test::bytesOf(folder / "levelset.exr"));
    // A quad is not a solid. It covers a quarter of the width and a third of the height of the picture.
    test::store(folder / "quad.obj", "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nf 1 2 3 4\n");
    folder.mustRun("-read quad.obj -shade eye=0,0,8 aim=0,0,0 fov=53.13010235" + kSmall + "-write quad.exr quad.json");
    CHECK(coverage("quad.json") == Approx(1.0 / 12).epsilon(0.02));
}

TEST_CASE("shade action: pictures do not depend on threads or instruction set", "[app][command]") {
    const Folder folder;
    const std::string program = "-torus -noise frequency=3 -shade show=value" + kSmall;
    folder.mustRun("-threads 1 " + program + "-write one.exr");
    folder.mustRun("-threads 3 " + program + "-write three.exr");
    folder.shell("CURLEW_SIMD=scalar curlew " + program + "-write scalar.exr");
    CHECK(test::bytesOf(folder / "one.exr") == test::bytesOf(folder / "three.exr"));
    CHECK(test::bytesOf(folder / "one.exr") == test::bytesOf(folder / "scalar.exr"));
}

TEST_CASE("shade action: over=1 draws one surface into another picture", "[app][command]") {
    const Folder folder;
    folder.mustRun("-torus -shade eye=0,1,4 aim=0,0,0" + kSmall +
                   "-sphere radius=0.3 -shade over=1 -sphere radius=0.9 -shade over=1 rimOnly=1 -write all.exr");
    CHECK(readExr(folder / "all.exr").width == 64);
    folder.mustFail("-noise dimensions=2 -slice width=16 -sphere -shade over=1", {"-shade", "camera"});
    folder.mustFail("-sphere -shade over=1", {"-shade", "image"});
    folder.mustFail("-noise -shade", {"-shade", "iso="});
    folder.mustFail("-plane -shade", {"infinite"});
    folder.mustFail("-sphere -shade show=value", {"a field", "none"});
    folder.mustFail("-sphere -shade show=speed", {"a flow", "none"});
    folder.mustFail("-sphere -shade duration=1", {"a flow", "none"});
    folder.mustFail("-sphere -shade texture=lic", {"a flow", "none"});
    folder.mustFail("-sphere -noise -shade show=value texture=checker", {"cannot be combined"});
    folder.mustFail("-sphere -shade light=0,0,0", {"-shade", "light=0,0,0", "direction"});
    folder.mustFail("-sphere -shade color=255,0,0", {"-shade", "color", "255", "0 and 1"});
    folder.mustFail("-sphere -shade texture=film film=-1,2", {"film"});
    folder.mustFail("-sphere -shade color=-1,0,0", {"color"});
    folder.mustFail("-sphere -shade supersampling=0", {"supersampling"});
    folder.mustFail("-shade iso=0", {"a field", "none"});
}

TEST_CASE("shade action: a flow carries a texture over a surface", "[app][command]") {
    const Folder folder;
    // The flow rotates about the y axis by 2 f' g' t. This maps bands of latitude to themselves, but not a checker
    // texture.
    const std::string turning =
        "-sphere -ramp -surface speed=1 -shade eye=0,0,4 shadow=0 supersampling=1 width=48 height=36 ";
    for (const char* texture : {"latitude", "checker edge=0.3"}) {
        CAPTURE(texture);
        folder.mustRun(turning + "texture=" + texture + " -write still.exr");
        folder.mustRun(turning + "texture=" + texture + " duration=0.7 steps=8 -write moved.exr moved.json");
        const Image still = readExr(folder / "still.exr"), moved = readExr(folder / "moved.exr");
        double worst = 0;
        for (size_t k = 0; k < still.pixels.size(); ++k)
            if (std::isfinite(still.pixels[k]))
                worst = std::max(worst, static_cast<double>(std::abs(still.pixels[k] - moved.pixels[k])));
        if (std::string(texture) == "latitude")
            CHECK(worst < 1e-4);
        else
            CHECK(worst > 0.1);
        CHECK(jsonOf(folder / "moved.json")["shade_carried"]["not_converged"] == 0);
    }
    folder.mustRun("-sphere -noise -surface -shade texture=lic show=speed" + kSmall + "-write lic.png");
    folder.mustRun("-sphere -shade texture=film" + kSmall + "-write film.png");
}
