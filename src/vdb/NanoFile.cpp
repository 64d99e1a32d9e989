// SPDX-License-Identifier: Apache-2.0
#include "curlew/vdb/NanoFile.h"

#include "DenseBox.h"
#include "HalfFloats.h"
#include "curlew/base/AtomicFile.h"
#include "curlew/base/InputFile.h"
#include "curlew/vdb/Openvdb.h"

#include <fmt/format.h>

#define NANOVDB_USE_BLOSC
#define NANOVDB_USE_ZIP
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wall"
#pragma GCC diagnostic ignored "-Wextra"
#pragma GCC diagnostic ignored "-Wpedantic"
#pragma GCC diagnostic ignored "-Wconversion"
#pragma GCC diagnostic ignored "-Wshadow"
#pragma GCC diagnostic ignored "-Wold-style-cast"
#include <nanovdb/util/IO.h>
#include <nanovdb/util/NanoToOpenVDB.h>
#include <nanovdb/util/OpenToNanoVDB.h>
#pragma GCC diagnostic pop

#include <algorithm>
#include <cstring>
#include <fstream>
#include <limits>

namespace curlew {

namespace {

namespace fs = std::filesystem;
using openvdb::GridBase;

// ---- Writing

/// A buffer whose bytes are 0 at first. NanoVDB leaves some of them as they are, and the file must not depend on what
/// was in memory.
class ZeroedBuffer : public nanovdb::HostBuffer {
  public:
    using HostBuffer::HostBuffer;
    static ZeroedBuffer create(uint64_t bytes, const ZeroedBuffer* = nullptr) {
        ZeroedBuffer buffer(bytes);
        std::memset(buffer.data(), 0, bytes);
        return buffer;
    }
};

using Handle = nanovdb::GridHandle<ZeroedBuffer>;

template <class GridType, class Build>
Handle convert(const GridType& grid) {
    nanovdb::OpenToNanoVDB<typename GridType::BuildType, Build, nanovdb::AbsDiff, ZeroedBuffer> convert;
    return convert(grid);
}

/// Converts the grid if it is of the type; otherwise returns an empty handle.
template <class GridType, class Build>
Handle tried(const GridBase& grid) {
    return grid.isType<GridType>() ? convert<GridType, Build>(static_cast<const GridType&>(grid)) : Handle();
}

Handle nanoOf(const GridBase& grid, bool half) {
    if (grid.activeVoxelCount() == 0)
        throw ValueError(fmt::format("{} has no active voxels, so there is nothing to write", titleOf(grid)));
    linearMapOf(grid); // throws if there is none
    requireMemory(1.5 * static_cast<double>(grid.memUsage()), fmt::format("{} as NanoVDB", titleOf(grid)),
                  "use larger voxels, or write .vdb");
    if (Handle handle = half ? tried<openvdb::FloatGrid, nanovdb::Fp16>(grid) : Handle()) return handle;
    if (Handle handle = tried<openvdb::FloatGrid, float>(grid)) return handle;
    if (Handle handle = tried<openvdb::Vec3SGrid, nanovdb::Vec3f>(grid)) return handle;
    if (Handle handle = tried<openvdb::DoubleGrid, double>(grid)) return handle;
    if (Handle handle = tried<openvdb::Int32Grid, int32_t>(grid)) return handle;
    if (Handle handle = tried<openvdb::Int64Grid, int64_t>(grid)) return handle;
    throw ValueError(fmt::format("{} is of type {}; a .nvdb holds float, double, int32, int64 and vec3s", titleOf(grid),
                                 grid.valueType()));
}

nanovdb::io::Codec codecOf(Codec codec) {
    if (codec == Codec::zip) return nanovdb::io::Codec::ZIP;
    return codec == Codec::blosc ? nanovdb::io::Codec::BLOSC : nanovdb::io::Codec::NONE;
}

// ---- Reading

FileError unreadable(const fs::path& path, std::string_view why) {
    return FileError(fmt::format("'{}' {}; write or copy it again", path.string(), why));
}

/// A grid as the file's headers describe it.
struct Entry {
    nanovdb::io::MetaData header;
    std::string name;
};

/// Reads the headers of all grids and checks their sizes against the file's.
std::vector<Entry> entriesOf(std::istream& in, const fs::path& path) {
    constexpr uint32_t kLongestName = 1u << 16;
    const auto left = [&, size = fs::file_size(path)] { return size - static_cast<uintmax_t>(in.tellg()); };
    std::vector<Entry> entries;
    while (left() > 0) {
        nanovdb::io::Header segment;
        in.read(reinterpret_cast<char*>(&segment), sizeof segment);
        if (segment.magic != NANOVDB_MAGIC_NUMBER)
            throw unreadable(path, entries.empty() ? "is not a .nvdb file" : "is damaged");
        if (segment.version.getMajor() != NANOVDB_MAJOR_VERSION_NUMBER)
            throw FileError(
                fmt::format("'{}' has the NanoVDB format version {}, but this program reads {}; convert it to "
                            ".vdb with nanovdb_convert of its own version",
                            path.string(), segment.version.getMajor(), NANOVDB_MAJOR_VERSION_NUMBER));
        uintmax_t data = 0;
        for (int k = 0; k < segment.gridCount; ++k) {
            Entry entry;
            in.read(reinterpret_cast<char*>(&entry.header), sizeof entry.header);
            if (entry.header.nameSize == 0 || entry.header.nameSize > kLongestName)
                throw unreadable(path, "is damaged");
            entry.name.resize(entry.header.nameSize);
            in.read(entry.name.data(), std::streamsize(entry.name.size()));
            entry.name.resize(std::min(entry.name.find('\0'), entry.name.size()));
            if (entry.header.fileSize > left() - std::min<uintmax_t>(left(), data))
                throw unreadable(path, "is cut short");
            if (segment.codec == nanovdb::io::Codec::NONE && entry.header.fileSize != entry.header.gridSize)
                throw unreadable(path, "is damaged");
            data += entry.header.fileSize;
            entries.push_back(std::move(entry));
        }
        in.seekg(static_cast<std::streamoff>(data), std::ios::cur);
    }
    if (entries.empty()) throw unreadable(path, "has no grids");
    return entries;
}

/// Checks that all nodes of a grid lie in its buffer, before anything follows their offsets.
template <class Build>
class NodeCheck {
  public:
    explicit NodeCheck(const nanovdb::GridHandle<>& handle)
        : mBegin(handle.data()), mEnd(mBegin + handle.size()), mLeft(handle.size()) {}

