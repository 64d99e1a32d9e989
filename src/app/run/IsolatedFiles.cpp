// SPDX-License-Identifier: Apache-2.0
#include "curlew/app/run/IsolatedFiles.h"

#include "curlew/app/run/IsolatedModel.h"
#include "curlew/picture/ImageFile.h"
#include "curlew/vdb/NanoFile.h"
#include "curlew/vdb/Openvdb.h"
#include "curlew/vdb/PointFile.h"
#include "curlew/vdb/VdbFile.h"

#include <openvdb/io/Stream.h>
#include <openvdb/points/PointDataGrid.h>

#include <algorithm>
#include <sstream>
#include <type_traits>

namespace curlew::app {

namespace {

namespace fs = std::filesystem;
using Contents = std::vector<VdbContent>;

/// Reads the file in this process.
Contents contentsOf(const fs::path& path, const Monitor& monitor) {
    Contents contents;
    for (openvdb::GridBase::Ptr& grid : readVdb(path, monitor)) {
        VdbContent content{.name = grid->getName(), .value = {}};
        if (const auto points = openvdb::GridBase::grid<openvdb::points::PointDataGrid>(grid)) {
            grid.reset();
            content.value = pointsOf(*points, monitor);
        } else {
            content.value = std::move(grid);
        }
        contents.push_back(std::move(content));
    }
    return contents;
}

Contents nanoContentsOf(const fs::path& path, const Monitor& monitor) {
    Contents contents;
    for (openvdb::GridBase::Ptr& grid : readNano(path, monitor)) contents.push_back({grid->getName(), std::move(grid)});
    return contents;
}

/// Writes the name of each grid and, for points, the arrays. The other grids follow together, as a .vdb without
/// offsets.
void writeParts(const Contents& contents, PartWriter& parts) {
    std::vector<uint8_t> arePoints;
    openvdb::GridPtrVec grids;
    for (const VdbContent& content : contents) {
        arePoints.push_back(std::holds_alternative<Points>(content.value) ? 1 : 0);
        if (!arePoints.back()) grids.push_back(std::get<openvdb::GridBase::Ptr>(content.value));
    }
    parts.array(arePoints);
    for (const VdbContent& content : contents) {
        parts.text(content.name);
        if (const auto* points = std::get_if<Points>(&content.value))
            forEachArray(*points, [&](const auto& values) { parts.array(values); });
    }
    if (grids.empty()) return;
    std::ostringstream out;
    openvdb::io::Stream stream(out);
    stream.setCompression(openvdb::io::COMPRESS_ACTIVE_MASK);
    stream.write(grids);
    parts.text(std::move(out).str());
}

void writeContents(const fs::path& path, PartWriter& parts) { writeParts(contentsOf(path, {}), parts); }
void writeNanoContents(const fs::path& path, PartWriter& parts) { writeParts(nanoContentsOf(path, {}), parts); }

Contents readContents(const std::string& reader, const fs::path& path, const Monitor& monitor) {
    PartReader parts = readIsolated(reader, path, monitor);
    const auto arePoints = parts.array<uint8_t>();
    Contents contents;
    for (const uint8_t isPoints : arePoints) {
        VdbContent& content = contents.emplace_back();
        content.name = parts.text();
        if (!isPoints) continue;
        Points& points = content.value.emplace<Points>();
        forEachArray(points, [&](auto& values) {
            monitor.check();
            values = parts.array<typename std::remove_cvref_t<decltype(values)>::value_type>();
        });
        forEachArray(points, [&](const auto& values) {
            if (!values.empty() && values.size() != points.size()) throw parts.damaged();
        });
        if (points.y.size() != points.size() || points.z.size() != points.size() || points.id.size() != points.size())
            throw parts.damaged();
    }
    const bool anyGrid = std::find(arePoints.begin(), arePoints.end(), 0) != arePoints.end();
    const std::string bytes = anyGrid ? parts.text() : std::string();
    parts.finish();
    if (!anyGrid) return contents;
    auto grids = readVdbBytes(bytes, path, monitor);
    for (VdbContent& content : contents) {
        if (std::holds_alternative<Points>(content.value)) continue;
        if (grids.empty()) throw parts.damaged();
        content.value = std::move(grids.front());
        grids.erase(grids.begin());
    }
    return contents;
}

void writeImageParts(const fs::path& path, PartWriter& parts) {
    const Image image = readExr(path);
    parts.array(std::vector<int>{image.width, image.height});
    parts.array(std::vector<uint64_t>{image.channels.size()});
    for (const std::string& channel : image.channels) parts.text(channel);
    parts.array(image.pixels);
}

void writeModelParts(const fs::path& path, PartWriter& parts) { writeModel(importModel(path), parts); }

} // namespace

std::vector<VdbContent> readVdbContent(const fs::path& path, const Monitor& monitor) {
    if (!readsIsolated()) return contentsOf(path, monitor);
    const std::vector<GridInfo> grids = vdbContents(path);
    const bool anyPoints =
        std::any_of(grids.begin(), grids.end(), [](const GridInfo& grid) { return grid.kind == GridKind::points; });
    return anyPoints ? readContents("vdb", path, monitor) : contentsOf(path, monitor);
}

std::vector<VdbContent> readNanoContent(const fs::path& path, const Monitor& monitor) {
    return readsIsolated() ? readContents("nvdb", path, monitor) : nanoContentsOf(path, monitor);
}

Image readExrImage(const fs::path& path, const Monitor& monitor) {
    if (!readsIsolated()) return readExr(path, monitor);
    PartReader parts = readIsolated("exr", path, monitor);
    Image image;
    const auto size = parts.array<int>();
    const auto channels = parts.array<uint64_t>();
    if (size.size() != 2 || channels.size() != 1) throw parts.damaged();
    image.width = size[0], image.height = size[1];
    for (uint64_t k = 0; k < channels[0]; ++k) image.channels.emplace_back(parts.text());
    image.pixels = parts.array<float>();
    parts.finish();
    try {
        checkImage(image);
    } catch (const ValueError&) {
        throw parts.damaged();
    }
    return image;
}

AnimatedMesh readModel(const fs::path& path, const Monitor& monitor) {
    if (!readsIsolated()) return AnimatedMesh::read(path, monitor.cancelled);
    PartReader parts = readIsolated("model", path, monitor);
    ModelData model = takeModel(parts);
    parts.finish();
    return AnimatedMesh(std::move(model));
}

IsolatedReader isolatedReaderOf(const std::string& name) {
    if (name == "vdb") return writeContents;
    if (name == "nvdb") return writeNanoContents;
    if (name == "exr") return writeImageParts;
    if (name == "model") return writeModelParts;
    return nullptr;
}

} // namespace curlew::app
