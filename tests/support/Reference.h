// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "Catch.h"
#include "Places.h"

#include <nlohmann/json.hpp>

#include <filesystem>
#include <fstream>
#include <map>
#include <string>
#include <type_traits>
#include <vector>

namespace curlew::test {

/// A file of tests/data.
inline nlohmann::json reference(const std::string& name) {
    std::ifstream file(std::filesystem::path(dataDir()) / name);
    CAPTURE(name);
    REQUIRE(file);
    return nlohmann::json::parse(file);
}

/// Calls `use` with the dimension as a constant.
template <class Use>
void inDimension(int n, const Use& use) {
    switch (n) {
        case 2:
            return use(std::integral_constant<int, 2>());
        case 3:
            return use(std::integral_constant<int, 3>());
        case 4:
            return use(std::integral_constant<int, 4>());
        case 5:
            return use(std::integral_constant<int, 5>());
        case 6:
            return use(std::integral_constant<int, 6>());
        case 7:
            return use(std::integral_constant<int, 7>());
        default:
            FAIL("no flow has " << n << " dimensions");
    }
}

/// Calls `use(row, n)` for every row of a file of reference values whose rows have a dimension n, which is a constant.
/// Requires that there are rows of all these dimensions.
template <class Use>
void forRowsInDimensions(const std::string& name, const std::vector<int>& dimensions, const Use& use) {
    std::map<int, int> rows;
    const nlohmann::json file = reference(name);
    for (const auto& row : file.at("rows")) {
        const int n = row.at("n").get<int>();
        ++rows[n];
        inDimension(n, [&](auto dimension) { use(row, dimension); });
    }
    for (const int n : dimensions) CHECK(rows[n] > 0);
}

} // namespace curlew::test
