#include "VdbValidation.h"

#include "curlew/base/Error.h"

#include <fmt/format.h>
#include <openvdb/io/Archive.h>
#include <openvdb/io/GridDescriptor.h>
#include <openvdb/openvdb.h>
#include <openvdb/points/PointDataGrid.h>

#include <array>
#include <bit>
#include <string_view>

namespace curlew {

namespace {

namespace fs = std::filesystem;

/// How a tree stores its values.
struct ValueLayout {
    std::string_view name;
    size_t size, halfSize; ///< Bytes of one; in the voxels of a grid with half floats.
    bool inLeaves;         ///< Its leaves hold an array of values and nothing else.
};

constexpr std::array<ValueLayout, 11> kLayouts{{{"bool", 1, 1, false},
                                                {"mask", 1, 1, false},
                                                {"float", 4, 2, true},
                                                {"double", 8, 2, true},
                                                {"int32", 4, 4, true},
                                                {"int64", 8, 8, true},
                                                {"vec3i", 12, 12, true},
                                                {"vec3s", 12, 6, true},
                                                {"vec3d", 24, 6, true},
                                                {"ptidx32", 4, 4, false},
                                                {"ptdataidx32", 4, 4, false}}};

class Validation {
  public:
    Validation(std::istream& in, const fs::path& path) : mIn(in), mPath(path) {
        in.seekg(0, std::ios::end);
        mSize = in.tellg();
        in.seekg(0);
    }

    /// Checks all of the file.
    void checkAll() {
        const bool hasOffsets = checkHeader();
        for (int32_t left = readCount(); left > 0; --left)
            if (!checkGrid(hasOffsets)) break;
        mIn.seekg(0);
    }

    /// Checks the headers of the grids; nullopt if the file has no offsets to find them by.
    std::optional<std::vector<GridInfo>> checkHeaders() {
        if (!checkHeader()) return {};
        std::vector<GridInfo> infos;
        for (int32_t left = readCount(); left > 0; --left) {
            const GridHeader header = readGridHeader(true);
            if (header.end < mIn.tellg()) damaged();
            mIn.seekg(header.end);
            infos.push_back(header.info);
        }
        return infos;
    }

  private:
    [[noreturn]] void damaged() const {
        throw FileError(fmt::format("'{}' is cut short or damaged; write or copy it again", mPath.string()));
    }

    /// The header of the file. Returns whether its grids have offsets.
    bool checkHeader() {
        if (mSize < std::streamoff(sizeof(int64_t)) || read<int64_t>() != openvdb::OPENVDB_MAGIC)
            throw FileError(fmt::format("'{}' is not a .vdb file; give one that OpenVDB wrote", mPath.string()));
        constexpr uint32_t oldest = openvdb::OPENVDB_FILE_VERSION_NODE_MASK_COMPRESSION;
        constexpr uint32_t newest = openvdb::OPENVDB_FILE_VERSION;
        const auto version = read<uint32_t>();
        if (version < oldest || version > newest)
            throw FileError(
                fmt::format("'{}' is in version {} of the .vdb format, and versions {} to {} can be read; "
                            "save it again with another OpenVDB",
                            mPath.string(), version, oldest, newest));
        const auto major = read<uint32_t>(), minor = read<uint32_t>();
        openvdb::io::setVersion(mIn, {major, minor}, version);
        const bool hasOffsets = read<char>() != 0;
        skip(kUuidLength);
        checkMetadata();
        return hasOffsets;
    }

    int32_t readCount() {
        const auto count = read<int32_t>();
        if (count < 0) damaged();
        return count;
    }

    std::streamoff left() const { return mSize - mIn.tellg(); }

    template <typename T>
    T read() {
        T value;
        mIn.read(reinterpret_cast<char*>(&value), sizeof value);
        return value;
    }

    void skip(std::streamoff bytes) {
        if (bytes > left()) damaged();
        mIn.seekg(bytes, std::ios::cur);
    }

    /// For many small pieces: stays in the stream's buffer.
    void skipShort(size_t bytes) {
        if (std::streamoff(bytes) > left()) damaged();
        mIn.ignore(std::streamsize(bytes));
    }

