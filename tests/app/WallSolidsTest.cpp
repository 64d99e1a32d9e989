// SPDX-License-Identifier: Apache-2.0
#include "support/Command.h"
#include "support/Meshes.h"

#include <fmt/format.h>

using namespace curlew;
using namespace curlew::test;
using Catch::Matchers::ContainsSubstring;

namespace {

const std::string kNoises = "-noise frequency=2 -noise frequency=2 seed=1 ";
const std::string kFlow = kNoises + "-bound side=outside layer=0.2 -dfvn speed=1 ";
const std::string kCheck = "-check samples=200 report=check.json ";

/// A plate that is two units wide and `thickness` thick.
Mesh plate(float thickness) {
    Mesh mesh;
    for (int k = 0; k < 8; ++k)
        mesh.points.emplace_back(k & 1 ? 1.f : -1.f, (k & 2 ? 0.5f : -0.5f) * thickness, k & 4 ? 1.f : -1.f);
    mesh.quads = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
    return mesh;
}

/// Runs a program that ends with -check, and returns its report.
nlohmann::json checked(const Folder& folder, const std::string& program) {
    folder.mustRun(program + kCheck);
    return jsonOf(folder / "check.json");
}

} // namespace

TEST_CASE("check: counts points inside the mesh of the wall", "[app][command]") {
    const Folder folder;
    writeMesh(folder / "ball.ply", ball(4));
    const std::string points = "-scatter count=3000 -advect duration=1 steps=10 ";
    const Outcome outcome = folder.mustRun("-read ball.ply -mesh2ls dim=40 " + kFlow + points + kCheck);
    const auto report = jsonOf(folder / "check.json");
    CHECK(report.at("outside") == 0);
    CHECK(report.at("mesh_outside").get<int>() < 30);
    CHECK(report.at("mesh_depth_max_voxels").get<double>() < 0.1);
    CHECK(report.at("mesh_depth_max").get<double>() ==
          Approx(report.at("mesh_depth_max_voxels").get<double>() * 2 / 40).epsilon(1e-6));
    CHECK_THAT(outcome.err, ContainsSubstring("0 on the wrong side of the wall") && !ContainsSubstring("warning"));
    // Points in the mesh are on the wrong side of both.
    const auto within = checked(folder, "-read ball.ply -mesh2ls dim=40 " + kFlow +
                                            "-scatter count=100 domain=none box=-0.5,-0.5,-0.5,0.5,0.5,0.5 ");
    CHECK(within.at("outside") == 100);
    CHECK(within.at("mesh_outside") == 100);
    CHECK(within.at("mesh_depth_max") > within.at("penetration_max")); // the level set ends with its band
}

TEST_CASE("check: warns of points in a film that the level set lacks", "[app][command]") {
    const Folder folder;
    writeMesh(folder / "plate.ply", together(moved(plate(0.03f), {0, 0.03f, 0}), moved(ball(3), {0, 3, 0})));
    const std::string program = "-read plate.ply -mesh2ls voxel=0.1 " + kFlow +
                                "-scatter count=2000 box=-0.9,0.02,-0.9,0.9,0.04,0.9 domain=none ";
    const Outcome outcome = folder.mustRun(program + kCheck);
    const auto report = jsonOf(folder / "check.json");
    CHECK(report.at("mesh_outside") == 2000);
    CHECK(report.at("mesh_depth_max").get<double>() == Approx(0.015).epsilon(0.01));
    CHECK_THAT(outcome.err, ContainsSubstring("thin parts: ") && ContainsSubstring("voxel=0.01 is enough"));
    CHECK_THAT(outcome.err, !ContainsSubstring("wrong side of the wall's mesh")); // 0.15 voxels
}

TEST_CASE("check: a wall more than half a voxel off its mesh violates the guarantee", "[app][command]") {
    // A wall that is the spline of one level set, and points that were put beyond it.
    const Folder folder;
    writeMesh(folder / "ball.ply", ball(4));
    const std::string program =
        "-read ball.ply -mesh2ls dim=40 " + kFlow + "-scatter count=50 domain=none box=-0.1,-0.1,-0.1,0.1,0.1,0.1 ";
    CHECK_THAT(folder.mustRun(program + kCheck).err, ContainsSubstring("50 of 50 points are on the wrong side of the "
                                                                       "wall's mesh"));
    folder.mustFail(program + "-check samples=500 strict=1", {"-check", "wrong side of the wall's mesh"});
}

