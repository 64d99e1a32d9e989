// SPDX-License-Identifier: Apache-2.0
// Walls from meshes that move from frame to frame.
#include "curlew/math/Rotation.h"
#include "curlew/vdb/Openvdb.h"
#include "support/SessionCommand.h"

using namespace curlew;
using namespace curlew::app;
using namespace curlew::test;

namespace {

constexpr double kTurn = 0.3; // radians a frame
/// Sampling rounds off the edges of the bar, so a point may pass them by a quarter of a voxel (dim=80 for a length of
/// 1).
constexpr double kRounded = 0.25 / 80;
const Vec3d kHalf{{0.5, 0.03, 0.03}};

/// A bar that rotates about z. It bends too if it is not rigid.
std::shared_ptr<const Mesh> bar(double frame, double bend, bool sameFaces) {
    Mesh mesh;
    const Matrix3 turn = rotationBy({{0, 0, kTurn * (frame - 1)}});
    constexpr int kParts = 20;
    for (int i = 0; i <= kParts; ++i)
        for (const auto& [y, z] : {std::pair(-1, -1), std::pair(1, -1), std::pair(1, 1), std::pair(-1, 1)}) {
            const double s = 2.0 * i / kParts - 1;
            const Vec3d p = turn * Vec3d{{s * kHalf[0], y * kHalf[1] + bend * s * s * (frame - 1), z * kHalf[2]}};
            mesh.points.emplace_back(openvdb::Vec3s(openvdb::Vec3d(p[0], p[1], p[2])));
        }
    for (unsigned i = 0; i < kParts; ++i)
        for (unsigned k = 0; k < 4; ++k) {
            const unsigned a = 4 * i + k, b = 4 * i + (k + 1) % 4;
            mesh.quads.emplace_back(a, b, b + 4, a + 4);
        }
    mesh.quads.emplace_back(3, 2, 1, 0);
    mesh.quads.emplace_back(4 * kParts, 4 * kParts + 1, 4 * kParts + 2, 4 * kParts + 3);
    if (!sameFaces && static_cast<int>(frame) % 2 == 0) std::swap(mesh.quads.front(), mesh.quads.back());
    return std::make_shared<const Mesh>(std::move(mesh));
}

/// Transforms a position to coordinates in which the bar of the given frame lies along x.
Vec3d inBar(const Vec3d& p, double frame, double bend) {
    Vec3d q = rotationBy({{0, 0, -kTurn * (frame - 1)}}) * p;
    q[1] -= bend * (q[0] * q[0] / (kHalf[0] * kHalf[0])) * (frame - 1);
    return q;
}

bool inside(const Vec3d& q, double depth) {
    return std::abs(q[0]) < kHalf[0] - depth && std::abs(q[1]) < kHalf[1] - depth && std::abs(q[2]) < kHalf[2] - depth;
}

/// Returns whether the segment passes through the middle of the bar. The segment of a point that goes round an edge of
/// the bar may cut that edge.
bool through(const Vec3d& a, const Vec3d& b) {
    for (int k = 0; k <= 20; ++k)
        if (const Vec3d q = a + (b - a) * (k / 20.0); inside(q * 2.0, 0)) return true;
    return false;
}

const std::string kAround =
    "noise frequency=2\nnoise frequency=2 seed=1\nbound side=outside layer=0.08\n"
    "dfvn box=-0.7,-0.7,-0.2,0.7,0.7,0.2\n";

/// Counts of points near the bar, at all moments.
struct Fate {
    size_t inside = 0, passed = 0, points = 0, moments = 0;
    double deepest = 0; ///< World units.
};

double depthOf(const Vec3d& q) {
    return std::min({kHalf[0] - std::abs(q[0]), kHalf[1] - std::abs(q[1]), kHalf[2] - std::abs(q[2])});
}

Fate pointsAbout(Scenes& scenes, double bend, bool sameFaces,
                 const std::string& frames = "frames 1-3 fps=400 substeps=4\n", size_t count = 2000) {
    for (int f = 1; f <= 5; ++f)
        scenes.session.provide(
            "bar" + std::to_string(f), bar(f, bend, sameFaces),
            DigestBuilder().add(f).add(bend).add(std::string_view(sameFaces ? "same" : "other")).digest());
    Fate outcome;
    scenes.session.onFrame = [&](int frame) {
        if (frame == 1) return;
        const auto curves = std::get<CurvesPointer>(valueOf(scenes.session, Kind::curves));
        for (size_t c = 0; c < curves->size(); ++c) {
            const size_t first = curves->start[c], parts = curves->start[c + 1] - first - 1;
            Vec3d last;
            for (size_t k = 0; k <= parts; ++k) {
                const double at = frame - 1 + static_cast<double>(k) / static_cast<double>(parts);
                const Vec3d q = inBar(curves->position(first + k), at, bend);
                outcome.inside += inside(q, kRounded);
                outcome.deepest = std::max(outcome.deepest, depthOf(q));
                ++outcome.moments;
                if (k > 0) outcome.passed += through(last, q);
                last = q;
            }
        }
        outcome.points = curves->size();
    };
    scenes.run("read bar1\nmesh2ls dim=80\n" + kAround + fmt::format("scatter count={}\n", count) + frames +
               "read bar$F\nmesh2ls dim=80\n" + kAround + "advect pathlines=1");
    return outcome;
}

} // namespace

