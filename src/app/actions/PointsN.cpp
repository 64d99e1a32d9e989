// SPDX-License-Identifier: Apache-2.0
#include "PointsN.h"

#include "curlew/base/AtomicFile.h"

#include <fstream>
#include <iterator>

namespace curlew::app {

int pointDimension(const Context& c, const Arguments& a, std::string_view input) {
    if (a.given("dimensions")) return a.integer<int>("dimensions");
    return c.has(input) && c.kind(input) == Kind::flow ? dimensionOf(c.anyFlow(input)) : 3;
}

bool hasNumberedCoordinates(const std::filesystem::path& csv) {
    std::ifstream in(csv, std::ios::binary);
    std::array<char, 3> start{};
    in.read(start.data(), start.size());
    return in && std::string_view(start.data(), start.size()) == "x0,";
}

void writePointsN(const std::filesystem::path& csv, const AnyPositions& positions,
                  const std::function<bool()>& cancelled) {
    const auto write = [&](std::ostream& out) {
        std::visit(
            [&](const auto& all) {
                fmt::memory_buffer text;
                const auto to = std::back_inserter(text);
                for (int axis = 0; axis < dimensionOf(positions); ++axis)
                    fmt::format_to(to, "{}x{}", axis > 0 ? "," : "", axis);
                fmt::format_to(to, "\n");
                for (const auto& p : all) {
                    fmt::format_to(to, "{:.17g}\n", fmt::join(p.c, ","));
                    out.write(text.data(), static_cast<std::streamsize>(text.size()));
                    text.clear();
                }
                out.write(text.data(), static_cast<std::streamsize>(text.size())); // the header, if there are no points
            },
            positions);
    };
    writeAtomically(csv, write, cancelled);
}

} // namespace curlew::app
