#include "curlew/vdb/VdbFile.h"

#include "curlew/base/AtomicFile.h"
#include "curlew/base/Error.h"

#include <boost/uuid/name_generator_sha1.hpp>
#include <boost/uuid/uuid_io.hpp>
#include <fmt/format.h>
#include <openvdb/io/Archive.h>
#include <openvdb/io/Stream.h>
#include <openvdb/openvdb.h>
#include <openvdb/points/PointDataGrid.h>
#include <openvdb/version.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cerrno>
#include <cstring>
#include <new>
#include <string_view>

namespace curlew {

namespace {

namespace fs = std::filesystem;

// The head of a .vdb file: magic number (8 bytes), version of the format and of the library (3 × 4), whether the grids
// carry offsets (1), UUID as text.
constexpr std::streamoff kUuidBegin = 21;
constexpr std::streamoff kUuidLength = 36;

// ---- Reading

/// Text out of a file, fit for a line of a message.
std::string oneLine(std::string text) {
    for (char& c : text)
        if (static_cast<unsigned char>(c) < ' ') c = '?';
    return text;
}

/// How a tree stores its values.
struct ValueLayout {
    std::string_view name;
    size_t size, halfSize; ///< Bytes of one; in the voxels of a grid with half floats.
    bool inLeaves;         ///< Its leaves hold an array of values and nothing else.
};

constexpr ValueLayout kLayouts[] = {{"bool", 1, 1, false},    {"mask", 1, 1, false},       {"float", 4, 2, true},
                                    {"double", 8, 2, true},   {"int32", 4, 4, true},       {"int64", 8, 8, true},
                                    {"vec3i", 12, 12, true},  {"vec3s", 12, 6, true},      {"vec3d", 24, 6, true},
                                    {"ptidx32", 4, 4, false}, {"ptdataidx32", 4, 4, false}};

/// Walks through a file before OpenVDB 10.0 reads it, because OpenVDB trusts every size that it finds: for a wrong one
/// it allocates gigabytes or writes past the end of an array. Only what is in the leaves of point, mask and bool grids
/// is not looked at.
class Walk {
  public:
    Walk(std::istream& in, const fs::path& path) : mIn(in), mPath(path) {
        in.seekg(0, std::ios::end);
        mSize = in.tellg();
        in.seekg(0);
    }

    void check() {
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
        const auto count = read<int32_t>();
        if (count < 0) damaged();
        for (int32_t i = 0; i < count; ++i)
            if (!checkGrid(hasOffsets)) break;
        mIn.seekg(0);
    }

