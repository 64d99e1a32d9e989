// SPDX-License-Identifier: Apache-2.0
// Walls from meshes that move from frame to frame.
#include "curlew/math/Rotation.h"
#include "support/SessionCommand.h"

#include <openvdb/openvdb.h>

using namespace curlew;
using namespace curlew::app;
using namespace curlew::test;

namespace {

constexpr double kTurn = 0.3; // radians a frame
/// Samples round the edges of the bar off: a point may be beyond them by a quarter of a voxel (dim=80 for a length of
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
    "noise frequency=2\nnoise frequency=2 seed=1\nbound side=outside width=0.08\n"
    "dfvn box=-0.7,-0.7,-0.2,0.7,0.7,0.2\n";

/// Counts of points near the bar.
struct Fate {
    size_t inside = 0, passed = 0, points = 0;
};

Fate pointsAbout(Scenes& scenes, double bend, bool sameFaces,
                 const std::string& frames = "frames 1-3 fps=400 substeps=4\n") {
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
                if (k > 0) outcome.passed += through(last, q);
                last = q;
            }
        }
        outcome.points = curves->size();
    };
    scenes.run("read bar1\nmesh2ls dim=80\n" + kAround + "scatter count=2000\n" + frames +
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

TEST_CASE("moving mesh: warns if the wall moves too far between frames of unmatched meshes", "[app]") {
    std::vector<std::string> warnings;
    Console console(Listener{.say = [&](std::string_view line) {
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

TEST_CASE("moving mesh: grids around a moving wall have its velocity", "[app]") {
    Scenes scenes;
    openvdb::GridBase::ConstPtr last;
    scenes.session.onFrame = [&](int) { last = std::get<GridValue>(valueOf(scenes.session, Kind::velocity)).grid; };
    scenes.run(
        "frames 1-3 fps=24\nsphere radius=0.4 offset={2*T},0,0\nnoise\nnoise seed=1\nbound side=outside width=0.2\n"
        "dfvn speed=0.3 padding=0.4\nscatter count=20\nadvect\nvelocity voxel=0.02");
    REQUIRE(last);
    const auto grid = openvdb::gridConstPtrCast<openvdb::Vec3SGrid>(last);
    const auto accessor = grid->getConstAccessor();
    const int front = static_cast<int>(std::ceil((0.4 + 2 * 2 / 24.0) / 0.02));
    CHECK(static_cast<double>(accessor.getValue({front, 0, 0})[0]) == Approx(2).epsilon(0.02));
    CHECK(static_cast<double>(accessor.getValue({8, 0, 0})[0]) == Approx(2).epsilon(1e-4));
}
