// SPDX-License-Identifier: Apache-2.0
#include "FileText.h"

#include "HostFiles.h"
#include "ShaderFiles.h"
#include "curlew/app/registry/Text.h"
#include "curlew/base/Memory.h"
#include "curlew/base/Text.h"
#include "curlew/vdb/Openvdb.h"

#include <filesystem>

namespace curlew::app {

namespace {

std::string attributesOf(const Points& p, const std::string& velocity) {
    std::vector<std::string> names{"P"};
    const auto add = [&](bool there, const std::string& name) {
        if (there) names.push_back(name);
    };
    add(p.hasVelocity(), velocity);
    add(true, "id");
    add(p.hasAge(), "age");
    add(p.hasLife(), "life");
    add(p.hasFade(), "fade");
    add(p.hasTrack(), "f");
    add(p.hasTrack(), "g");
    return join(names, " ");
}

/// Returns "vel (vec3s, staggered, 729 active voxels in 9 x 9 x 9)". `header` is the grid in the file, without voxels.
std::string described(const openvdb::GridBase& header, const openvdb::GridBase& grid) {
    const auto size = grid.evalActiveVoxelDim();
    const bool staggered = header.getGridClass() == openvdb::GRID_STAGGERED;
    const bool levelSet = header.getGridClass() == openvdb::GRID_LEVEL_SET;
    return fmt::format("{} ({}{}, {} active voxels in {} x {} x {})",
                       header.getName().empty() ? "unnamed grid" : printable(header.getName()),
                       levelSet ? "level set" : header.valueType(), staggered ? ", staggered" : "",
                       grouped(grid.activeVoxelCount()), size[0], size[1], size[2]);
}

std::string describedObject(const Context& c, const Arguments& a, const Value& value, bool isPage) {
    switch (kindOf(value)) {
        case Kind::points: {
            const PointSet& set = *std::get<PointsPointer>(value);
            if (set.positionsN)
                return fmt::format("{} points of {} dimensions", grouped(set.size()), dimensionOf(*set.positionsN));
            const Points& points = set.particles;
            return fmt::format("{} points ({})", grouped(points.size()), attributesOf(points, pointVelocityOf(a)));
        }
        case Kind::curves: {
            const Curves& curves = *std::get<CurvesPointer>(value);
            return fmt::format("{} curves with {} vertices", grouped(curves.size()), grouped(curves.vertices()));
        }
        case Kind::mesh: {
            const Mesh& mesh = *std::get<MeshPointer>(value);
            return fmt::format("{} points, {} faces", grouped(mesh.points.size()), grouped(mesh.faces()));
        }
        case Kind::image: {
            const Image& image = std::get<std::shared_ptr<const ImageValue>>(value)->image;
            return fmt::format("{} x {} pixels ({})", image.width, image.height, join(image.channels, " "));
        }
        case Kind::flow:
            return fmt::format("a flow in {} dimensions as a {}", dimensionOf(std::get<AnyFlow>(value)),
                               isPage ? "page" : "shader");
        default: {
            const openvdb::GridBase& grid = *std::get<GridValue>(value).grid;
            std::vector<std::string> grids;
            for (const auto& header : headersForFile(c, a, grid)) grids.push_back(described(*header, grid));
            return join(grids, ", ");
        }
    }
}

} // namespace

std::string describedFile(const Context& c, const Arguments& a, const std::string& file) {
    const bool isPage = a.text("format") == "html" || endingOf(file) == kPageEnding;
    std::vector<std::string> objects;
    for (size_t k = 0; k < c.count("what"); ++k) objects.push_back(describedObject(c, a, c.value("what", k), isPage));
    std::string text = objects.empty() ? "JSON" : join(objects, ", ");
    std::error_code error;
    if (const auto bytes = std::filesystem::file_size(file, error); !error && bytes > 0)
        text += ", " + formatBytes(static_cast<double>(bytes));
    return text;
}

} // namespace curlew::app