    std::string readString() {
        const auto length = read<uint32_t>();
        if (length > left()) damaged();
        std::string text(length, '\0');
        mIn.read(text.data(), length);
        return text;
    }

    /// Returns the class of the grid whose metadata it is.
    openvdb::GridClass checkMetadata() {
        auto gridClass = openvdb::GRID_UNKNOWN;
        for (auto count = read<uint32_t>(); count > 0; --count) {
            const std::string name = readString(), type = readString();
            const std::streamoff value = mIn.tellg();
            if (name == openvdb::GridBase::META_GRID_CLASS && type == "string")
                gridClass = openvdb::GridBase::stringToGridClass(readString());
            mIn.seekg(value);
            const std::streamoff size = read<uint32_t>(), begin = mIn.tellg();
            // Makes OpenVDB allocate for a number of leaves; each has a mask of 64 bytes in the file.
            if (type == "__delayedload" && size > 0 && read<uint32_t>() > mSize / 64) damaged();
            mIn.seekg(begin);
            skip(size);
        }
        return gridClass;
    }

    struct GridHeader {
        GridInfo info;
        bool half, isInstance;
        int64_t blocks, end; ///< Where its values begin, and where it ends.
    };

    /// All that is before the tree.
    GridHeader readGridHeader(bool hasOffsets) {
        const std::string uniqueName = readString();
        const std::string name = oneLine(openvdb::io::GridDescriptor::nameAsString(uniqueName));
        std::string type = readString();
        constexpr std::string_view suffix = "_HalfFloat";
        const bool half = type.ends_with(suffix);
        if (half) type.resize(type.size() - suffix.size());
        if (!openvdb::GridBase::isRegistered(type))
            throw FileError(fmt::format("'{}' holds a grid '{}' of the unknown type '{}'; leave that grid out",
                                        mPath.string(), name, oneLine(type)));
        const bool isInstance = !readString().empty();
        const auto begin = read<int64_t>(), blocks = read<int64_t>(), end = read<int64_t>();
        if (hasOffsets) {
            if (end > mSize)
                throw FileError(fmt::format("'{}' is cut short: it has {} of at least {} bytes; write or copy it again",
                                            mPath.string(), mSize, end));
            if (begin != mIn.tellg() || end < begin) damaged();
        }
        mCompression = read<uint32_t>();
        const openvdb::GridClass gridClass = checkMetadata();
        const std::streamoff transform = mIn.tellg();
        readString(); // type
        mIn.seekg(transform);
        openvdb::math::Transform().read(mIn);
        return {{openvdb::io::GridDescriptor::stripSuffix(uniqueName), type, gridKind(type, gridClass)},
                half,
                isInstance,
                blocks,
                end};
    }

    /// Returns whether the stream is at the end of the grid.
    bool checkGrid(bool hasOffsets) {
        const auto [info, half, isInstance, blocks, end] = readGridHeader(hasOffsets);
        bool atEnd = isInstance;
        for (const ValueLayout& layout : kLayouts) {
            if (isInstance || info.type != fmt::format("Tree_{}_5_4_3", layout.name)) continue;
            const size_t leaves = checkTopology(layout, half);
            if (hasOffsets && blocks != mIn.tellg()) damaged();
            atEnd = layout.inLeaves;
            for (size_t n = 0; layout.inLeaves && n < leaves; ++n) checkValues<3>(readMask<3>(), layout, half);
        }
        if (hasOffsets && atEnd && end != mIn.tellg()) damaged();
        if (hasOffsets) mIn.seekg(end);
        return hasOffsets || atEnd;
    }

    template <int Log2Dim>
    using Mask = std::array<uint64_t, (size_t(1) << 3 * Log2Dim) / 64>;

    template <int Log2Dim>
    Mask<Log2Dim> readMask() {
        return read<Mask<Log2Dim>>();
    }

    template <typename Mask>
    static size_t countOn(const Mask& mask) {
        size_t count = 0;
        for (const uint64_t word : mask) count += size_t(std::popcount(word));
        return count;
    }

