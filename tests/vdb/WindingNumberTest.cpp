// SPDX-License-Identifier: Apache-2.0
#include "curlew/base/Error.h"
#include "curlew/base/Parallel.h"
#include "curlew/vdb/WindingNumber.h"
#include "support/Meshes.h"
#include "support/Points.h"

using namespace curlew;
using test::randomPoints;

namespace {

openvdb::Vec3d inVdb(const Vec3d& p) { return {p[0], p[1], p[2]}; }

} // namespace

TEST_CASE("WindingNumber: counts how often a mesh encloses a point", "[vdb]") {
    const Mesh ball = test::ball(3), twice = test::together(ball, test::moved(ball, {1, 0, 0}));
    const WindingNumber one(ball), turned(test::flipped(ball)), both(twice);
    CHECK(one.at({{0.1, 0.2, 0.3}}) == Approx(1).margin(1e-3));
    CHECK(one.at({{1.1, 0.2, 0.3}}) == Approx(0).margin(1e-3));
    CHECK(turned.at({{0.1, 0.2, 0.3}}) == Approx(-1).margin(1e-3));
    CHECK(both.at({{0.5, 0.1, 0}}) == Approx(2).margin(1e-3));
    // Beside a sheet it is ±1/2; at NaN positions and very far away it is 0.
    const Mesh flat = test::plane(2, 4);
    CHECK(WindingNumber(flat).at({{0.1, 0, 0.2}}) == 0);
    CHECK(WindingNumber(flat).at({{0.1, -1e-9, 0.2}}) == Approx(0.5).margin(1e-3));
    CHECK(WindingNumber(flat).at({{0.1, 1e-9, 0.2}}) == Approx(-0.5).margin(1e-3));
    CHECK(one.at({{std::nan(""), 0, 0}}) == 0);
    CHECK(one.at({{1e300, 0, 0}}) == 0);
    CHECK(WindingNumber(Mesh{}).at({{0, 0, 0}}) == 0);
    const Mesh point{.points = {{0, 0, 0}, {1, 0, 0}}, .triangles = {{0, 1, 1}}, .quads = {}};
    CHECK(WindingNumber(point).at({{0, 1, 0}}) == 0);
}

TEST_CASE("WindingNumber: the fast sum is within a thousandth of the exact one", "[vdb]") {
    const Mesh mesh =
        GENERATE(test::spot(), test::withHole(test::spot(), {0, 0.4, 0}, 0.4), test::soup(test::spot(), 0.05),
                 test::plane(2, 30), test::moebius(0.6, 200), test::moved(test::ball(4), {1000, -500, 200}));
    const WindingNumber winding(mesh);
    openvdb::BBoxd box;
    for (const auto& p : mesh.points) box.expand(openvdb::Vec3d(p));
    const openvdb::Vec3d lower = box.min(), size = box.extents() + openvdb::Vec3d(0.2);
    test::Worst fast, sum;
    double squares = 0;
    const auto places = randomPoints(test::cube(0.6), 4000, 5);
    for (size_t n = 0; n < places.size(); ++n) {
        Vec3d p;
        for (int axis = 0; axis < 3; ++axis) p[axis] = lower[axis] + size[axis] * (places[n][axis] + 0.5);
        if (n % 2 == 0) { // half of the positions are close to the surface
            const auto& corner = mesh.points[n * 7919 % mesh.points.size()];
            for (int axis = 0; axis < 3; ++axis) p[axis] = static_cast<double>(corner[axis]) + 0.02 * places[n][axis];
        }
        const double exact = winding.exactAt(p), error = std::abs(winding.at(p) - exact);
        fast.see(error, p);
        squares += error * error;
        if (n < 60) sum.see(std::abs(exact - test::windingNumberByExcess(mesh, inVdb(p))), p);
    }
    // Both sides of a position in one call.
    test::Worst pairs;
    for (size_t n = 0; n < 200; ++n) {
        const auto& corner = mesh.points[n * 7919 % mesh.points.size()];
        Vec3d p, step;
        for (int axis = 0; axis < 3; ++axis) {
            p[axis] = static_cast<double>(corner[axis]) + 0.02 * places[n][axis];
            step[axis] = 2e-4 * places[n + 1000][axis];
        }
        const auto [above, below] = winding.beside(p, step);
        pairs.see(std::abs(above - winding.exactAt(p + step)), p);
        pairs.see(std::abs(below - winding.exactAt(p - step)), p);
    }
    CAPTURE(fast.where, sum.where, pairs.where, mesh.points.size());
    CHECK(pairs.value < 0.01);
    CHECK(fast.value < 1e-3);
    CHECK(std::sqrt(squares / static_cast<double>(places.size())) < 3e-4); // the documented accuracy
    CHECK(sum.value < 1e-9);                                               // two formulas agree
}

TEST_CASE("WindingNumber: does not depend on the number of threads", "[vdb]") {
    const Mesh mesh = test::ball(6); // enough triangles for a parallel build
    const auto places = randomPoints(test::cube(1.2), 3000, 8);
    std::vector<std::vector<double>> results;
    for (const int threads : {1, 4}) {
        const ThreadLimit limit(threads);
        results.push_back(WindingNumber(mesh).at(places));
    }
    CHECK(results[0] == results[1]);
    CHECK(WindingNumber(mesh).at(places[17]) == results[0][17]);
}

TEST_CASE("WindingNumber: building the tree can be cancelled", "[vdb]") {
    CHECK_THROWS_AS(WindingNumber(test::ball(3), {.report = {}, .cancelled = [] { return true; }}), Interrupted);
}
