// SPDX-License-Identifier: Apache-2.0
#include "Results.h"

#include "Arrays.h"

#include <limits>
#include <numeric>
#include <utility>

namespace curlew::c {

namespace {

template <class... T> // NOLINTNEXTLINE(performance-unnecessary-value-param): it is moved
NamedArray soa(std::string name, const std::vector<T>&... columns) {
    return {.name = std::move(name),
            .count = std::get<0>(std::tie(columns...)).size(),
            .columns = {Column{.data = columns.data()}...}};
}

/// Describes items whose components are stored contiguously.
template <class T>
NamedArray interleaved(std::string name, const T* data, size_t count, size_t components) {
    NamedArray array{.name = std::move(name), .count = count};
    for (size_t c = 0; c < components; ++c) array.columns.push_back({.data = data + c, .step = components});
    return array;
}

template <class T>
T converted(auto value) {
    if constexpr (std::is_integral_v<T>)
        if (!std::in_range<T>(value)) throw ValueError(fmt::format("{} does not fit int32; read it as int64", value));
    return static_cast<T>(value);
}

template <class To, class From>
void copyColumn(const From* from, size_t step, char* to, ptrdiff_t stride, size_t count) {
    if constexpr (std::is_floating_point_v<To> == std::is_floating_point_v<From>)
        parallelFor(count, size_t{1} << 16, [&](size_t begin, size_t end) {
            for (size_t k = begin; k < end; ++k)
                storeAs(converted<To>(from[k * step]), to + static_cast<ptrdiff_t>(k) * stride);
        });
}

template <class To>
void copyColumns(const NamedArray& array, const curlew_buffer& buffer) {
    const ptrdiff_t stride = strideOf(buffer);
    for (size_t c = 0; c < array.columns.size(); ++c)
        std::visit(
            [&](const auto* from) {
                copyColumn<To>(from, array.columns[c].step, static_cast<char*>(buffer.data) + c * sizeof(To), stride,
                               array.count);
            },
            array.columns[c].data);
}

} // namespace

curlew_type NamedArray::type() const {
    return std::visit(
        []<class T>(const T*) {
            if constexpr (std::is_floating_point_v<T>) return sizeof(T) == 4 ? CURLEW_FLOAT32 : CURLEW_FLOAT64;
            return sizeof(T) == 8 ? CURLEW_INT64 : CURLEW_INT32;
        },
        columns.front().data);
}

std::vector<NamedArray> arraysOf(const Points& p) {
    std::vector<NamedArray> arrays{soa("position", p.x, p.y, p.z), soa("id", p.id)};
    if (p.hasVelocity()) arrays.push_back(soa("velocity", p.vx, p.vy, p.vz));
    if (p.hasAge()) arrays.push_back(soa("age", p.age));
    if (p.hasLife()) arrays.push_back(soa("life", p.life));
    if (p.hasFade()) arrays.push_back(soa("fade", p.fade));
    if (p.hasTrack()) arrays.push_back(soa("track", p.f, p.g));
    if (!p.converged.empty()) arrays.push_back(soa("converged", p.converged));
    return arrays;
}

std::vector<NamedArray> arraysOf(const app::AnyPositions& positions) {
    const auto ids = std::make_shared<std::vector<int64_t>>(app::sizeOf(positions));
    std::iota(ids->begin(), ids->end(), 0);
    std::vector<NamedArray> arrays = std::visit(
        [](const auto& all) {
            using Position = typename std::remove_cvref_t<decltype(all)>::value_type;
            const double* first = all.empty() ? nullptr : all.front().c.data();
            return std::vector{interleaved("position", first, all.size(), Position{}.c.size())};
        },
        positions);
    arrays.push_back(soa("id", *ids));
    arrays.back().owner = ids;
    return arrays;
}

std::vector<NamedArray> arraysOf(const Curves& c) {
    std::vector<NamedArray> arrays{soa("position", c.x, c.y, c.z), soa("velocity", c.vx, c.vy, c.vz),
                                   soa("along", c.along)};
    if (c.hasTrack()) arrays.push_back(soa("track", c.f, c.g));
    arrays.push_back(soa("start", c.start));
    arrays.push_back(soa("id", c.id));
    const auto closed = std::make_shared<std::vector<uint8_t>>(c.size());
    for (size_t k = 0; k < c.size(); ++k) (*closed)[k] = static_cast<uint8_t>(c.closed(k));
    arrays.push_back(soa("closed", *closed));
    arrays.back().owner = closed;
    arrays.push_back(soa("length", c.length));
    return arrays;
}

std::vector<NamedArray> arraysOf(const Mesh& mesh) {
    const auto numbers = [](const auto& items) { return items.empty() ? nullptr : items.front().asV(); };
    std::vector<NamedArray> arrays{interleaved("position", numbers(mesh.points), mesh.points.size(), 3),
                                   interleaved("triangles", numbers(mesh.triangles), mesh.triangles.size(), 3),
                                   interleaved("quads", numbers(mesh.quads), mesh.quads.size(), 4)};
    if (!mesh.normals.empty()) arrays.push_back(interleaved("normal", numbers(mesh.normals), mesh.normals.size(), 3));
    if (!mesh.uvs.empty()) arrays.push_back(interleaved("uv", numbers(mesh.uvs), mesh.uvs.size(), 2));
    return arrays;
}

std::vector<NamedArray> arraysOf(const Image& image) {
    return {interleaved("pixels", image.pixels.data(),
                        static_cast<size_t>(image.width) * static_cast<size_t>(image.height), image.channels.size())};
}

void copy(const NamedArray& array, const curlew_buffer& buffer) {
    const bool floats = array.type() == CURLEW_FLOAT32 || array.type() == CURLEW_FLOAT64;
    checkBuffer(buffer, fmt::format("the buffer for '{}'", array.name).c_str(), static_cast<int64_t>(array.count),
                static_cast<int>(array.columns.size()), floats ? Numbers::floats : Numbers::integers);
    switch (buffer.type) {
        case CURLEW_FLOAT32:
            return copyColumns<float>(array, buffer);
        case CURLEW_FLOAT64:
            return copyColumns<double>(array, buffer);
        case CURLEW_INT32:
            return copyColumns<int32_t>(array, buffer);
        default:
            return copyColumns<int64_t>(array, buffer);
    }
}

} // namespace curlew::c
