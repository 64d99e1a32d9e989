// SPDX-License-Identifier: Apache-2.0
#include "curlew/field/ForEachBatch.h"
#include "support/Catch.h"

using namespace curlew;

TEST_CASE("forEachBatch: visits every point once and passes the start of each batch", "[field]") {
    const size_t count = GENERATE(size_t{0}, size_t{1}, size_t{63}, size_t{64}, size_t{1000});
    CAPTURE(count);
    std::vector<Vec<double, 2>> points;
    for (size_t k = 0; k < count; ++k) points.push_back({{double(k), 1}});
    forEachBatch(points, [&](PointBatchN<2>& batch, size_t begin) {
        for (int i = 0; i < batch.size; ++i) {
            const Vec<double, 2> p = batch[i];
            batch.set(i, Vec<double, 2>{{p[0], p[1] + double(begin) + i}});
        }
        storeBatch(batch, points, begin);
    });
    for (size_t k = 0; k < count; ++k) CHECK(points[k] == Vec<double, 2>{{double(k), 1 + double(k)}});
}

TEST_CASE("sumOverBatches: sums computed points with the same bits for any number of threads", "[field]") {
    const PointsBy thirds{1000, [](size_t k) { return Vec3d{{double(k) / 3, 0, 0}}; }};
    const auto sum = [&] {
        return sumOverBatches(thirds, [](const PointBatch& batch, size_t) {
            double s = 0;
            for (int i = 0; i < batch.size; ++i) s += batch[i][0];
            return s;
        });
    };
    const double many = sum();
    const ThreadLimit limit(1);
    CHECK(many == sum());
    CHECK(many == Approx(999 * 1000 / 6.0));
}