TEST_CASE("moving mesh: no point passes a thin bar that turns farther than its thickness", "[app]") {
    Scenes scenes;
    const Fate rigid = pointsAbout(scenes, 0, true);
    CHECK(rigid.points == 2000);
    CHECK(rigid.inside == 0);
    CHECK(rigid.passed == 0);
    CHECK(scenes.session.report["advect"]["outside"] == 0);
    CHECK(scenes.session.report["advect"]["overrun"] == 0);
}

TEST_CASE("moving mesh: no point passes a thin bar that bends while it turns", "[app]") {
    Scenes scenes;
    const Fate bent = pointsAbout(scenes, 0.02, true, "frames 1-2 fps=400 substeps=4\n");
    CHECK(bent.points == 2000);
    CHECK(bent.inside == 0);
    CHECK(bent.passed == 0);
}

// The figures of docs/meshes.md; run with the name of this test.
TEST_CASE("moving mesh: counts of 60000 points around a bar at 16 moments per frame", "[.][app]") {
    for (const double bend : {0.0, 0.02}) {
        Scenes scenes;
        const Fate fate = pointsAbout(scenes, bend, true, "frames 1-4 fps=24 substeps=16\n", 60000);
        WARN(fmt::format(
            "{}: {} positions, {} inside by more than a quarter of a voxel, the deepest by {:.2f} voxels, {} "
            "passed through",
            bend == 0 ? "rigid" : "bending", fate.moments, fate.inside, fate.deepest * 80, fate.passed));
        CHECK(fate.passed == 0);
    }
}

TEST_CASE("moving mesh: warns if the wall moves too far between frames of unmatched meshes", "[app]") {
    std::vector<std::string> warnings;
    Console console(Listener{.info = [&](std::string_view line) {
        if (line.find("% of the wall moves farther than") != std::string_view::npos) warnings.emplace_back(line);
    }});
    Scenes scenes({}, console);
    pointsAbout(scenes, 0, false);
    CHECK(warnings.size() == 1);
    warnings.clear();
    Scenes known({}, console);
    pointsAbout(known, 0, true);
    CHECK(warnings.empty());
}

namespace {

constexpr double kShear = 1.5; // per second

/// A bar along x whose points move along x by kShear y t, so that its faces above and below slide along themselves.
std::shared_ptr<const Mesh> shearingBar(double t) {
    Mesh mesh;
    constexpr int kParts = 12;
    for (int i = 0; i <= kParts; ++i)
        for (const auto& [y, z] : {std::pair(-1, -1), std::pair(1, -1), std::pair(1, 1), std::pair(-1, 1)}) {
            const double x = 2.0 * i / kParts - 1;
            mesh.points.emplace_back(openvdb::Vec3s(openvdb::Vec3d(0.6 * x + kShear * 0.2 * y * t, 0.2 * y, 0.2 * z)));
        }
    for (unsigned i = 0; i < kParts; ++i)
        for (unsigned k = 0; k < 4; ++k) {
            const unsigned a = 4 * i + k, b = 4 * i + (k + 1) % 4;
            mesh.quads.emplace_back(a, b, b + 4, a + 4);
        }
    mesh.quads.emplace_back(3, 2, 1, 0);
    mesh.quads.emplace_back(4 * kParts, 4 * kParts + 1, 4 * kParts + 2, 4 * kParts + 3);
    return std::make_shared<const Mesh>(std::move(mesh));
}

} // namespace

