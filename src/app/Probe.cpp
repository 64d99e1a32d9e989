#include "curlew/app/Probe.h"

#include "curlew/app/Text.h"
#include "curlew/base/AtomicFile.h"
#include "curlew/base/Error.h"
#include "curlew/vdb/VdbFile.h"

#include <fmt/format.h>

#include <functional>

namespace curlew::app {

std::vector<Vec3d> readPositions(const std::filesystem::path& path) {
    std::ifstream stream = openToRead(path);
    stream.exceptions(std::ios::goodbit);
    std::vector<Vec3d> positions;
    std::string line;
    for (int number = 1; std::getline(stream, line); ++number) {
        if (line.ends_with('\r')) line.pop_back();
        if (number == 1) {
            if (line != "x,y,z")
                throw FileError(
                    fmt::format("'{}' is no list of positions: its first line must be x,y,z", path.string()));
            continue;
        }
        if (line.empty()) continue;
        const auto cells = split(line, ',');
        Vec3d p;
        bool good = cells.size() == 3;
        for (int i = 0; i < 3 && good; ++i) good = parseReal(cells[static_cast<size_t>(i)], p[i]);
        if (!good)
            throw FileError(fmt::format("'{}' line {}: '{}' is not three finite numbers", path.string(), number, line));
        positions.push_back(p);
    }
    if (positions.empty()) throw FileError(fmt::format("'{}' holds no positions", path.string()));
    return positions;
}

namespace {

/// Writes the header, then a line per position: its coordinates and what `values(batch, i)` appends for it.
void writeTable(const std::vector<Vec3d>& positions, const std::string& header, const std::filesystem::path& path,
                const Monitor& monitor,
                const std::function<void(const PointBatch&, std::vector<fmt::memory_buffer>&)>& values) {
    writeAtomically(
        path,
        [&](std::ostream& out) {
            out << header << '\n';
            for (size_t begin = 0; begin < positions.size(); begin += kBatch) {
                monitor.check();
                PointBatch points;
                std::vector<fmt::memory_buffer> lines;
                for (size_t k = begin; k < std::min(begin + kBatch, positions.size()); ++k) {
                    const Vec3d& p = positions[k];
                    points.push(p);
                    fmt::format_to(std::back_inserter(lines.emplace_back()), "{:.17g},{:.17g},{:.17g}", p[0], p[1],
                                   p[2]);
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

template <class T>
void append(fmt::memory_buffer& line, T value) {
    fmt::format_to(std::back_inserter(line), ",{:.{}g}", value, std::is_same_v<T, float> ? 9 : 17);
}

template <class T, int Order>
void probeJets(const ScalarField& field, const std::vector<Vec3d>& positions, const std::filesystem::path& path,
               const Monitor& monitor) {
    std::string header = "x,y,z,value";
    if (Order >= 1) header += ",dx,dy,dz";
    if (Order >= 2) header += ",dxx,dyy,dzz,dxy,dxz,dyz";
    writeTable(positions, header, path, monitor, [&](const PointBatch& points, std::vector<fmt::memory_buffer>& lines) {
        JetBatch<T, Order> jets;
        field.eval(points, jets);
        for (int i = 0; i < points.size; ++i)
            for (int k = 0; k < Jet<T, 3, Order>::kSize; ++k)
                append(lines[static_cast<size_t>(i)], jets[i].component(k));
    });
}

} // namespace

template <class T>
void probeField(const ScalarField& field, const std::vector<Vec3d>& positions, int order,
                const std::filesystem::path& path, const Monitor& monitor) {
    switch (order) {
        case 0:
            return probeJets<T, 0>(field, positions, path, monitor);
        case 1:
            return probeJets<T, 1>(field, positions, path, monitor);
        default:
            return probeJets<T, 2>(field, positions, path, monitor);
    }
}

template <class T>
void probeFlow(const Dfvn& flow, const std::vector<Vec3d>& positions, int order, const std::filesystem::path& path,
               const Monitor& monitor) {
    std::string header = "x,y,z,vx,vy,vz,f,g";
    if (order >= 2) header += ",dvx_dx,dvx_dy,dvx_dz,dvy_dx,dvy_dy,dvy_dz,dvz_dx,dvz_dy,dvz_dz";
    writeTable(positions, header, path, monitor, [&](const PointBatch& points, std::vector<fmt::memory_buffer>& lines) {
        JetBatch<T, 1> f, g;
        VecBatch<T> velocity;
        flow.eval(points, f, g, velocity);
        for (int i = 0; i < points.size; ++i) {
            auto& line = lines[static_cast<size_t>(i)];
            for (int axis = 0; axis < 3; ++axis) append(line, velocity[i][axis]);
            append(line, f[i].value);
            append(line, g[i].value);
            if (order < 2) continue;
            for (const Vec3d& row : flow.at(points[i]).derivative.rows)
                for (const double derivative : row.c) append(line, derivative);
        }
    });
}

template void probeField<float>(const ScalarField&, const std::vector<Vec3d>&, int, const std::filesystem::path&,
                                const Monitor&);
template void probeField<double>(const ScalarField&, const std::vector<Vec3d>&, int, const std::filesystem::path&,
                                 const Monitor&);
template void probeFlow<float>(const Dfvn&, const std::vector<Vec3d>&, int, const std::filesystem::path&,
                               const Monitor&);
template void probeFlow<double>(const Dfvn&, const std::vector<Vec3d>&, int, const std::filesystem::path&,
                                const Monitor&);

} // namespace curlew::app
