// SPDX-License-Identifier: Apache-2.0
#include "VdbValidation.h"

#include "PointValidation.h"
#include "VdbCursor.h"
#include "curlew/base/Error.h"
#include "curlew/vdb/Openvdb.h"

#include <blosc.h>
#include <fmt/format.h>
#include <openvdb/io/Archive.h>
#include <openvdb/io/GridDescriptor.h>
#include <openvdb/points/PointDataGrid.h>

#include <algorithm>
#include <array>
#include <bit>
#include <string_view>

namespace curlew {

namespace {

namespace fs = std::filesystem;

/// The data of a tree's leaves besides their mask.
enum class LeafData {
    values,
    bits,    ///< Origin and another mask.
    origin,  ///< Origin only.
    indices, ///< Values, a list of indices, and reserved bytes.
    points
};

/// Storage of a tree's values.
struct ValueLayout {
    std::string_view name;
    size_t size, halfSize; ///< Bytes per value; the same in the voxels of a grid with half floats.
    LeafData leaves = LeafData::values;
};

constexpr std::array<ValueLayout, 11> kLayouts{{{"bool", 1, 1, LeafData::bits},
                                                {"mask", 1, 1, LeafData::origin},
                                                {"float", 4, 2},
                                                {"double", 8, 2},
                                                {"int32", 4, 4},
                                                {"int64", 8, 8},
                                                {"vec3i", 12, 12},
                                                {"vec3s", 12, 6},
                                                {"vec3d", 24, 6},
                                                {"ptidx32", 4, 4, LeafData::indices},
                                                {"ptdataidx32", 4, 4, LeafData::points}}};

/// Memory of a node: a slot for each child or tile; values of over 8 bytes are allocated separately. A leaf has its
/// mask, its origin and the allocator's overhead.
double nodeMemory(size_t slots, size_t valueBytes) {
    constexpr double slot = 8, masks = 0.25, allocated = 32;
    return double(slots) * (slot + masks + (valueBytes > 8 ? allocated : 0));
}
double leafMemory(const ValueLayout& layout) {
    constexpr double voxels = 512, fixed = 160;
    const bool array = layout.leaves == LeafData::values || layout.leaves == LeafData::indices;
    return fixed + (array ? voxels * double(layout.size) : 64);
}

class Validation {
  public:
    Validation(std::istream& in, const fs::path& path) : mCursor(in, path), mPath(path) {}

    /// Checks the whole file.
    VdbSizes checkAll() {
        const bool hasOffsets = checkHeader();
        checkGrids(hasOffsets);
        if (hasOffsets && mUuid[14] == kDigestVersion) checkDigest();
        mCursor.seek(0);
        return mSizes;
    }

    /// Checks the headers of the grids; the whole file if it has no offsets to find them by.
    std::vector<GridInfo> checkHeaders() {
        if (!checkHeader()) {
            checkGrids(false);
            return mInfos;
        }
        for (int32_t left = readCount(); left > 0; --left) {
            const GridHeader header = readGridHeader(true);
            if (header.end < mCursor.position()) damaged();
            mCursor.seek(header.end);
            mInfos.push_back(header.info);
        }
        return mInfos;
    }

  private:
    [[noreturn]] void damaged() const { mCursor.damaged(); }

    void checkGrids(bool hasOffsets) {
        bool walked = true;
        for (int32_t left = readCount(); left > 0 && walked; --left) walked = checkGrid(hasOffsets);
        // Bytes that follow the last grid show that some before it have moved.
        std::streamoff last = mCursor.position();
        if (hasOffsets)
            for (const std::streamoff end : mEnds) last = std::max(last, end);
        if (walked && last != mCursor.size()) damaged();
    }

    /// Reads the header of the file. Returns whether its grids have offsets.
    bool checkHeader() {
        if (mCursor.size() < std::streamoff(sizeof(int64_t)) || mCursor.read<int64_t>() != openvdb::OPENVDB_MAGIC)
            throw FileError(fmt::format("'{}' is not a .vdb file; give one that OpenVDB wrote", mPath.string()));
        constexpr uint32_t oldest = openvdb::OPENVDB_FILE_VERSION_NODE_MASK_COMPRESSION;
        constexpr uint32_t newest = openvdb::OPENVDB_FILE_VERSION;
        const uint32_t version = mVersion = mCursor.read<uint32_t>();
        if (version < oldest || version > newest)
            throw FileError(
                fmt::format("'{}' has version {} of the .vdb format, but only versions {} to {} can be read; save it "
                            "again with another OpenVDB",
                            mPath.string(), version, oldest, newest));
        const auto major = mCursor.read<uint32_t>(), minor = mCursor.read<uint32_t>();
        openvdb::io::setVersion(mCursor.stream(), {major, minor}, version);
        const bool hasOffsets = mCursor.read<char>() != 0;
        mUuid = mCursor.read<std::array<char, kUuidLength>>();
        mCursor.checkMetadata();
        return hasOffsets;
    }