  private:
    [[noreturn]] void damaged() const {
        throw FileError(fmt::format("'{}' is cut short or damaged; write or copy it again", mPath.string()));
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

    void checkMetadata() {
        for (auto count = read<uint32_t>(); count > 0; --count) {
            readString(); // name
            const std::string type = readString();
            const std::streamoff size = read<uint32_t>(), value = mIn.tellg();
            // Makes OpenVDB allocate for a number of leaves; each has a mask of 64 bytes in the file.
            if (type == "__delayedload" && size > 0 && read<uint32_t>() > mSize / 64) damaged();
            mIn.seekg(value);
            skip(size);
        }
    }

    /// Returns whether the stream is at the end of the grid.
    bool checkGrid(bool hasOffsets) {
        const std::string name = oneLine(openvdb::io::GridDescriptor::nameAsString(readString()));
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
        checkMetadata();
        const std::streamoff transform = mIn.tellg();
        readString(); // type
        mIn.seekg(transform);
        openvdb::math::Transform().read(mIn);

        bool atEnd = isInstance;
        for (const ValueLayout& layout : kLayouts) {
            if (isInstance || type != fmt::format("Tree_{}_5_4_3", layout.name)) continue;
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

/// OpenVDB takes the points' offsets as they come and would follow wrong ones out of its arrays.
void checkPoints(const openvdb::GridBase& grid) {
    if (!grid.isType<openvdb::points::PointDataGrid>()) return;
    for (auto leaf = static_cast<const openvdb::points::PointDataGrid&>(grid).tree().cbeginLeaf(); leaf; ++leaf)
        leaf->validateOffsets();
}

// ---- Writing

/// Passes everything on to another buffer and keeps a digest of it that is blind to the UUID.
class DigestBuffer : public std::streambuf {
  public:
    explicit DigestBuffer(std::streambuf& target) : mTarget(target) {}

    uint64_t digest() const { return mDigest; }

  protected:
    std::streamsize xsputn(const char* data, std::streamsize size) override {
        if (mPosition < kUuidBegin || mPosition >= kUuidBegin + kUuidLength) {
            const uint64_t link[2] = {mDigest, hash(data, size_t(size))};
            mDigest = hash(link, sizeof link);
        }
        mPosition += size;
        return mTarget.sputn(data, size);
    }

    int_type overflow(int_type c) override {
        const char byte = traits_type::to_char_type(c);
        return xsputn(&byte, 1) == 1 ? traits_type::not_eof(c) : traits_type::eof();
    }

    pos_type seekoff(off_type offset, std::ios::seekdir from, std::ios::openmode which) override {
        return mPosition = mTarget.pubseekoff(offset, from, which);
    }

    pos_type seekpos(pos_type position, std::ios::openmode which) override {
        return mPosition = mTarget.pubseekpos(position, which);
    }

    int sync() override { return mTarget.pubsync(); }

  private:
    static uint64_t hash(const void* data, size_t size) {
        return std::hash<std::string_view>{}({static_cast<const char*>(data), size});
    }

    std::streambuf& mTarget;
    std::streamoff mPosition = 0;
    uint64_t mDigest = 0;
};

/// Gives access to OpenVDB's writer for streams that can seek: io::File opens its file by name and does not notice when
/// it cannot be written, and io::Stream leaves out the offsets that let other programs read single grids.
class SeekableArchive : public openvdb::io::Archive {
  public:
    void writeTo(std::ostream& out, const openvdb::GridCPtrVec& grids, const openvdb::MetaMap& metadata) const {
        Archive::write(out, grids, /*seekable=*/true, metadata);
    }
};

uint32_t compressionFlags(Codec codec) {
    switch (codec) {
        case Codec::zip:
            return openvdb::io::COMPRESS_ACTIVE_MASK | openvdb::io::COMPRESS_ZIP;
        case Codec::blosc:
            return openvdb::io::COMPRESS_ACTIVE_MASK | openvdb::io::COMPRESS_BLOSC;
        case Codec::none:
            break;
    }
    return openvdb::io::COMPRESS_ACTIVE_MASK;
}

void removeHoudiniCreator(openvdb::MetaMap& metadata) {
    const auto creator = metadata.getMetadata<openvdb::StringMetadata>(openvdb::GridBase::META_GRID_CREATOR);
    if (creator && creator->value().starts_with("Houdini")) metadata.removeMeta(openvdb::GridBase::META_GRID_CREATOR);
}

bool hasReals(const openvdb::GridBase& grid) {
    static constexpr std::string_view types[] = {"float", "double", "vec2s", "vec2d", "vec3s", "vec3d"};
    return std::find(std::begin(types), std::end(types), grid.valueType()) != std::end(types);
}

/// A second handle on the same tree, with the metadata that the file is to have.
openvdb::GridBase::ConstPtr asWritten(const openvdb::GridBase& grid, const VdbWriteOptions& options) {
    openvdb::MetaMap metadata(grid);
    removeHoudiniCreator(metadata);
    if (options.half && hasReals(grid))
        metadata.insertMeta(openvdb::GridBase::META_SAVE_HALF_FLOAT, openvdb::BoolMetadata(true));
    return grid.copyGridReplacingMetadata(metadata);
}

} // namespace

std::ifstream openToRead(const fs::path& path) {
    const auto fail = [&](const std::string& why) {
        return FileError(fmt::format("cannot read '{}': {}", path.string(), why));
    };
    std::error_code error;
    const fs::file_status status = fs::status(path, error);
    if (!fs::exists(status)) throw fail("there is no such file; check the name");
    if (fs::is_directory(status)) throw fail("it is a folder; give a file in it");
    if (!fs::is_regular_file(status)) throw fail("it is not a regular file; copy it to one");
    errno = 0;
    std::ifstream in(path, std::ios::binary);
    if (!in) throw fail(fmt::format("{}; check its permissions", std::strerror(errno)));
    if (in.peek() == std::ifstream::traits_type::eof()) throw fail("it is empty; write or copy it again");
    in.exceptions(std::ios::failbit | std::ios::badbit | std::ios::eofbit);
    return in;
}

std::vector<openvdb::GridBase::Ptr> readVdb(const fs::path& path) {
    openvdb::initialize();
    std::ifstream in = openToRead(path);
    try {
        Walk(in, path).check();
        openvdb::io::Stream stream(in, /*delayLoad=*/false);
        const openvdb::GridPtrVecPtr grids = stream.getGrids();
        for (const openvdb::GridBase::Ptr& grid : *grids) checkPoints(*grid);
        return *grids;
    } catch (const std::ios_base::failure&) {
        throw FileError(fmt::format("'{}' is cut short or damaged; write or copy it again", path.string()));
    } catch (const std::bad_alloc&) {
        throw FileError(fmt::format("'{}' needs more memory than there is, or is damaged; free some or write it again",
                                    path.string()));
    } catch (const openvdb::Exception& error) {
        throw FileError(
            fmt::format("'{}' is damaged ({}); write or copy it again", path.string(), oneLine(error.what())));
    } catch (const std::length_error&) {
        throw FileError(fmt::format("'{}' is damaged; write or copy it again", path.string()));
    }
}

void writeVdb(const fs::path& path, const std::vector<openvdb::GridBase::ConstPtr>& grids,
              const openvdb::MetaMap& fileMetadata, const VdbWriteOptions& options,
              const std::function<bool()>& cancelled) {
    openvdb::initialize();
    openvdb::GridCPtrVec written;
    for (const openvdb::GridBase::ConstPtr& grid : grids) {
        if (!grid)
            throw ValueError(fmt::format("cannot write '{}': grid {} of {} is null; leave it out", path.string(),
                                         written.size(), grids.size()));
        written.push_back(asWritten(*grid, options));
    }
    openvdb::MetaMap metadata(fileMetadata);
    removeHoudiniCreator(metadata);

    SeekableArchive archive;
    archive.setCompression(compressionFlags(options.codec));
    writeAtomically(
        path,
        [&](std::ostream& out) {
            DigestBuffer buffer(*out.rdbuf());
            std::ostream digested(&buffer);
            digested.exceptions(std::ios::badbit | std::ios::failbit);
            archive.writeTo(digested, written, metadata);
            digested.flush();
            // OpenVDB's own UUID is random: the same content would never give the same bytes.
            const std::string uuid = boost::uuids::to_string(
                boost::uuids::name_generator_sha1(boost::uuids::ns::oid())(std::to_string(buffer.digest())));
            out.seekp(kUuidBegin);
            out.write(uuid.data(), kUuidLength);
        },
        cancelled);
}

} // namespace curlew