    /// Returns the number of leaves.
    size_t checkTopology(const ValueLayout& layout, bool half) {
        if (read<int32_t>() != 1) damaged(); // buffers of a leaf
        skipShort(layout.size);              // background
        const auto tiles = read<uint32_t>(), children = read<uint32_t>();
        skip(std::streamoff(tiles) * std::streamoff(sizeof(openvdb::Coord) + layout.size + 1));
        size_t leaves = 0;
        for (uint32_t n = 0; n < children; ++n) {
            skipShort(sizeof(openvdb::Coord));
            leaves += checkNode<5>(layout, half);
        }
        return leaves;
    }

    /// The same for one node.
    template <int Log2Dim>
    size_t checkNode(const ValueLayout& layout, bool half) {
        const auto children = readMask<Log2Dim>();
        if constexpr (Log2Dim == 3) {
            return 1;
        } else {
            checkValues<Log2Dim>(readMask<Log2Dim>(), layout, half);
            size_t leaves = 0;
            for (size_t n = countOn(children); n > 0; --n) leaves += checkNode<Log2Dim - 1>(layout, half);
            return leaves;
        }
    }

    /// The values of one node: a byte that says how the inactive ones can be rebuilt, what that takes, and one chunk.
    template <int Log2Dim>
    void checkValues(const Mask<Log2Dim>& active, const ValueLayout& layout, bool half) {
        using namespace openvdb::io;
        const auto kind = read<int8_t>();
        if (kind == NO_MASK_AND_ONE_INACTIVE_VAL || kind == MASK_AND_ONE_INACTIVE_VAL) skipShort(layout.size);
        if (kind == MASK_AND_TWO_INACTIVE_VALS) skipShort(2 * layout.size);
        if (kind == MASK_AND_NO_INACTIVE_VALS || kind == MASK_AND_ONE_INACTIVE_VAL ||
            kind == MASK_AND_TWO_INACTIVE_VALS)
            skipShort(sizeof active);
        const bool onlyActive = (mCompression & COMPRESS_ACTIVE_MASK) && kind != NO_MASK_AND_ALL_VALS;
        const size_t count = onlyActive ? countOn(active) : 64 * active.size();
        const size_t bytes = count * (half ? layout.halfSize : layout.size);
        if (!(mCompression & (COMPRESS_ZIP | COMPRESS_BLOSC)))
            skipShort(bytes);
        else if (count > 0 || !half || layout.halfSize == layout.size)
            checkChunk(bytes);
    }

    /// A chunk of zip or Blosc that unpacks to that many bytes; a negative size means that it is not packed.
    void checkChunk(size_t bytes) {
        constexpr size_t bloscHead = 16;
        const auto size = read<int64_t>();
        if (size <= 0) {
            if (size != -int64_t(bytes)) damaged();
            skipShort(bytes);
            return;
        }
        if (size > left() || size_t(size) > bytes + bloscHead) damaged();
        if (!(mCompression & openvdb::io::COMPRESS_BLOSC)) {
            skipShort(size_t(size));
            return;
        }
        if (size_t(size) < bloscHead) damaged();
        const auto head = read<std::array<uint32_t, 4>>(); // flags, unpacked size, block, packed size
        if (head[1] != bytes || head[3] != size) damaged();
        skipShort(size_t(size) - bloscHead);
    }

    std::istream& mIn;
    const fs::path& mPath;
    std::streamoff mSize = 0;
    uint32_t mCompression = 0; ///< Of the grid in question.
};

} // namespace

GridKind gridKind(std::string_view type, openvdb::GridClass gridClass) {
    if (type == openvdb::points::PointDataGrid::gridType()) return GridKind::points;
    if (type == openvdb::Vec3SGrid::gridType()) return GridKind::velocity;
    if (gridClass == openvdb::GRID_LEVEL_SET) return GridKind::levelSet;
    return gridClass == openvdb::GRID_FOG_VOLUME ? GridKind::fogVolume : GridKind::other;
}

void validateVdb(std::istream& in, const fs::path& path) { Validation(in, path).checkAll(); }

std::optional<std::vector<GridInfo>> validateVdbHeaders(std::istream& in, const fs::path& path) {
    return Validation(in, path).checkHeaders();
}

} // namespace curlew