TEST_CASE("check: the mesh moves with its level set and unions keep it", "[app][command]") {
    const auto [name, wall] = GENERATE(table<std::string, std::string>(
        {{"moved", "-read ball.ply -mesh2ls dim=30 -move translate=3,1,0 rotate=10,20,30 scale=0.5 " + kFlow},
         {"union", "-read ball.ply -mesh2ls dim=30 -read ball.ply -move translate=1,0,0 -union " + kFlow},
         {"several walls", "-read ball.ply -mesh2ls dim=30 -read ball.ply -move translate=4,0,0 -mesh2ls dim=30 " +
                               kNoises + "-bound grid=0,1 side=outside layer=0.2 -dfvn speed=1 "},
         {"sheet", "-read sheet.ply -mesh2ls dim=30 thickness=0.3 " + kFlow},
         {"wind", "-read ball.ply -mesh2ls dim=30 -wind speed=1 "},
         {"inside", "-read ball.ply -mesh2ls dim=30 " + kNoises + "-bound -dfvn speed=1 "},
         {"not the newest",
          "-read ball.ply -mesh2ls dim=30 as=hull -read ball.ply -move translate=4,0,0 -mesh2ls dim=30 " + kNoises +
              "-bound wall=hull layer=0.2 -dfvn speed=1 "}}));
    CAPTURE(name);
    const Folder folder;
    writeMesh(folder / "ball.ply", ball(3));
    writeMesh(folder / "sheet.ply", plane(2, 8));
    const auto report = checked(folder, wall + "-scatter count=300 -advect duration=0.3 steps=3 ");
    REQUIRE(report.contains("mesh_outside"));
    CHECK(report.at("outside") == 0);
    CHECK(report.at("mesh_depth_max_voxels").get<double>() < 0.5);
}

TEST_CASE("check: without a mesh, no mesh figures are reported", "[app][command]") {
    const Folder folder;
    writeMesh(folder / "ball.ply", ball(3));
    const std::string points = "-scatter count=50 ";
    CHECK_FALSE(checked(folder, "-sphere " + kFlow + points).contains("mesh_outside"));
    CHECK_FALSE(checked(folder, "-read ball.ply -mesh2ls dim=30 -sphere radius=0.5 translate=1,0,0 -difference " +
                                    kFlow + points)
                    .contains("mesh_outside"));
}

TEST_CASE("check: counts curve vertices inside the mesh", "[app][command]") {
    const Folder folder;
    writeMesh(folder / "ball.ply", ball(4));
    const auto report =
        checked(folder, "-read ball.ply -mesh2ls dim=30 " + kFlow + "-scatter count=100 -trace maxLength=1 ");
    CHECK(report.at("curves_vertices").get<int>() > 500);
    CHECK(report.at("curves_outside") == 0);
    CHECK(report.at("curves_mesh_depth_max_voxels").get<double>() < 0.5);
}

TEST_CASE("check: uses the pose of the mesh in the current frame", "[app][command]") {
    const Folder folder;
    writeMesh(folder / "ball.ply", ball(3));
    folder.mustRun(kNoises +
                   "-frames 1-3 -read ball.ply -move 'translate={T*3},0,0' -mesh2ls dim=20 "
                   "-bound side=outside layer=0.3 -dfvn speed=1 -emit rate=5000 -advect " +
                   "-check samples=200 'report=check.$F.json'");
    for (const std::string frame : {"2", "3"}) {
        const auto report = jsonOf(folder / ("check." + frame + ".json"));
        REQUIRE(report.contains("mesh_outside"));
        CHECK(report.at("points").get<int>() > 100);
        CHECK(report.at("mesh_depth_max_voxels").get<double>() < 0.5);
    }
}

TEST_CASE("mesh2ls: warns of filled shells and thin parts and refuses objects that are too far away",
          "[app][command]") {
    const Folder folder;
    Mesh inner = ball(3);
    for (auto& p : inner.points) p *= 0.5f;
    writeMesh(folder / "filled.ply", together(ball(3), inner));
    writeMesh(folder / "hollow.ply", together(ball(3), flipped(inner)));
    const auto said = [&](const std::string& arguments) { return folder.mustRun(arguments + " -report r.json").err; };
    CHECK_THAT(
        said("-read filled.ply -mesh2ls dim=40"),
        ContainsSubstring("1 closed shell inside the solid is filled") && ContainsSubstring("512 faces, volume 0.5"));
    CHECK(jsonOf(folder / "r.json")["mesh2ls"]["filled_shells"] == 1);
    CHECK_THAT(said("-read hollow.ply -mesh2ls dim=40"), !ContainsSubstring("warning"));
    Mesh patched = ball(3);
    std::swap(patched.triangles[5][0], patched.triangles[5][1]);
    writeMesh(folder / "patched.ply", patched);
    CHECK_THAT(said("-read patched.ply -mesh2ls dim=40"),
               ContainsSubstring("mesh: 1 triangle runs against its neighbours"));
    CHECK(jsonOf(folder / "r.json")["mesh2ls"]["reversed_faces"] == 1);
    // A closed mesh has no holes to close, however thin it is.
    writeMesh(folder / "thin.ply", plate(0.1f));
    const std::string thin = said("-read thin.ply -mesh2ls voxel=0.08");
    CHECK_THAT(thin, ContainsSubstring("thinner than 3 voxels") && ContainsSubstring("voxel=0.033 is enough") &&
                         !ContainsSubstring("holes"));
    CHECK_THAT(said("-read thin.ply -mesh2ls voxel=0.033"), !ContainsSubstring("warning"));
    // Far thinner than a voxel, as folds are.
    writeMesh(folder / "folds.ply", plate(0.002f));
    CHECK_THAT(said("-read folds.ply -mesh2ls voxel=0.08"),
               ContainsSubstring("voxel=0.00066 is enough for the thinnest, but folds of a noisy scan"));
    writeMesh(folder / "far.ply", moved(ball(3), {1e6f, 0, 0}));
    folder.mustFail("-read far.ply -mesh2ls dim=100", {"-mesh2ls", "from the origin", "move it to the origin"});
    // A level set far away is exact, since its transform is double; its mesh is not kept.
    const auto far = checked(folder, "-read hollow.ply -mesh2ls dim=40 halfWidth=9 -move translate=3e5,0,0 " + kFlow +
                                         "-scatter count=100 -advect duration=0.3 steps=3 ");
    CHECK(far.at("outside") == 0);
    CHECK_FALSE(far.contains("mesh_outside"));
}

