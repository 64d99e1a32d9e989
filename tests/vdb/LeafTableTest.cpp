// SPDX-License-Identifier: Apache-2.0
#include "../../src/vdb/LeafTable.h"
#include "support/Points.h"

#include <map>

using namespace curlew;

TEST_CASE("LeafTable: finds the numbers of thousands of scattered leaves, and no others", "[vdb]") {
    const double reach = GENERATE(3.0, 40.0, 1e7, 1.3e8); // dense, sparse, and every brick far from the next
    std::map<std::array<double, 3>, int32_t> expected;
    std::vector<Vec3d> leaves;
    const auto at = [&](uint64_t k) {
        const Vec3d p = test::randomPoint(test::cube(reach), 4, k);
        return Vec3d{{std::floor(p[0]), std::floor(p[1]), std::floor(p[2])}};
    };
    for (uint64_t k = 0; k < 3000; ++k)
        if (expected.emplace(at(k).c, static_cast<int32_t>(leaves.size())).second) leaves.push_back(at(k));
    const LeafTable table(leaves);
    size_t wrong = 0;
    for (uint64_t k = 0; k < 9000; ++k) {
        const auto known = expected.find(at(k).c);
        wrong += table.find(table.keyOf(at(k))) != (known == expected.end() ? LeafTable::kNone : known->second);
    }
    CHECK(wrong == 0);
    const LeafTable none;
    CHECK(none.find(none.keyOf({{0, 0, 0}})) == LeafTable::kNone);
}