    /// Throws std::runtime_error if an offset is wrong.
    void check() {
        const auto& grid = require(reinterpret_cast<const nanovdb::NanoGrid<Build>*>(mBegin));
        const auto& tree = require(reinterpret_cast<const nanovdb::NanoTree<Build>*>(&grid + 1));
        const auto* root = require(&tree.root()).data();
        const auto room = static_cast<uint64_t>(mEnd - reinterpret_cast<const uint8_t*>(root));
        if (root->mTableSize > room / sizeof(*root->tile(0)) ||
            nanovdb::NanoRoot<Build>::memUsage(root->mTableSize) > room)
            fail();
        for (uint32_t k = 0; k < root->mTableSize; ++k)
            if (const auto* tile = root->tile(k); tile->isChild()) checkNode(require(root->getChild(tile)));
    }

  private:
    [[noreturn]] static void fail() { throw std::runtime_error("an offset is wrong"); }

    /// Every node occurs once, so all nodes together are no larger than the buffer.
    template <class Node>
    const Node& require(const Node* node) {
        const auto* begin = reinterpret_cast<const uint8_t*>(node);
        const bool inside = std::greater_equal<>()(begin, mBegin) && std::less<>()(begin, mEnd) &&
                            sizeof(Node) <= static_cast<size_t>(mEnd - begin) && sizeof(Node) <= mLeft;
        if (!inside || (begin - mBegin) % NANOVDB_DATA_ALIGNMENT != 0) fail();
        mLeft -= sizeof(Node);
        return *node;
    }

    template <class Node>
    void checkNode(const Node& node) {
        for (auto child = node.data()->mChildMask.beginOn(); child; ++child) {
            const auto& below = require(node.data()->getChild(*child));
            if constexpr (Node::LEVEL > 1) checkNode(below);
        }
    }

