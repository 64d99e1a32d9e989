// SPDX-License-Identifier: Apache-2.0
#include "curlew/vdb/PointFile.h"

#include "ChunkedWriter.h"
#include "PointArrays.h"
#include "curlew/base/AtomicFile.h"
#include "curlew/base/Error.h"
#include "curlew/vdb/Openvdb.h"

#include <fmt/compile.h>
#include <fmt/format.h>

#include <iterator>
#include <utility>

namespace curlew {

namespace fs = std::filesystem;

void checkArrays(const Points& particles) {
    const size_t size = particles.size();
    const auto whole = [size](const auto&... arrays) { return ((arrays.size() == size) && ...); };
    const auto wholeOrNone = [&](const auto&... arrays) { return (arrays.empty() && ...) || whole(arrays...); };
    if (!whole(particles.y, particles.z, particles.id) || !wholeOrNone(particles.vx, particles.vy, particles.vz))
        throw ValueError(
            fmt::format("the particle arrays differ in length (x has {}, y {}, z {}, id {}, vx {}, vy {}, vz {}); make "
                        "them equal, or leave out the velocity",
                        size, particles.y.size(), particles.z.size(), particles.id.size(), particles.vx.size(),
                        particles.vy.size(), particles.vz.size()));
    if (!wholeOrNone(particles.age) || !wholeOrNone(particles.life) || !wholeOrNone(particles.fade) ||
        !wholeOrNone(particles.f, particles.g))
        throw ValueError(
            fmt::format("the particle arrays differ in length (x has {}, age {}, life {}, fade {}, f {}, g {}); give "
                        "each as many values as x, or none",
                        size, particles.age.size(), particles.life.size(), particles.fade.size(), particles.f.size(),
                        particles.g.size()));
}

void checkIds(const Points& particles) {
    for (const int64_t id : particles.id)
        if (!std::in_range<int32_t>(id))
            throw ValueError(
                fmt::format("the particle id {} does not fit in the 32 bits that point files have for it; number the "
                            "particles from 0, or write .csv",
                            id));
}

std::vector<Scalar> scalarsOf(const Points& particles) {
    std::vector<Scalar> scalars;
    for (const Scalar& scalar : kScalars)
        if (scalar.in(particles)) scalars.push_back(scalar);
    return scalars;
}

void writePly(const fs::path& path, const Points& particles, const std::function<bool()>& cancelled) {
    checkArrays(particles);
    checkIds(particles);
    const bool velocity = particles.hasVelocity();
    const std::vector<Scalar> scalars = scalarsOf(particles);
    const auto write = [&](std::ostream& out) {
        out << "ply\nformat binary_little_endian 1.0\nelement vertex " << particles.size() << '\n';
        for (const char* property : {"x", "y", "z"}) out << "property float " << property << '\n';
        if (velocity)
            for (const char* property : {"vx", "vy", "vz"}) out << "property float " << property << '\n';
        out << "property int id\n";
        for (const Scalar& scalar : scalars) out << "property float " << scalar.name << '\n';
        out << "end_header\n";
        writeChunks(out, particles.size(), [&](size_t begin, size_t end, std::string& chunk) {
            for (size_t n = begin; n < end; ++n) {
                for (const double x : {particles.x[n], particles.y[n], particles.z[n]})
                    appendBytes(chunk, static_cast<float>(x));
                if (velocity)
                    for (const float v : {particles.vx[n], particles.vy[n], particles.vz[n]}) appendBytes(chunk, v);
                appendBytes(chunk, static_cast<int32_t>(particles.id[n]));
                for (const Scalar& scalar : scalars) appendBytes(chunk, scalar.of(particles, n));
            }
        });
    };
    writeAtomically(path, write, cancelled);
}

void writeCsv(const fs::path& path, const Points& particles, const std::function<bool()>& cancelled) {
    checkArrays(particles);
    const bool velocity = particles.hasVelocity();
    const std::vector<Scalar> scalars = scalarsOf(particles);
    const auto write = [&](std::ostream& out) {
        out << (velocity ? "x,y,z,vx,vy,vz,id" : "x,y,z,id");
        for (const Scalar& scalar : scalars) out << ',' << scalar.name;
        out << '\n';
        writeChunks(out, particles.size(), [&](size_t begin, size_t end, std::string& chunk) {
            const auto to = std::back_inserter(chunk);
            for (size_t n = begin; n < end; ++n) {
                fmt::format_to(to, FMT_COMPILE("{:.9g},{:.9g},{:.9g},"), particles.x[n], particles.y[n],
                               particles.z[n]);
                if (velocity)
                    fmt::format_to(to, FMT_COMPILE("{:.9g},{:.9g},{:.9g},"), particles.vx[n], particles.vy[n],
                                   particles.vz[n]);
                fmt::format_to(to, FMT_COMPILE("{}"), particles.id[n]);
                for (const Scalar& scalar : scalars)
                    fmt::format_to(to, FMT_COMPILE(",{:.9g}"), scalar.of(particles, n));
                chunk += '\n';
            }
        });
    };
    writeAtomically(path, write, cancelled);
}

} // namespace curlew