    int32_t readCount() {
        const auto count = mCursor.read<int32_t>();
        if (count < 0) damaged();
        return count;
    }

    struct GridHeader {
        GridInfo info;
        bool half, isInstance;
        int64_t blocks, end; ///< Where the grid's values begin, and where the grid ends.
    };

    /// Reads everything before the tree.
    GridHeader readGridHeader(bool hasOffsets) {
        const std::string uniqueName = mCursor.readString();
        const std::string name = oneLine(openvdb::io::GridDescriptor::nameAsString(uniqueName));
        std::string type = mCursor.readString();
        constexpr std::string_view suffix = "_HalfFloat";
        const bool half = type.ends_with(suffix);
        if (half) type.resize(type.size() - suffix.size());
        if (!openvdb::GridBase::isRegistered(type))
            throw FileError(fmt::format("'{}' contains a grid '{}' of the unknown type '{}'; leave that grid out",
                                        mPath.string(), name, oneLine(type)));
        const bool isInstance = !mCursor.readString().empty();
        mOffsets.push_back(mCursor.position());
        const auto begin = mCursor.read<int64_t>(), blocks = mCursor.read<int64_t>(), end = mCursor.read<int64_t>();
        if (hasOffsets) {
            if (end > mCursor.size())
                throw FileError(fmt::format("'{}' is cut short: it has {} of at least {} bytes; write or copy it again",
                                            mPath.string(), mCursor.size(), end));
            if (begin != mCursor.position() || end < begin) damaged();
        }
        mCompression = mCursor.read<uint32_t>();
        const auto named = mCursor.checkMetadata(openvdb::GridBase::META_GRID_CLASS);
        const auto gridClass = named ? openvdb::GridBase::stringToGridClass(*named) : openvdb::GRID_UNKNOWN;
        mCursor.checkTransform();
        return {{openvdb::io::GridDescriptor::stripSuffix(uniqueName), type, gridKind(type, gridClass)},
                half,
                isInstance,
                blocks,
                end};
    }

    /// Checks one grid. Returns whether the stream is then at its end.
    bool checkGrid(bool hasOffsets) {
        const auto [info, half, isInstance, blocks, end] = readGridHeader(hasOffsets);
        mInfos.push_back(info);
        bool atEnd = isInstance;
        for (const ValueLayout& layout : kLayouts) {
            if (isInstance || info.type != fmt::format("Tree_{}_5_4_3", layout.name)) continue;
            const uint64_t leaves = checkTopology(layout, half);
            if (hasOffsets && blocks != mCursor.position()) damaged();
            checkLeaves(layout, half, leaves);
            atEnd = true;
        }
        if (hasOffsets && atEnd && end != mCursor.position()) damaged();
        if (hasOffsets) mCursor.seek(end);
        mEnds.push_back(end);
        return hasOffsets || atEnd;
    }

    void checkLeaves(const ValueLayout& layout, bool half, uint64_t leaves) {
        constexpr uint64_t mask = 64, origin = sizeof(openvdb::Coord);
        if (layout.leaves == LeafData::points) {
            const PointSizes sizes = validatePoints(mCursor, leaves, mVersion);
            mSizes.bytes += sizes.bytes;
            return;
        }
        mSizes.bytes += double(leaves) * leafMemory(layout);
        for (uint64_t n = 0; n < leaves; ++n) switch (layout.leaves) {
                case LeafData::bits:
                    mCursor.skip(mask + origin + mask);
                    break;
                case LeafData::origin:
                    mCursor.skip(mask + origin);
                    break;
                case LeafData::indices:
                    checkValues<3>(readMask<3>(), layout, half);
                    mSizes.bytes += double(skipCounted(sizeof(uint32_t)));
                    skipCounted(1);
                    break;
                default:
                    checkValues<3>(readMask<3>(), layout, half);
            }
    }

