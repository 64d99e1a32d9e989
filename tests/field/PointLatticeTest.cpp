// SPDX-License-Identifier: Apache-2.0
#include "curlew/field/Algebra.h"
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
    lattice.forEachBatch([&](const LatticeBatch& batch) {
        CHECK(batch.first() == positions.size());
        const PointBatch& points = batch.points();
        REQUIRE(points.size == batch.size());
        for (int i = 0; i < points.size; ++i) positions.push_back(points[i]);
    });
    REQUIRE(positions.size() == lattice.size());
    for (size_t n = 0; n < positions.size(); ++n)
        CHECK(positions[n] == Vec3d{{x[n / z.size() / y.size()], y[n / z.size() % y.size()], z[n % z.size()]}});
}

TEST_CASE("PointLattice: has only the chosen combinations", "[field]") {
    const auto x = coordinates(0, 1, 5), y = coordinates(10, 1, 3), z = coordinates(20, 1, 7);
    const auto step = GENERATE(uint32_t{1}, uint32_t{3}, uint32_t{50}), run = GENERATE(uint32_t{1}, uint32_t{13});
    std::vector<uint32_t> numbers;
    for (uint32_t n = 2; n < x.size() * y.size() * z.size(); n += n % run == 0 ? step : 1) numbers.push_back(n);
    const PointLattice lattice{{x, y, z}, numbers};
    CHECK(lattice.size() == numbers.size());
    size_t count = 0;
    lattice.forEachBatch([&](const LatticeBatch& batch) {
        CHECK(batch.first() == count);
        const PointBatch& points = batch.points();
        REQUIRE(points.size == batch.size());
        int inRuns = 0;
        batch.forEachRun([&](size_t from, size_t number, size_t length) {
            CHECK(from == static_cast<size_t>(inRuns));
            for (size_t k = 0; k < length; ++k) CHECK(batch.number(inRuns++) == number + k);
        });
        CHECK(inRuns == batch.size());
        for (int i = 0; i < points.size; ++i, ++count) {
            const size_t n = batch.number(i);
            CHECK(n == numbers[count]);
            CHECK(points[i] == Vec3d{{x[n / z.size() / y.size()], y[n / z.size() % y.size()], z[n % z.size()]}});
        }
    });
    CHECK(count == numbers.size());
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
        CHECK(test::differing(bounded(noise, wall, {.variation = 0.5}), lattice) == 0);
        CHECK(test::differing(layerRamp(wall), lattice) == 0);
        CHECK(test::differing(layerFade(wall) * noise, lattice) == 0);
    }
    const ScalarField ball = sphereSdf(1).distance, other = boxSdf(Vec3d{{0.8, 0.5, 0.9}}, 0.05).distance;
    for (const ScalarField& made : {ball + noise, ball - noise, ball * noise, ball / constantField<3>(3), 2.0 * ball,
                                    clipped(ball, 0.5), smoothMin(ball, other, 0.1), smoothMax(ball, other, 0.0)})
        CHECK(test::differing(made, lattice) == 0);
}

namespace {

/// Counts how often it is prepared.
struct Prepared {
    int* times;

    template <int Order, class T>
    void evalBatch(const PointBatch& points, JetBatch<T, Order>& jets) const {
        for (int i = 0; i < points.size; ++i) jets.set(i, Jet<T, 3, Order>(static_cast<T>(points[i][0])));
    }
    template <int Order, class T>
    OnLattice<T, Order> onLattice(const PointLattice&) const {
        ++*times;
        return [this](const LatticeBatch& batch, JetBatch<T, Order>& jets) { evalBatch(batch.points(), jets); };
    }
};

} // namespace

TEST_CASE("ScalarField: all fields that a memo knows share what one has prepared", "[field]") {
    int times = 0;
    const ScalarField shared{Prepared{&times}};
    const auto x = coordinates(1, 1, 4);
    const std::vector<uint32_t> some{3, 5, 40};
    LatticeMemo memo;
    const PointLattice all{{x, x, x}, {}, &memo}, chosen{{x, x, x}, some, &memo};
    CHECK(test::differing<float, 1>(shared * shared, all) == 0);
    CHECK(times == 1);
    CHECK(test::differing<float, 1>(shared + 2.0 * shared, chosen) == 0);
    CHECK(times == 1);
    CHECK(test::differing<double, 0>(shared, all) == 0); // another precision
    CHECK(times == 2);
    CHECK(test::differing<double, 0>(shared, PointLattice{{x, x, x}}) == 0); // without a memo
    CHECK(times == 3);
}
