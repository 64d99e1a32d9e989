// SPDX-License-Identifier: Apache-2.0
#include "curlew/picture/ImageFile.h"
#include "support/Catch.h"
#include "support/Command.h"

#include <fmt/format.h>

using namespace curlew;
using test::Folder;
using test::jsonOf;

// docs/scale.md: if an object, a wavelength and a speed are scaled by S, the result is the same, wherever they are.

namespace {

struct Scaled {
    nlohmann::json figures;
    Image points, wall;
};

std::string placed(double scale, double away) { return fmt::format(" offset={},0,0 frequency={}", away, 1.5 / scale); }

std::string ball(double scale, double away) { return fmt::format("-sphere radius={} translate={},0,0", scale, away); }
std::string spot(double scale, double away) {
    return fmt::format("-read '{}/scenes/spot.obj' -move scale={} translate={},0,0 -mesh2ls dim=48", test::sourceDir(),
                       scale, away);
}

Scaled mainJob(const Folder& folder, double scale, double away, std::string (*object)(double, double) = ball) {
    folder.mustRun(
        fmt::format("{3} -noise{2} -noise{2} seed=1 -bound -dfvn speed={0} -velocity dim=32 "
                    "-scatter count=500 seed=7 -advect duration=0.5 -splat width=160 height=120 -write p.exr "
                    "-check samples=1000 report=r.json {3} -shade texture=latitude supersampling=2 width=160 "
                    "height=120 -write w.exr",
                    scale, away, placed(scale, away), object(scale, away)));
    return {jsonOf(folder / "r.json"), readExr(folder / "p.exr"), readExr(folder / "w.exr")};
}

/// Returns the fraction of pixels that differ by more than two of 255 levels.
double different(const Image& a, const Image& b) {
    REQUIRE(a.channels == b.channels);
    const size_t channels = a.channels.size();
    size_t count = 0;
    for (size_t k = 0; k < a.pixels.size(); ++k)
        if (k % channels < 3 && !(std::abs(a.pixels[k] - b.pixels[k]) <= 2 / 255.0F)) ++count;
    return static_cast<double>(count) / static_cast<double>(a.pixels.size());
}

} // namespace

TEST_CASE("scale: the main job gives the same figures and pictures at any scale", "[app]") {
    const Folder folder;
    const auto object = GENERATE(ball, spot);
    const Scaled one = mainJob(folder, 1, 0, object);
    const double scale = GENERATE(1e-3, 180.0);
    const Scaled other = mainJob(folder, scale, 0, object);
    CAPTURE(scale, object == spot);
    const auto figure = [](const Scaled& of, const char* name) {
        return of.figures.at("advect").at(name).get<double>();
    };
    CHECK(other.figures.at("outside") == 0);
    CHECK(other.figures.at("not_converged") == 0);
    CHECK(other.figures.at("wall_flux").get<double>() < 1e-12);
    // Positions of a mesh are float, so rounding decides whether a few of its 9000 steps are taken again.
    const double rounding = object == spot ? 2e-3 : 1e-4;
    CHECK(figure(other, "substeps") == Approx(figure(one, "substeps")).epsilon(rounding));
    CHECK(figure(other, "speed_max") / scale == Approx(figure(one, "speed_max")).epsilon(1e-4));
    for (const char* error : {"error_mean", "error_max"})
        CHECK(figure(other, error) / scale == Approx(figure(one, error)).epsilon(rounding));
    CHECK(other.figures.at("penetration_max").get<double>() / scale ==
          Approx(one.figures.at("penetration_max").get<double>()).epsilon(1e-4).margin(object == spot ? 1e-7 : 0));
    // A voxel whose centre is at the end of the layer may or may not be counted.
    CHECK(other.figures.at("voxels").get<double>() == Approx(one.figures.at("voxels").get<double>()).epsilon(0.01));
    CHECK(different(one.points, other.points) < 1e-3);
    CHECK(different(one.wall, other.wall) < 1e-3);
}

TEST_CASE("scale: the main job gives the same result 100000 units from the origin", "[app]") {
    const Folder folder;
    const Scaled here = mainJob(folder, 180, 0), there = mainJob(folder, 180, 1e5);
    CHECK(there.figures.at("outside") == 0);
    CHECK(there.figures.at("not_converged") == 0);
    CHECK(there.figures.at("wall_flux").get<double>() < 1e-12);
    // Points keep a distance of one float rounding from the wall, 0.008 there. A few of them are therefore drawn again.
    CHECK(there.figures.at("advect").at("substeps").get<double>() ==
          Approx(here.figures.at("advect").at("substeps").get<double>()).epsilon(0.01));
    CHECK(there.figures.at("advect").at("speed_max").get<double>() ==
          Approx(here.figures.at("advect").at("speed_max").get<double>()).epsilon(1e-4));
    CHECK(different(here.points, there.points) < 0.02);
    CHECK(different(here.wall, there.wall) < 1e-3);
}

TEST_CASE("scale: a wall too far from the origin for float positions is refused", "[app][command]") {
    const Folder folder;
    const std::string object = GENERATE("-sphere", "-read spot.obj -mesh2ls dim=32 -move");
    const std::string flow = GENERATE(" -noise -noise seed=1 -bound -dfvn", " -wind");
    CAPTURE(object, flow);
    std::filesystem::copy_file(test::sourceDir() + "/scenes/spot.obj", folder / "spot.obj");
    folder.mustFail(object + " translate=1e6,1e6,1e6" + flow + " -scatter count=10",
                    {"units from the origin", "move it towards the origin"});
    folder.mustRun(object + " translate=1e5,0,0" + flow + " -scatter count=10");
}

TEST_CASE("scale: a mesh of any size can be voxelised and scattered and snapped to and shaded", "[app][command]") {
    const Folder folder;
    const auto coverage = [&](double scale, double away) {
        std::ofstream out(folder / "m.obj");
        std::ifstream in(test::sourceDir() + "/scenes/spot.obj");
        out.precision(12);
        for (std::string line; std::getline(in, line);) {
            std::istringstream words(line);
            std::string kind;
            double x = 0, y = 0, z = 0;
            words >> kind;
            if (kind == "v" && words >> x >> y >> z)
                out << "v " << scale * x + away << ' ' << scale * y << ' ' << scale * z << '\n';
            else if (kind == "f")
                out << line << '\n';
        }
        out.close();
        folder.mustRun(
            "-read m.obj -shade width=160 height=120 -mesh2ls dim=48 -scatter count=300 -snap -scatter "
            "on=surface count=300 -splat width=160 height=120 -write p.png r.json");
        const auto report = jsonOf(folder / "r.json");
        CHECK(report.at("snap").at("missed") == 0);
        CHECK(report.at("splat").at("drawn") == 300);
        return report.at("shade").at("coverage").get<double>();
    };
    const double one = coverage(1, 0);
    CHECK(one > 0.1);
    CHECK(coverage(1e-3, 0) == Approx(one).epsilon(1e-3));
    CHECK(coverage(180, 0) == Approx(one).epsilon(1e-3));
    CHECK(coverage(180, 1e5) == Approx(one).epsilon(1e-3));
}