TEST_CASE("moving mesh: a surface that slides along itself carries the air beside it", "[app]") {
    Scenes scenes;
    for (int f = 1; f <= 4; ++f)
        scenes.session.provide("bar" + std::to_string(f), shearingBar(f / 24.0),
                               DigestBuilder().add(f).add(std::string_view("shear")).digest());
    openvdb::GridBase::ConstPtr first, last;
    PointsPointer points;
    scenes.session.onFrame = [&](int) {
        last = std::get<GridValue>(valueOf(scenes.session, Kind::velocity)).grid;
        if (!first) first = last;
        points = std::get<PointsPointer>(valueOf(scenes.session, Kind::points));
    };
    // The air is at rest except for what the wall adds.
    const std::string around = "noise\nnoise seed=1\nbound side=outside width=0.15\ndfvn speed=1e-6 padding=0.3\n";
    scenes.run("read bar1\nmesh2ls voxel=0.02\n" + around + "scatter count=3000\nframes 1-3 fps=24\nread bar$F\n" +
               "mesh2ls voxel=0.02\n" + around + "advect\nvelocity voxel=0.02");
    REQUIRE(last);
    for (const auto& made : {first, last}) {
        const auto grid = openvdb::gridConstPtrCast<openvdb::Vec3SGrid>(made);
        for (const int side : {-1, 1})
            for (const int i : {-10, 0, 10}) { // at the middle of the face and 0.2 away from it
                const auto v = grid->tree().getValue({i, side * 10, 0});
                CAPTURE(made == first, side, i);
                CHECK(static_cast<double>(v[0]) == Approx(side * 0.2 * kShear).epsilon(0.03));
                CHECK(std::abs(v[1]) < 0.03f);
            }
    }
    const auto grid = openvdb::gridConstPtrCast<openvdb::Vec3SGrid>(last);
    const auto accessor = grid->getConstAccessor();
    // Beyond the layer, nothing moves.
    CHECK(accessor.getValue({0, 20, 0}).length() < 1e-3f);
    // Particles beside the face have that velocity too.
    size_t beside = 0;
    const Points& p = points->particles;
    for (size_t k = 0; k < p.size(); ++k) {
        const double away = std::abs(p.y[k]) - 0.2;
        if (std::abs(p.x[k]) > 0.3 || std::abs(p.z[k]) > 0.1 || !(away > 0 && away < 0.02)) continue;
        ++beside;
        CHECK(static_cast<double>(p.vx[k]) == Approx(std::copysign(0.2 * kShear, p.y[k])).epsilon(0.05));
    }
    CHECK(beside > 3);
}

TEST_CASE("moving mesh: a range of one frame has the velocities of that frame in a longer one", "[app]") {
    const auto firstGrid = [](const std::string& range, int available, const auto& meshIn, std::string_view kind) {
        Scenes scenes;
        for (int f = 1; f <= available; ++f)
            scenes.session.provide("bar" + std::to_string(f), meshIn(f), DigestBuilder().add(f).add(kind).digest());
        openvdb::Vec3SGrid::ConstPtr first;
        scenes.session.onFrame = [&](int) {
            const auto grid = std::get<GridValue>(valueOf(scenes.session, Kind::velocity)).grid;
            if (!first) first = openvdb::gridConstPtrCast<openvdb::Vec3SGrid>(grid);
        };
        scenes.run("frames " + range + " fps=24\nread bar$F\nmesh2ls voxel=0.05\n" + kAround + "velocity voxel=0.05");
        return first;
    };
    const auto differences = [](const openvdb::Vec3SGrid& a, const openvdb::Vec3SGrid& b) {
        size_t count = 0;
        for (auto v = a.cbeginValueOn(); v; ++v) count += b.tree().getValue(v.getCoord()) != *v ? 1 : 0;
        return count;
    };
    const auto sheared = [](int f) { return shearingBar(f / 24.0); };
    const auto turned = [](int f) { return bar(0.1 * f, 0, true); };
    const auto requireSame = [&](const auto& meshIn, std::string_view kind) {
        CAPTURE(kind);
        const auto whole = firstGrid("1-3", 3, meshIn, kind), one = firstGrid("1-1", 3, meshIn, kind);
        REQUIRE(whole->activeVoxelCount() > 1000);
        REQUIRE(whole->activeVoxelCount() == one->activeVoxelCount());
        CHECK(differences(*whole, *one) == 0);
        // No mesh follows the only one, so the wall is at rest.
        CHECK(differences(*whole, *firstGrid("1-1", 1, meshIn, kind)) > 100);
    };
    requireSame(sheared, "sheared");
    requireSame(turned, "turned");
}