    /// Skips a list preceded by its length. Returns its size in bytes.
    uint64_t skipCounted(uint64_t bytes) {
        const auto count = mCursor.read<uint64_t>();
        if (count > uint64_t(mCursor.left()) / bytes) damaged();
        mCursor.skip(count * bytes);
        return count * bytes;
    }

    template <int Log2Dim>
    using Mask = std::array<uint64_t, (size_t(1) << 3 * Log2Dim) / 64>;

    template <int Log2Dim>
    Mask<Log2Dim> readMask() {
        return mCursor.read<Mask<Log2Dim>>();
    }

    template <typename Mask>
    static size_t countOn(const Mask& mask) {
        size_t count = 0;
        for (const uint64_t word : mask) count += size_t(std::popcount(word));
        return count;
    }

    /// Checks the topology of a tree. Returns its number of leaves.
    uint64_t checkTopology(const ValueLayout& layout, bool half) {
        if (mCursor.read<int32_t>() != 1) damaged(); // buffers per leaf
        mCursor.skip(layout.size);                   // background
        const auto tiles = mCursor.read<uint32_t>(), children = mCursor.read<uint32_t>();
        const std::vector<openvdb::Coord> tileOrigins = readTiles(tiles, layout.size);
        uint64_t leaves = 0;
        openvdb::Coord last;
        for (uint32_t n = 0; n < children; ++n) {
            // The data of the leaves are in the order of the origins.
            const auto origin = readOrigin();
            if ((n > 0 && !(last < origin)) || std::binary_search(tileOrigins.begin(), tileOrigins.end(), origin))
                damaged();
            last = origin;
            leaves += checkNode<5>(layout, half);
        }
        return leaves;
    }

    openvdb::Coord readOrigin() {
        constexpr int32_t nodeSize = 4096;
        openvdb::Coord origin;
        for (int axis = 0; axis < 3; ++axis) origin[axis] = mCursor.read<int32_t>();
        for (int axis = 0; axis < 3; ++axis)
            if (origin[axis] % nodeSize != 0) damaged();
        return origin;
    }

    /// Returns the origins of the root's tiles, sorted.
    std::vector<openvdb::Coord> readTiles(uint32_t count, size_t valueBytes) {
        if (count > uint64_t(mCursor.left()) / (sizeof(openvdb::Coord) + valueBytes + 1)) damaged();
        std::vector<openvdb::Coord> origins;
        for (uint32_t n = 0; n < count; ++n) {
            origins.push_back(readOrigin());
            mCursor.skip(valueBytes + 1);
        }
        std::sort(origins.begin(), origins.end());
        if (std::adjacent_find(origins.begin(), origins.end()) != origins.end()) damaged();
        return origins;
    }

    /// Checks the topology of one node. Returns its number of leaves.
    template <int Log2Dim>
    uint64_t checkNode(const ValueLayout& layout, bool half) {
        const auto children = readMask<Log2Dim>();
        if constexpr (Log2Dim == 3) {
            return 1;
        } else {
            checkValues<Log2Dim>(readMask<Log2Dim>(), layout, half);
            mSizes.bytes += nodeMemory(size_t(1) << 3 * Log2Dim, layout.size);
            uint64_t leaves = 0;
            for (size_t n = countOn(children); n > 0; --n) leaves += checkNode<Log2Dim - 1>(layout, half);
            return leaves;
        }
    }

    /// Checks the values of one node: a byte that says how inactive values are restored, the data for that, and one
    /// chunk.
    template <int Log2Dim>
    void checkValues(const Mask<Log2Dim>& active, const ValueLayout& layout, bool half) {
        using namespace openvdb::io;
        const auto kind = mCursor.read<int8_t>();
        if (kind == NO_MASK_AND_ONE_INACTIVE_VAL || kind == MASK_AND_ONE_INACTIVE_VAL) mCursor.skip(layout.size);
        if (kind == MASK_AND_TWO_INACTIVE_VALS) mCursor.skip(2 * layout.size);
        if (kind == MASK_AND_NO_INACTIVE_VALS || kind == MASK_AND_ONE_INACTIVE_VAL ||
            kind == MASK_AND_TWO_INACTIVE_VALS)
            mCursor.skip(sizeof active);
        const bool onlyActive = (mCompression & COMPRESS_ACTIVE_MASK) && kind != NO_MASK_AND_ALL_VALS;
        const size_t count = onlyActive ? countOn(active) : 64 * active.size();
        const size_t bytes = count * (half ? layout.halfSize : layout.size);
        if (!(mCompression & (COMPRESS_ZIP | COMPRESS_BLOSC)))
            mCursor.skip(bytes);
        else if (count > 0 || !half || layout.halfSize == layout.size)
            checkChunk(bytes);
    }

