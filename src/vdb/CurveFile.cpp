// SPDX-License-Identifier: Apache-2.0
#include "curlew/vdb/CurveFile.h"

#include "ChunkedWriter.h"
#include "CurveArrays.h"
#include "curlew/base/AtomicFile.h"
#include "curlew/base/Error.h"
#include "curlew/vdb/Openvdb.h"

#include <fmt/compile.h>
#include <fmt/format.h>
#include <openvdb/points/AttributeArray.h>
#include <openvdb/points/PointAttribute.h>

#include <iterator>
#include <numeric>
#include <utility>

namespace curlew {

namespace fs = std::filesystem;
namespace points = openvdb::points;

void checkArrays(const Curves& c) {
    const size_t vertices = c.vertices(), curves = c.size();
    bool whole = c.start.size() == curves + 1 && c.start.front() == 0 && c.start.back() == vertices &&
                 std::is_sorted(c.start.begin(), c.start.end()) && c.downstream.size() == curves;
    for (const auto* values : {&c.y, &c.z, &c.along}) whole = whole && values->size() == vertices;
    for (const auto* values : {&c.vx, &c.vy, &c.vz}) whole = whole && values->size() == vertices;
    for (const auto* values : {&c.f, &c.g}) whole = whole && values->size() == (c.hasTrack() ? vertices : 0);
    if (!whole)
        throw ValueError(
            fmt::format("the curve arrays differ in length; give one value for each of the {} vertices and {} curves",
                        vertices, curves));
}

void checkIds(const Curves& c) {
    for (const int64_t id : c.id)
        if (!std::in_range<int32_t>(id))
            throw ValueError(
                fmt::format("the curve id {} does not fit in the 32 bits that the file has for it; number the seeds "
                            "from 0, or write .csv",
                            id));
    if (!std::in_range<int32_t>(c.vertices()))
        throw ValueError(fmt::format(
            "{} vertices are too many for the file's 32-bit indices; trace fewer or shorter curves, or write .csv",
            c.vertices()));
}

const char* alongName(const Curves& curves) { return kStepByNames[static_cast<size_t>(curves.by)].data(); }

std::vector<size_t> owners(const Curves& c) {
    std::vector<size_t> owner(c.vertices());
    for (size_t k = 0; k < c.size(); ++k)
        std::fill(owner.begin() + static_cast<std::ptrdiff_t>(c.start[k]),
                  owner.begin() + static_cast<std::ptrdiff_t>(c.start[k + 1]), k);
    return owner;
}

namespace {

/// Adds an attribute to a grid: every point gets value(id).
template <class T, class Value>
void addAttribute(points::PointDataGrid& grid, const std::string& name, const Value& value, const Monitor& monitor) {
    using Leaf = points::PointDataTree::LeafNodeType;
    points::appendAttribute<T>(grid.tree(), name);
    std::vector<Leaf*> leaves;
    grid.tree().getNodes(leaves);
    parallelFor(
        leaves.size(), 16,
        [&](size_t begin, size_t end) {
            for (size_t n = begin; n < end; ++n) {
                const points::AttributeHandle<int32_t> ids(leaves[n]->constAttributeArray("id"));
                points::AttributeWriteHandle<T> values(leaves[n]->attributeArray(name));
                for (openvdb::Index k = 0; k < ids.size(); ++k) values.set(k, value(static_cast<size_t>(ids.get(k))));
            }
        },
        monitor);
}

} // namespace

void writePly(const fs::path& path, const Curves& c, const std::function<bool()>& cancelled) {
    checkArrays(c);
    checkIds(c);
    const auto owner = owners(c);
    const auto write = [&](std::ostream& out) {
        out << "ply\nformat binary_little_endian 1.0\nelement vertex " << c.vertices() << '\n';
        for (const char* property : {"x", "y", "z", "speed"}) out << "property float " << property << '\n';
        if (c.hasTrack()) out << "property float f\nproperty float g\n";
        out << "property float " << alongName(c) << "\nproperty int curve\nelement edge " << c.edges()
            << "\nproperty int vertex1\nproperty int vertex2\nend_header\n";
        writeChunks(out, c.vertices(), [&](size_t begin, size_t end, std::string& chunk) {
            for (size_t v = begin; v < end; ++v) {
                for (const double x : {c.x[v], c.y[v], c.z[v]}) appendBytes(chunk, static_cast<float>(x));
                appendBytes(chunk, c.speed(v));
                if (c.hasTrack())
                    for (const double x : {c.f[v], c.g[v]}) appendBytes(chunk, static_cast<float>(x));
                appendBytes(chunk, static_cast<float>(c.along[v]));
                appendBytes(chunk, static_cast<int32_t>(c.id[owner[v]]));
            }
        });
        // Every vertex begins an edge, except the last of an open curve.
        writeChunks(out, c.vertices(), [&](size_t begin, size_t end, std::string& chunk) {
            for (size_t v = begin; v < end; ++v) {
                const size_t k = owner[v];
                const bool last = v + 1 == c.start[k + 1];
                if (last && !c.closed(k)) continue;
                appendBytes(chunk, static_cast<int32_t>(v));
                appendBytes(chunk, static_cast<int32_t>(last ? c.start[k] : v + 1));
            }
        });
    };
    writeAtomically(path, write, cancelled);
}

void writeObj(const fs::path& path, const Curves& c, const std::function<bool()>& cancelled) {
    checkArrays(c);
    const auto owner = owners(c);
    const auto write = [&](std::ostream& out) {
        writeChunks(out, c.vertices(), [&](size_t begin, size_t end, std::string& chunk) {
            for (size_t v = begin; v < end; ++v)
                fmt::format_to(std::back_inserter(chunk), FMT_COMPILE("v {:.9g} {:.9g} {:.9g}\n"), c.x[v], c.y[v],
                               c.z[v]);
        });
        // Each vertex appends its index to its curve's line.
        writeChunks(out, c.vertices(), [&](size_t begin, size_t end, std::string& chunk) {
            const auto to = std::back_inserter(chunk);
            for (size_t v = begin; v < end; ++v) {
                const size_t k = owner[v], first = c.start[k], last = c.start[k + 1] - 1;
                if (v == first) chunk += first == last ? 'p' : 'l';
                fmt::format_to(to, FMT_COMPILE(" {}"), v + 1);
                if (v == last && c.closed(k)) fmt::format_to(to, FMT_COMPILE(" {}"), first + 1);
                if (v == last) chunk += '\n';
            }
        });
    };
    writeAtomically(path, write, cancelled);
}

void writeCsv(const fs::path& path, const Curves& c, const std::function<bool()>& cancelled) {
    checkArrays(c);
    const auto owner = owners(c);
    const auto write = [&](std::ostream& out) {
        out << "curve,vertex,closed,x,y,z,vx,vy,vz,speed," << (c.hasTrack() ? "f,g," : "") << alongName(c) << '\n';
        writeChunks(out, c.vertices(), [&](size_t begin, size_t end, std::string& chunk) {
            const auto to = std::back_inserter(chunk);
            for (size_t v = begin; v < end; ++v) {
                const size_t k = owner[v];
                fmt::format_to(to, FMT_COMPILE("{},{},{:d},{},{},{},{},{},{},{},"), c.id[k], v - c.start[k],
                               c.closed(k), c.x[v], c.y[v], c.z[v], c.vx[v], c.vy[v], c.vz[v], c.speed(v));
                if (c.hasTrack()) fmt::format_to(to, FMT_COMPILE("{},{},"), c.f[v], c.g[v]);
                fmt::format_to(to, FMT_COMPILE("{}\n"), c.along[v]);
            }
        });
    };
    writeAtomically(path, write, cancelled);
}

points::PointDataGrid::Ptr pointGrid(const Curves& c, const PointGridOptions& options, const Monitor& monitor) {
    checkArrays(c);
    checkIds(c);
    Points vertices;
    vertices.x = c.x, vertices.y = c.y, vertices.z = c.z;
    vertices.vx = c.vx, vertices.vy = c.vy, vertices.vz = c.vz;
    vertices.f = c.f, vertices.g = c.g;
    vertices.id.resize(c.vertices());
    std::iota(vertices.id.begin(), vertices.id.end(), int64_t(0));
    auto grid = pointGrid(vertices, options, monitor);
    if (c.vertices() == 0) return grid;
    const auto owner = owners(c);
    addAttribute<int32_t>(
        *grid, "curve", [&](size_t v) { return static_cast<int32_t>(c.id[owner[v]]); }, monitor);
    addAttribute<int32_t>(
        *grid, "vertex", [&](size_t v) { return static_cast<int32_t>(v - c.start[owner[v]]); }, monitor);
    addAttribute<int32_t>(
        *grid, "closed", [&](size_t v) { return static_cast<int32_t>(c.closed(owner[v])); }, monitor);
    addAttribute<float>(
        *grid, "speed", [&](size_t v) { return c.speed(v); }, monitor);
    addAttribute<float>(
        *grid, alongName(c), [&](size_t v) { return static_cast<float>(c.along[v]); }, monitor);
    return grid;
}

} // namespace curlew