TEST_CASE("moving mesh: one that has its first form again is not rigid then", "[app]") {
    const auto gridIn = [](const std::string& range, int wanted) {
        Scenes scenes;
        constexpr std::array kBends{0.0, 0.02, 0.03, 0.0, 0.02};
        for (size_t f = 0; f < kBends.size(); ++f) {
            const double turn = 0.3 * static_cast<double>(f);
            scenes.session.provide("bar" + std::to_string(f + 1), bar(1 + turn, f > 0 ? kBends[f] / turn : 0, true),
                                   DigestBuilder().add(f).digest());
        }
        openvdb::Vec3SGrid::ConstPtr grid;
        scenes.session.onFrame = [&](int frame) {
            if (frame == wanted)
                grid = openvdb::gridConstPtrCast<openvdb::Vec3SGrid>(
                    std::get<GridValue>(valueOf(scenes.session, Kind::velocity)).grid);
        };
        scenes.run("frames " + range + " fps=24\nread bar$F\nmesh2ls voxel=0.02\n" + kAround + "velocity voxel=0.05");
        return grid;
    };
    const auto fromFirst = gridIn("1-5", 4), fromSecond = gridIn("2-5", 4);
    for (auto v = fromFirst->cbeginValueOn(); v; ++v) REQUIRE(fromSecond->tree().getValue(v.getCoord()) == *v);
}

TEST_CASE("moving mesh: each frame on its own has the velocities of the whole range", "[app]") {
    using Grids = std::map<int, openvdb::Vec3SGrid::ConstPtr>;
    const auto gridsOf = [](const std::string& range, bool sameFaces, const std::string& body) {
        Scenes scenes;
        for (int f = 1; f <= 4; ++f)
            scenes.session.provide("bar" + std::to_string(f), bar(0.1 * f, 0, sameFaces || f % 2 != 0),
                                   DigestBuilder().add(f).add(int{sameFaces}).digest());
        Grids grids;
        scenes.session.onFrame = [&](int frame) {
            const auto grid = std::get<GridValue>(valueOf(scenes.session, Kind::velocity)).grid;
            grids[frame] = openvdb::gridConstPtrCast<openvdb::Vec3SGrid>(grid);
        };
        scenes.run("frames " + range + " fps=24 start=1\nread bar$F\n" + body + "\n" + kAround + "velocity voxel=0.05");
        return grids;
    };
    const auto speedOf = [](const openvdb::Vec3SGrid& grid) {
        double most = 0;
        for (auto v = grid.cbeginValueOn(); v; ++v) most = std::max(most, static_cast<double>(v->length()));
        return most;
    };
    const double atTip = 0.1 * kTurn * 24 * kHalf[0];
    for (const bool sameFaces : {true, false})
        for (const std::string body :
             {"mesh2ls voxel=0.05", "move translate=0.1,0,0\nmesh2ls voxel=0.05",
              "mesh2ls voxel=0.05\nmove translate=0.1,0,0", "mesh2ls voxel=0.05\nsphere radius=0.1\nunion"}) {
            const Grids whole = gridsOf("1-4", sameFaces, body);
            for (const auto& [frame, grid] : whole) {
                const Grids alone = gridsOf(fmt::format("{0}-{0}", frame), sameFaces, body);
                CAPTURE(sameFaces, body, frame);
                REQUIRE(alone.size() == 1);
                const openvdb::Vec3SGrid& other = *alone.at(frame);
                REQUIRE(grid->activeVoxelCount() == other.activeVoxelCount());
                size_t different = 0;
                for (auto v = grid->cbeginValueOn(); v; ++v)
                    different += other.tree().getValue(v.getCoord()) != *v ? 1 : 0;
                CHECK(different == 0);
                CHECK(speedOf(*grid) > 0.5 * atTip);
            }
        }
}

TEST_CASE("moving mesh: layers of different widths and emission share the level sets between two frames", "[app]") {
    size_t made = 0;
    Console console(Listener{.info = [&](std::string_view line) {
        made += line.find("intermediate level sets between two frames") != std::string_view::npos;
    }});
    console.setVerbosity(Verbosity::verbose);
    Scenes scenes({}, console);
    for (int f = 1; f <= 3; ++f)
        scenes.session.provide("bar" + std::to_string(f), shearingBar(f / 24.0),
                               DigestBuilder().add(f).add(std::string_view("shear")).digest());
    scenes.run(
        "frames 1-3 fps=24\nread bar$F\nmesh2ls voxel=0.05 as=body\nnoise as=f\nnoise seed=1\n"
        "bound side=outside layer=0.2 wall=body as=g\ndfvn f=f g=g speed=0.1 padding=0.3\n"
        "wind layer=0.15 wall=body padding=0.3\nsuperpose as=air\n"
        "emit on=surface domain=body flow=air rate=200\nadvect flow=air");
    CHECK(made == 3); // one for each pair of successive frames; that of the first pair also in the first frame
}

