// SPDX-License-Identifier: Apache-2.0
#include "curlew/field/Batch.h"
#include "support/Points.h"

using namespace curlew;
using namespace curlew::test;

TEST_CASE("PointBatch: holds pushed points until it is full", "[field]") {
    PointBatch batch;
    CHECK(batch.size == 0);
    for (uint64_t k = 0; k < size_t{kBatch}; ++k) {
        CHECK_FALSE(batch.full());
        batch.push(randomPoint(cube(1), 1, k));
    }
    CHECK(batch.full());
    for (int i = 0; i < kBatch; ++i) CHECK(batch[i] == randomPoint(cube(1), 1, static_cast<uint64_t>(i)));
    batch.set(3, {{7, 8, 9}});
    CHECK(batch[3] == Vec3d{{7, 8, 9}});
    CHECK(batch.c[1][3] == 8);
    CHECK(batch[4] == randomPoint(cube(1), 1, 4));
}

TEST_CASE("JetBatch: stores one row per component", "[field]") {
    JetBatch<double, 2> batch;
    Jet<double, 3, 2> jet;
    for (int k = 0; k < 10; ++k) jet.component(k) = 10 + k;
    batch.set(5, jet);
    for (int k = 0; k < 10; ++k) {
        CHECK(batch.c[static_cast<size_t>(k)][5] == 10 + k);
        CHECK(batch[5].component(k) == 10 + k);
    }
}
