// SPDX-License-Identifier: Apache-2.0
#include "curlew/app/run/Probe.h"

#include "curlew/app/registry/Text.h"
#include "curlew/base/AtomicFile.h"
#include "curlew/base/Csv.h"
#include "curlew/base/Error.h"
#include "curlew/field/Dimensions.h"

#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <string_view>

namespace curlew::app {

namespace {

constexpr size_t kMaxDimensions = 7;

bool looksLikeCoordinate(std::string name) {
    std::erase(name, ' ');
    return name == "x" || name == "y" || name == "z" ||
           (name.size() == 2 && name[0] == 'x' && name[1] >= '0' && name[1] <= '9');
}

/// Returns how many columns at the beginning are coordinates: x, y, z; or x0, x1, …. Returns 0 if others look like
/// coordinates.
size_t coordinatesOf(const std::vector<std::string>& names) {
    const std::string_view letters = "xyz";
    const auto count = [&](size_t most, const auto& nameOf) {
        size_t k = 0;
        while (k < std::min(names.size(), most) && names[k] == nameOf(k)) ++k;
        return k;
    };
    const size_t found = std::max(count(letters.size(), [&](size_t k) { return std::string(1, letters[k]); }),
                                  count(kMaxDimensions, [](size_t k) { return fmt::format("x{}", k); }));
    return std::any_of(names.begin() + static_cast<std::ptrdiff_t>(found), names.end(), looksLikeCoordinate) ? 0
                                                                                                             : found;
}

} // namespace

Positions readPositions(const std::filesystem::path& path) {
    CsvTable table = readCsv(path, CsvCells::finite, [&](const std::vector<std::string>& names) {
        if (coordinatesOf(names) == 0)
            throw FileError(
                fmt::format("'{}' is not a list of positions: its first columns must be x or x,y or x,y,z "
                            "or x0,x1,… up to x6",
                            path.string()));
    });
    if (table.values.empty()) throw FileError(fmt::format("'{}' contains no positions", path.string()));
    const size_t columns = table.names.size(), used = coordinatesOf(table.names);
    if (used == columns) return {std::move(table.names), std::move(table.values)};
    Positions positions;
    positions.names.assign(table.names.begin(), table.names.begin() + static_cast<std::ptrdiff_t>(used));
    positions.coordinates.reserve(table.values.size() / columns * used);
    for (size_t k = 0; k < table.values.size(); ++k)
        if (k % columns < used) positions.coordinates.push_back(table.values[k]);
    return positions;
}

namespace {

using Lines = std::vector<fmt::memory_buffer>;

template <class T>
void append(fmt::memory_buffer& line, T value) {
    fmt::format_to(std::back_inserter(line), ",{:.{}g}", value, std::is_same_v<T, float> ? 9 : 17);
}

/// Writes the header, then a line per position: its coordinates and what `values(batch, lines)` appends to the line.
template <int N>
void writeTable(const Positions& positions, const std::vector<std::string>& columns, const std::filesystem::path& path,
                const Monitor& monitor, const std::function<void(const PointBatchN<N>&, Lines&)>& values) {
    if (positions.dimension() != N)
        throw ValueError(fmt::format("the probed object has {} dimensions, but the positions have {}: {}", N,
                                     positions.dimension(), join(positions.names, ",")));
    writeAtomically(
        path,
        [&](std::ostream& out) {
            out << join(positions.names, ",") << ',' << join(columns, ",") << '\n';
            for (size_t begin = 0; begin < positions.size(); begin += kBatch) {
                monitor.check();
                PointBatchN<N> points;
                Lines lines;
                for (size_t k = begin; k < std::min(begin + kBatch, positions.size()); ++k) {
                    const auto p = positions.at<N>(k);
                    points.push(p);
                    auto& line = lines.emplace_back();
                    fmt::format_to(std::back_inserter(line), "{:.17g}", p[0]);
                    for (int axis = 1; axis < N; ++axis) append(line, p[axis]);
                }
                values(points, lines);
                for (const auto& line : lines)
                    out.write(line.data(), static_cast<std::streamsize>(line.size())) << '\n';
                if (monitor.report)
                    monitor.report(static_cast<double>(begin + lines.size()) / static_cast<double>(positions.size()));
            }
        },
        monitor.cancelled);
}

template <class T, int N, int Order>
void probeJets(const ScalarFieldN<N>& field, const Positions& positions, const std::filesystem::path& path,
               const Monitor& monitor) {
    const auto& x = positions.names;
    std::vector<std::string> columns{"value"};
    if (Order >= 1)
        for (const auto& a : x) columns.push_back("d" + a);
    if (Order >= 2) {
        for (const auto& a : x) columns.push_back(fmt::format("d{0}{0}", a));
        for (size_t i = 0; i < x.size(); ++i)
            for (size_t j = i + 1; j < x.size(); ++j) columns.push_back(fmt::format("d{}{}", x[i], x[j]));
    }
    writeTable<N>(positions, columns, path, monitor, [&](const PointBatchN<N>& points, Lines& lines) {
        const auto appendFrom = [&](size_t first, const auto& jets) {
            for (size_t i = 0; i < lines.size(); ++i)
                for (size_t k = first; k < jets.c.size(); ++k) append(lines[i], jets.c[k][i]);
        };
        constexpr int kHighest = std::is_same_v<T, double> ? Order : std::min(Order, 1);
        JetBatchN<T, N, kHighest> jets;
        field.eval(points, jets);
        appendFrom(0, jets);
        if constexpr (kHighest < Order) { // second derivatives are known in double only
            JetBatchN<double, N, Order> exact;
            field.eval(points, exact);
            appendFrom(jets.c.size(), exact);
        }
    });
}

} // namespace

template <class T, int N>
void probeField(const ScalarFieldN<N>& field, const Positions& positions, int order, const std::filesystem::path& path,
                const Monitor& monitor) {
    switch (order) {
        case 0:
            return probeJets<T, N, 0>(field, positions, path, monitor);
        case 1:
            return probeJets<T, N, 1>(field, positions, path, monitor);
        default:
            return probeJets<T, N, 2>(field, positions, path, monitor);
    }
}

template <class T, int N>
void probeFlow(const FlowN<N>& flow, const Positions& positions, int order, const std::filesystem::path& path,
               const Monitor& monitor) {
    const bool letters = N <= 3;
    std::vector<std::string> x, v, columns;
    for (int i = 0; i < N; ++i) {
        x.push_back(letters ? std::string(1, "xyz"[i]) : fmt::format("x{}", i));
        v.push_back(letters ? fmt::format("v{}", "xyz"[i]) : fmt::format("v{}", i));
    }
    columns = v;
    for (size_t k = 0; k < FlowN<N>::kPotentials && flow.hasTracks(); ++k)
        columns.push_back(letters ? std::string(1, "fg"[k]) : fmt::format("f{}", k));
    if (order >= 2)
        for (const auto& a : v)
            for (const auto& b : x) columns.push_back(fmt::format("d{}_d{}", a, b));
    writeTable<N>(positions, columns, path, monitor, [&](const PointBatchN<N>& points, Lines& lines) {
        typename FlowN<N>::template Jets<T> potentials;
        VecBatchN<T, N> velocity;
        flow.eval(points, potentials, velocity);
        for (int i = 0; i < points.size; ++i) {
            auto& line = lines[static_cast<size_t>(i)];
            for (const T component : velocity[i].c) append(line, component);
            if (flow.hasTracks())
                for (const auto& potential : potentials) append(line, potential[i].value);
            if (order < 2) continue;
            for (const auto& row : flow.at(points[i]).derivative.rows)
                for (const double derivative : row.c) append(line, derivative);
        }
    });
}

#define CURLEW_INSTANTIATE(N)                                                                                     \
    template void probeField<float>(const ScalarFieldN<N>&, const Positions&, int, const std::filesystem::path&,  \
                                    const Monitor&);                                                              \
    template void probeField<double>(const ScalarFieldN<N>&, const Positions&, int, const std::filesystem::path&, \
                                     const Monitor&);
CURLEW_FOR_DIMENSIONS(CURLEW_INSTANTIATE)
#undef CURLEW_INSTANTIATE
#define CURLEW_INSTANTIATE(N)                                                                             \
    template void probeFlow<float>(const FlowN<N>&, const Positions&, int, const std::filesystem::path&,  \
                                   const Monitor&);                                                       \
    template void probeFlow<double>(const FlowN<N>&, const Positions&, int, const std::filesystem::path&, \
                                    const Monitor&);
CURLEW_FOR_FLOW_DIMENSIONS(CURLEW_INSTANTIATE)
#undef CURLEW_INSTANTIATE

} // namespace curlew::app