TEST_CASE("moving mesh: grids warn too if the wall moves too far between frames of unmatched meshes", "[app]") {
    // `turns` are those of the frames; a whole even number has other faces than the rest.
    const auto warningsOf = [](const std::vector<double>& turns, bool sameFaces, const std::string& action) {
        size_t warnings = 0;
        Console console(Listener{.info = [&](std::string_view line) {
            warnings += line.find("% of the wall moves farther than") != std::string_view::npos;
        }});
        Scenes scenes({}, console);
        for (size_t f = 0; f < turns.size(); ++f)
            scenes.session.provide(
                "bar" + std::to_string(f + 1), bar(turns[f], 0, sameFaces),
                DigestBuilder().add(turns[f]).add(std::string_view(sameFaces ? "same" : "other")).digest());
        scenes.run("frames 1-3 fps=400\nread bar$F\nmesh2ls dim=32\n" + kAround + action);
        return warnings;
    };
    for (const std::string action :
         {"velocity voxel=0.05", "velocity voxel=0.05 density=1\nadvectGrid grid=1 steps=1"}) {
        CAPTURE(action);
        CHECK(warningsOf({1, 2, 3, 4}, false, action) >= 1);
        CHECK(warningsOf({1, 2, 3, 4}, true, action) == 0);
        CHECK(warningsOf({1.99, 2, 2.01, 2.02}, false, action) == 0); // other faces, but little motion
    }
}

TEST_CASE("moving mesh: displaced=potential moves air beyond the layer", "[app]") {
    size_t warnings = 0; // of air that is much faster than the wall, since it stays in a thin layer
    Console console(Listener{.info = [&](std::string_view line) {
        warnings += line.find("moves at up to 2 units per second and pushes the air") != std::string_view::npos;
    }});
    Scenes scenes({}, console);
    openvdb::GridBase::ConstPtr last;
    scenes.session.onFrame = [&](int) { last = std::get<GridValue>(valueOf(scenes.session, Kind::velocity)).grid; };
    const auto program = [](const std::string& option, const std::string& side = "outside") {
        return "frames 1-2 fps=24\nsphere radius=0.4 offset={2*T},0,0\nnoise\nnoise seed=1\nbound side=" + side +
               " width=0.08\ndfvn speed=1e-6\nvelocity voxel=0.05 displaced=" + option;
    };
    const auto xAhead = [&](const std::string& option) { // 0.2 in front of the sphere
        scenes.runAnew(program(option));
        const auto grid = openvdb::gridConstPtrCast<openvdb::Vec3SGrid>(last);
        return static_cast<double>(
            grid->getConstAccessor().getValue({static_cast<int>((0.4 + 2 / 24.0 + 0.2) / 0.05), 0, 0})[0]);
    };
    CHECK(std::abs(xAhead("fade")) < 1e-3);
    CHECK(warnings == 1);
    warnings = 0;
    // The dipole flow there is 2 (0.4 / 0.57)³ = 0.70; the box is close, which adds to it.
    CHECK(xAhead("potential") == Approx(0.75).margin(0.1));
    CHECK(scenes.session.report["displaced"]["iterations"] > 0);
    CHECK(warnings == 0);
    CHECK_THAT(scenes.complaint(program("potential", "inside")), Catch::ContainsSubstring("obstacle"));
}

TEST_CASE("moving mesh: grids around a moving wall have its velocity", "[app]") {
    Scenes scenes;
    openvdb::GridBase::ConstPtr last;
    scenes.session.onFrame = [&](int) { last = std::get<GridValue>(valueOf(scenes.session, Kind::velocity)).grid; };
    scenes.run(
        "frames 1-3 fps=24\nsphere radius=0.4 translate={2*T},0,0\nnoise\nnoise seed=1\nbound side=outside layer=0.2\n"
        "dfvn speed=0.3 padding=0.4\nscatter count=20\nadvect\nvelocity voxel=0.02");
    REQUIRE(last);
    const auto grid = openvdb::gridConstPtrCast<openvdb::Vec3SGrid>(last);
    const auto accessor = grid->getConstAccessor();
    const int front = static_cast<int>(std::ceil((0.4 + 2 * 2 / 24.0) / 0.02));
    CHECK(static_cast<double>(accessor.getValue({front, 0, 0})[0]) == Approx(2).epsilon(0.02));
    CHECK(static_cast<double>(accessor.getValue({8, 0, 0})[0]) == Approx(2).epsilon(1e-4));
}
