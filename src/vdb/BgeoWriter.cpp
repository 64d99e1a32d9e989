// SPDX-License-Identifier: Apache-2.0
#include "BgeoLayout.h"
#include "ChunkedWriter.h"
#include "CurveArrays.h"
#include "FiniteChecks.h"
#include "PointArrays.h"
#include "curlew/base/AtomicFile.h"
#include "curlew/vdb/BgeoFile.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <string_view>

namespace curlew {

namespace {

namespace fs = std::filesystem;

template <class T>
void appendBig(std::string& bytes, T value) {
    const size_t first = bytes.size();
    appendBytes(bytes, value);
    std::reverse(bytes.begin() + static_cast<std::ptrdiff_t>(first), bytes.end());
}

/// Number of elements in the header.
struct Counts {
    size_t points = 0, primitives = 0, pointAttributes = 0, primitiveAttributes = 0;
};

std::string headerOf(const Counts& counts) {
    std::string header = "BgeoV";
    constexpr int32_t groups = 0, vertexAttributes = 0, detailAttributes = 0;
    for (const int32_t number :
         {bgeo::kVersion, static_cast<int32_t>(counts.points), static_cast<int32_t>(counts.primitives), groups, groups,
          static_cast<int32_t>(counts.pointAttributes), vertexAttributes,
          static_cast<int32_t>(counts.primitiveAttributes), detailAttributes})
        appendBig(header, number);
    return header;
}

/// Appends the declaration of an attribute, with zeros as its default.
void declare(std::string& bytes, std::string_view name, int32_t type, uint16_t size) {
    appendBig(bytes, static_cast<uint16_t>(name.size()));
    bytes += name;
    appendBig(bytes, size);
    appendBig(bytes, type);
    for (int k = 0; k < size; ++k) appendBig(bytes, int32_t{0});
}

template <class PointsOrCurves>
void appendPosition(std::string& bytes, const PointsOrCurves& p, size_t n) {
    constexpr float weight = 1; // of homogeneous coordinates
    for (const double x : {p.x[n], p.y[n], p.z[n]}) appendBig(bytes, static_cast<float>(x));
    appendBig(bytes, weight);
}

template <class PointsOrCurves>
void appendVelocity(std::string& bytes, const PointsOrCurves& p, size_t n) {
    for (const float v : {p.vx[n], p.vy[n], p.vz[n]}) appendBig(bytes, v);
}

/// The groups and further data, of which there are none.
constexpr std::string_view kEnd("\x00\xff", 2);

void requireCount(size_t points) {
    if (points > static_cast<size_t>(std::numeric_limits<int32_t>::max()))
        throw ValueError(fmt::format("{} points are too many for the 32-bit counts of a .bgeo; write .vdb", points));
}

} // namespace

void writeBgeo(const fs::path& path, const Points& particles, const std::function<bool()>& cancelled) {
    checkArrays(particles);
    checkIds(particles);
    requireFinite(particles, "point");
    requireCount(particles.size());
    const std::vector<Scalar> scalars = scalarsOf(particles);
    const bool velocity = particles.hasVelocity();
    std::string header =
        headerOf({.points = particles.size(), .pointAttributes = (velocity ? 1u : 0u) + 1 + scalars.size()});
    if (velocity) declare(header, "v", bgeo::kVector, 3);
    declare(header, "id", bgeo::kInteger, 1);
    for (const Scalar& scalar : scalars) declare(header, scalar.name, bgeo::kFloat, 1);
    const auto write = [&](std::ostream& out) {
        out << header;
        writeChunks(out, particles.size(), [&](size_t begin, size_t end, std::string& bytes) {
            for (size_t n = begin; n < end; ++n) {
                appendPosition(bytes, particles, n);
                if (velocity) appendVelocity(bytes, particles, n);
                appendBig(bytes, static_cast<int32_t>(particles.id[n]));
                for (const Scalar& scalar : scalars) appendBig(bytes, scalar.of(particles, n));
            }
        });
        out << kEnd;
    };
    writeAtomically(path, write, cancelled);
}

void writeBgeo(const fs::path& path, const Curves& c, const std::function<bool()>& cancelled) {
    checkArrays(c);
    checkIds(c);
    requireFinite(c, "vertex");
    size_t polygons = 0;
    for (size_t k = 0; k < c.size(); ++k) polygons += c.start[k + 1] > c.start[k];
    std::string header = headerOf({.points = c.vertices(),
                                   .primitives = polygons,
                                   .pointAttributes = c.hasTrack() ? 4u : 2u,
                                   .primitiveAttributes = 1});
    declare(header, "v", bgeo::kVector, 3);
    declare(header, alongName(c), bgeo::kFloat, 1);
    if (c.hasTrack())
        for (const char* name : {"f", "g"}) declare(header, name, bgeo::kFloat, 1);
    const auto write = [&](std::ostream& out) {
        out << header;
        writeChunks(out, c.vertices(), [&](size_t begin, size_t end, std::string& bytes) {
            for (size_t v = begin; v < end; ++v) {
                appendPosition(bytes, c, v);
                appendVelocity(bytes, c, v);
                appendBig(bytes, static_cast<float>(c.along[v]));
                if (c.hasTrack())
                    for (const double value : {c.f[v], c.g[v]}) appendBig(bytes, static_cast<float>(value));
            }
        });
        std::string attributes;
        declare(attributes, "id", bgeo::kInteger, 1);
        out << attributes;
        const bool wide = bgeo::hasWideIndices(c.vertices());
        writeChunks(out, c.size(), [&](size_t begin, size_t end, std::string& bytes) {
            for (size_t k = begin; k < end; ++k) {
                if (c.start[k + 1] == c.start[k]) continue;
                appendBig(bytes, bgeo::kPolygon);
                appendBig(bytes, static_cast<int32_t>(c.start[k + 1] - c.start[k]));
                bytes += c.closed(k) ? bgeo::kClosed : bgeo::kOpen;
                for (size_t v = c.start[k]; v < c.start[k + 1]; ++v)
                    wide ? appendBig(bytes, static_cast<uint32_t>(v)) : appendBig(bytes, static_cast<uint16_t>(v));
                appendBig(bytes, static_cast<int32_t>(c.id[k]));
            }
        });
        out << kEnd;
    };
    writeAtomically(path, write, cancelled);
}

} // namespace curlew
