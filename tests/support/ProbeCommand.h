// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/app/registry/Text.h"
#include "curlew/flow/Flow.h"
#include "support/Command.h"
#include "support/Points.h"

#include <fmt/format.h>

namespace curlew::test {

/// A table as -probe writes it.
struct Table {
    std::string header;
    std::vector<std::vector<double>> rows;
};

inline Table tableOf(const std::filesystem::path& path) {
    std::istringstream lines(bytesOf(path));
    Table table;
    std::getline(lines, table.header);
    for (std::string line; std::getline(lines, line);) {
        auto& row = table.rows.emplace_back();
        for (const auto& cell : app::split(line, ',')) REQUIRE(app::parseReal(cell, row.emplace_back()));
    }
    return table;
}

/// The header of a list of positions: x,y,z or x0,x1,….
inline std::string coordinateHeader(int dimensions) {
    std::string text;
    for (int i = 0; i < dimensions; ++i)
        text += fmt::format("{}{}", i ? "," : "", dimensions <= 3 ? std::string(1, "xyz"[i]) : fmt::format("x{}", i));
    return text;
}

/// What the command's -probe says of what the actions make, at the given positions: a row for each, without them.
template <int N>
std::vector<std::vector<double>> probed(const Folder& folder, const std::string& actions,
                                        const std::vector<Vec<double, N>>& points, int order = 1) {
    std::string text = coordinateHeader(N);
    for (const auto& p : points)
        for (int i = 0; i < N; ++i) text += fmt::format("{}{:.17g}", i ? "," : "\n", p[i]);
    store(folder / "in.csv", text);
    folder.mustRun(actions + fmt::format(" -probe in.csv out.csv order={}", order));
    auto rows = tableOf(folder / "out.csv").rows;
    REQUIRE(rows.size() == points.size());
    for (auto& row : rows) row.erase(row.begin(), row.begin() + N);
    return rows;
}

/// Requires that the command's field is the library's, to the last bit, derivatives up to the second included.
template <int N>
void requireField(const Folder& folder, const std::string& actions, const ScalarFieldN<N>& field, double half = 2) {
    const auto points = randomPoints(cube<N>(half), 100, 1);
    const auto rows = probed(folder, actions, points, 2);
    CAPTURE(actions);
    for (size_t k = 0; k < points.size(); ++k) {
        const auto jet = field.template at<2>(points[k]);
        REQUIRE(rows[k].size() == jet.kSize);
        for (int c = 0; c < jet.kSize; ++c) {
            CAPTURE(points[k], c);
            REQUIRE(rows[k][static_cast<size_t>(c)] == jet.component(c));
        }
    }
}

/// The same for a flow: velocity, and potentials where it has tracks.
template <int N>
void requireFlow(const Folder& folder, const std::string& actions, const FlowN<N>& flow, double half = 1) {
    const auto points = randomPoints(cube<N>(half), 100, 2);
    const auto rows = probed(folder, actions, points);
    CAPTURE(actions);
    for (size_t k = 0; k < points.size(); ++k) {
        const auto sample = flow.at(points[k]);
        std::vector<double> expected(sample.velocity.c.begin(), sample.velocity.c.end());
        if (flow.hasTracks()) expected.insert(expected.end(), sample.potentials.begin(), sample.potentials.end());
        CAPTURE(points[k]);
        REQUIRE(rows[k] == expected);
    }
}

} // namespace curlew::test