    const uint8_t *mBegin, *mEnd;
    uint64_t mLeft;
};

template <class Build>
bool tryRead(const nanovdb::GridHandle<>& handle, GridBase::Ptr& result) {
    if (!handle.grid<Build>()) return false;
    NodeCheck<Build>(handle).check();
    result = nanovdb::nanoToOpenVDB(*handle.grid<Build>());
    return true;
}

GridBase::Ptr openOf(nanovdb::GridHandle<> handle, const Entry& entry, const fs::path& path) {
    auto* grid = reinterpret_cast<nanovdb::GridData*>(handle.data());
    if (handle.size() < sizeof *grid || grid->mMagic != NANOVDB_MAGIC_NUMBER || grid->mGridSize != handle.size() ||
        grid->mGridCount != 1 || grid->mGridIndex != 0)
        throw unreadable(path, "is damaged");
    // The name is that of the entry. NanoVDB would follow an offset to a long one, and read a short one up to a 0.
    grid->setLongGridNameOn(false);
    grid->mGridName[nanovdb::GridData::MaxNameSize - 1] = '\0';
    GridBase::Ptr result;
    const auto any = [&]<class... Builds>(Builds*...) { return (tryRead<Builds>(handle, result) || ...); };
    constexpr auto of = []<class T>() { return static_cast<T*>(nullptr); };
    using namespace nanovdb;
    if (!any(of.operator()<float>(), of.operator()<Vec3f>(), of.operator()<double>(), of.operator()<int32_t>(),
             of.operator()<int64_t>(), of.operator()<Fp4>(), of.operator()<Fp8>(), of.operator()<Fp16>()))
        throw FileError(fmt::format("'{}': the grid '{}' is of a type that is not read; write float or Vec3f",
                                    path.string(), entry.name));
    result->setName(entry.name);
    if (result->isType<openvdb::Vec3SGrid>()) result->setVectorType(openvdb::VEC_CONTRAVARIANT_RELATIVE);
    return result;
}

/// Returns use(), with the exceptions of NanoVDB and the stream as FileError.
template <class Use>
auto readSafely(const fs::path& path, const Use& use) {
    try {
        return use();
    } catch (const Error&) {
        throw;
    } catch (const std::bad_alloc&) {
        throw unreadable(path, "needs more memory than is available, or is damaged");
    } catch (const std::exception&) {
        throw unreadable(path, "is cut short or damaged");
    }
}

GridKind kindOf(const nanovdb::io::MetaData& header) {
    if (header.gridType == nanovdb::GridType::Vec3f) return GridKind::velocity;
    if (header.gridClass == nanovdb::GridClass::LevelSet) return GridKind::levelSet;
    return header.gridClass == nanovdb::GridClass::FogVolume ? GridKind::fogVolume : GridKind::other;
}

} // namespace

void writeNano(const fs::path& path, const std::vector<GridBase::ConstPtr>& grids, const VdbWriteOptions& options,
               const std::function<bool()>& cancelled) {
    openvdb::initialize();
    if (grids.empty()) throw ValueError(fmt::format("there is no grid to write to '{}'", path.string()));
    std::vector<Handle> handles;
    handles.reserve(grids.size());
    for (const GridBase::ConstPtr& grid : grids) {
        const bool scalar = grid->isType<openvdb::FloatGrid>(); // vectors stay floats
        handles.push_back(nanoOf(*grid, scalar && writesHalf(*grid, options.half)));
    }
    writeAtomically(
        path, [&](std::ostream& out) { nanovdb::io::writeGrids(out, handles, codecOf(options.codec)); }, cancelled);
}

std::vector<GridBase::Ptr> readNano(const fs::path& path, const Monitor& monitor) {
    openvdb::initialize();
    std::ifstream in = openToRead(path);
    return readSafely(path, [&] {
        const std::vector<Entry> entries = entriesOf(in, path);
        double bytes = 0;
        for (const Entry& entry : entries) bytes += 2.5 * static_cast<double>(entry.header.gridSize); // in both forms
        requireMemory(bytes, fmt::format("'{}'", path.string()),
                      "free some memory, or write fewer grids into one file");
        std::vector<GridBase::Ptr> grids;
        for (size_t k = 0; k < entries.size(); ++k) {
            monitor.check();
            in.seekg(0);
            grids.push_back(openOf(nanovdb::io::readGrid<nanovdb::HostBuffer>(in, k), entries[k], path));
        }
        return grids;
    });
}

std::vector<GridInfo> nanoContents(const fs::path& path) {
    std::ifstream in = openToRead(path);
    return readSafely(path, [&] {
        std::vector<GridInfo> grids;
        for (const Entry& entry : entriesOf(in, path))
            grids.push_back(
                {.name = entry.name, .type = nanovdb::toStr(entry.header.gridType), .kind = kindOf(entry.header)});
        return grids;
    });
}

} // namespace curlew