    /// Checks a chunk of zip or Blosc that must unpack to `bytes` bytes. A negative size means that it is not
    /// compressed.
    void checkChunk(size_t bytes) {
        const auto size = mCursor.read<int64_t>();
        if (size <= 0) {
            if (size != -int64_t(bytes)) damaged();
            mCursor.skip(bytes);
            return;
        }
        if (size_t(size) > bytes + BLOSC_MAX_OVERHEAD) damaged();
        if (mCompression & openvdb::io::COMPRESS_BLOSC)
            mCursor.skipBlosc(uint64_t(size), bytes);
        else
            mCursor.skip(uint64_t(size));
    }

    /// Compares the content with the digest in the UUID of a file that writeVdb() wrote. The digest covers all output
    /// in the order of writing: for each grid zeros for its offsets, then the grid, then its offsets.
    void checkDigest() {
        DigestBuilder digest;
        std::streamoff done = 0;
        for (size_t n = 0; n < mOffsets.size(); ++n) {
            constexpr std::array<int64_t, 3> later{};
            const std::streamoff offsets = mOffsets[n], begin = offsets + std::streamoff(sizeof later);
            addRange(digest, done, offsets);
            digest.addBytes(later.data(), sizeof later);
            addRange(digest, begin, mEnds[n]);
            addRange(digest, offsets, begin);
            done = mEnds[n];
        }
        addRange(digest, done, mCursor.size());
        if (uuidOf(digest.digest()) != std::string_view(mUuid.data(), mUuid.size()))
            throw FileError(fmt::format(
                "'{}' is damaged: its content does not match its checksum; write or copy it again", mPath.string()));
    }

    void addRange(DigestBuilder& digest, std::streamoff from, std::streamoff to) {
        std::vector<char> block(size_t(std::min<std::streamoff>(to - from, 1 << 18)));
        mCursor.seek(from);
        for (std::streamoff begin = from; begin < to; begin += std::streamoff(block.size())) {
            if (to - begin < std::streamoff(block.size())) block.resize(size_t(to - begin));
            mCursor.stream().read(block.data(), std::streamsize(block.size()));
            maskUuid(block, begin);
            digest.addBytes(block.data(), block.size());
        }
    }

    VdbCursor mCursor;
    const fs::path& mPath;
    uint32_t mVersion = 0;
    std::array<char, kUuidLength> mUuid{};
    std::vector<std::streamoff> mOffsets, mEnds; ///< Positions of each grid's offsets, and of its end.
    std::vector<GridInfo> mInfos;
    VdbSizes mSizes;
    uint32_t mCompression = 0; ///< Compression flags of the current grid.
};

} // namespace

std::string uuidOf(const Digest& digest) {
    std::string text = digest.hex();
    text[12] = kDigestVersion;
    text[16] = "89ab"[digest.words[1] >> 60 & 3];
    for (const size_t hyphen : {8, 13, 18, 23}) text.insert(hyphen, 1, '-');
    return text;
}

void maskUuid(std::vector<char>& block, std::streamoff begin) {
    const auto size = std::streamoff(block.size());
    const auto inBlock = [&](std::streamoff position) { return std::clamp(position - begin, std::streamoff(0), size); };
    std::fill(block.begin() + inBlock(kUuidBegin), block.begin() + inBlock(kUuidBegin + kUuidLength), '0');
}

GridKind gridKind(std::string_view type, openvdb::GridClass gridClass) {
    if (type == openvdb::points::PointDataGrid::gridType()) return GridKind::points;
    if (type == openvdb::Vec3SGrid::gridType() || type == openvdb::Vec3DGrid::gridType()) return GridKind::velocity;
    if (gridClass == openvdb::GRID_LEVEL_SET) return GridKind::levelSet;
    return gridClass == openvdb::GRID_FOG_VOLUME ? GridKind::fogVolume : GridKind::other;
}

VdbSizes validateVdb(std::istream& in, const fs::path& path) { return Validation(in, path).checkAll(); }

std::vector<GridInfo> validateVdbHeaders(std::istream& in, const fs::path& path) {
    return Validation(in, path).checkHeaders();
}

} // namespace curlew
