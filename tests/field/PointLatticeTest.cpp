// SPDX-License-Identifier: Apache-2.0
#include "curlew/field/Bound.h"
#include "curlew/field/NoiseField.h"
#include "curlew/field/PointLattice.h"
#include "curlew/field/Shapes.h"
#include "support/Catch.h"
#include "support/Lattices.h"

using namespace curlew;
using test::coordinates;

TEST_CASE("PointLattice: batches hold all positions in order", "[field]") {
    const auto x = coordinates(0, 1, 5), y = coordinates(10, 1, 3), z = coordinates(20, 1, GENERATE(1, 7, 100));
    const PointLattice lattice{{x, y, z}};
    std::vector<Vec3d> positions;
    lattice.forEachBatch([&](const PointBatch& points, size_t first) {
        CHECK(first == positions.size());
        for (int i = 0; i < points.size; ++i) positions.push_back(points[i]);
    });
    REQUIRE(positions.size() == lattice.size());
    for (size_t n = 0; n < positions.size(); ++n)
        CHECK(positions[n] == Vec3d{{x[n / z.size() / y.size()], y[n / z.size() % y.size()], z[n % z.size()]}});
}

TEST_CASE("PointLattice: without positions there are no values", "[field]") {
    const auto some = coordinates(0, 1, 3);
    CHECK(test::differing(sphereSdf(1).distance, PointLattice{{some, some, {}}}) == 0);
}

TEST_CASE("PointLattice: a field has the same bits on a lattice as at single positions", "[field]") {
    const auto x = coordinates(-1.3, 0.11, 24), y = coordinates(-0.9, 0.1, 19), z = coordinates(-1.2, 0.13, 17);
    const PointLattice lattice{{x, y, z}};
    const auto noise = noiseField<Psrd3>({.seed = 1}, {.frequency = 2});
    CHECK(test::differing(noise, lattice) == 0);
    for (const Side side : {Side::inside, Side::outside, Side::both}) {
        const Wall wall{.sdf = sphereSdf(1), .side = side, .width = 0.3};
        CHECK(test::differing(bounded(noise, wall), lattice) == 0);
        CHECK(test::differing(bounded(noise, wall, {.separate = true}), lattice) == 0);
    }
}