TEST_CASE("mesh2ls: warns if dim= gives frames different voxels", "[app][command]") {
    const Folder folder;
    const auto grown = [&](float size) {
        Mesh mesh = ball(2);
        for (auto& p : mesh.points) p *= size;
        return mesh;
    };
    for (int frame = 1; frame <= 4; ++frame)
        writeMesh(folder / fmt::format("ball.{}.ply", frame), grown(1 + 0.04f * static_cast<float>(frame)));
    const auto said = [&](const std::string& option) {
        return folder.mustRun("-frames 1-4 -read 'ball.$F.ply' -mesh2ls " + option).err;
    };
    const std::string warned = said("dim=26");
    CHECK_THAT(warned, ContainsSubstring("dim= gives voxels of 0.0831 in this frame, 0.08 in the first") &&
                           ContainsSubstring("voxel=0.08 gives all frames the same"));
    CHECK(warned.find("dim= gives") == warned.rfind("dim= gives"));
    CHECK_THAT(said("voxel=0.08"), !ContainsSubstring("warning"));
}

TEST_CASE("superpose action: warns once of a flow that crosses the other's wall", "[app][command]") {
    const Folder folder;
    const auto count = [](const std::string& text, const std::string& what) {
        size_t found = 0;
        for (size_t at = text.find(what); at != std::string::npos; at = text.find(what, at + 1)) ++found;
        return found;
    };
    const std::string bound = "-sphere " + kFlow;
    const Outcome crossing =
        folder.mustRun(bound + "-updraft -superpose -print -scatter count=50 -advect duration=0.1 steps=2");
    CHECK(count(crossing.err, "warning") == 1);
    CHECK_THAT(crossing.err, ContainsSubstring("the newer flow crosses the wall of the other"));
    CHECK_THAT(crossing.out, ContainsSubstring("domain: outside a wall"));
    CHECK_THAT(folder.mustRun("-updraft " + bound + "-superpose").err, ContainsSubstring("the older flow crosses"));
    CHECK(count(folder.mustRun(bound + "-wind -superpose").err, "warning") == 0);
    CHECK(count(folder.mustRun(kNoises + "-dfvn -updraft -superpose").err, "warning") == 0);
}

TEST_CASE("velocity action: judges the voxels by the wavelength only if the velocity is used", "[app][command]") {
    const Folder folder;
    const std::string flow = "-sphere " + kNoises + "-bound -dfvn speed=1 -velocity voxel=0.25 density=1 ";
    CHECK_THAT(folder.mustRun(flow + "-write grid=1 density.vdb").err, !ContainsSubstring("the flow's wavelength"));
    CHECK_THAT(folder.mustRun(flow + "-write velocity.vdb").err, ContainsSubstring("the flow's wavelength"));
    CHECK_THAT(folder.mustRun(flow + "-write grid=0,1 both.vdb").err, ContainsSubstring("the flow's wavelength"));
}

TEST_CASE("shade action: draws into pictures that have a camera and depth", "[app][command]") {
    const Folder folder;
    const std::string size = "width=48 height=36 ";
    folder.mustRun("-sphere -scatter count=100 -splat look=opaque " + size + "-torus -shade over=1 -write both.png");
    const std::vector<std::string> parts{"-shade", "over=1", "camera and depth", "-splat look=opaque"};
    folder.mustFail("-noise dim=2 -slice width=16 -sphere -shade over=1", parts);
    folder.mustFail("-sphere -scatter count=9 -splat " + size + "-torus -shade over=1", parts);
}
