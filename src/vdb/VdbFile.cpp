// SPDX-License-Identifier: Apache-2.0
#include "curlew/vdb/VdbFile.h"

#include "HalfFloats.h"
#include "VdbValidation.h"
#include "WatchedBuffer.h"
#include "curlew/base/AtomicFile.h"
#include "curlew/base/Digest.h"
#include "curlew/base/Error.h"
#include "curlew/base/InputFile.h"
#include "curlew/base/Memory.h"
#include "curlew/base/Parallel.h"
#include "curlew/vdb/Openvdb.h"

#include <fmt/format.h>
#include <openvdb/io/Archive.h>
#include <openvdb/io/GridDescriptor.h>
#include <openvdb/io/Stream.h>
#include <openvdb/points/PointDataGrid.h>
#include <openvdb/version.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <exception>
#include <map>
#include <new>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

namespace curlew {

namespace {

namespace fs = std::filesystem;

// ---- Reading

/// Validates the points' offsets. OpenVDB does not, and wrong ones would make it read outside its arrays.
void checkPoints(const openvdb::GridBase& grid, const Monitor& monitor) {
    if (!grid.isType<openvdb::points::PointDataGrid>()) return;
    for (auto leaf = static_cast<const openvdb::points::PointDataGrid&>(grid).tree().cbeginLeaf(); leaf; ++leaf) {
        monitor.check();
        leaf->validateOffsets();
        if (leaf->attributeSet().size() == 0 && leaf->getLastValue() > 0)
            OPENVDB_THROW(openvdb::ValueError, "the points have no positions");
    }
}

// ---- Writing

/// Collects output in blocks. While one block is filled, another thread, if available, adds the previous one to a
/// digest, with zeros for the UUID, and writes it to the target. (A std::filebuf would write each leaf separately.)
/// Throws Interrupted, which the stream passes on, once `cancelled` returns true: OpenVDB compresses the nodes of a
/// tree one by one as it writes them, so a block can take long to fill.
class DigestBuffer : public std::streambuf {
  public:
    DigestBuffer(std::streambuf& target, const std::function<bool()>& cancelled)
        : mTarget(target), mCancelled(cancelled) {
        for (std::vector<char>* block : {&mFilling, &mLeaving}) block->reserve(kBlock);
    }
    /// Digest of everything that has been flushed.
    Digest digest() const { return mDigest.digest(); }

  protected:
    std::streamsize xsputn(const char* data, std::streamsize size) override {
        constexpr unsigned kPieces = 16; // a leaf takes about five
        if (mPieces++ % kPieces == 0 && mCancelled && mCancelled()) throw Interrupted();
        for (std::streamsize done = 0; done < size;) {
            if (mFilling.size() == kBlock && !send()) return done;
            const auto part = std::min(size - done, std::streamsize(kBlock - mFilling.size()));
            mFilling.insert(mFilling.end(), data + done, data + done + part);
            done += part, mPosition += part;
        }
        return size;
    }

    int_type overflow(int_type c) override {
        const char byte = traits_type::to_char_type(c);
        return xsputn(&byte, 1) == 1 ? traits_type::not_eof(c) : traits_type::eof();
    }

    pos_type seekoff(off_type offset, std::ios::seekdir from, std::ios::openmode which) override {
        if (offset == 0 && from == std::ios::cur) return mPosition;
        return drain() ? moved(mTarget.pubseekoff(offset, from, which)) : pos_type(off_type(-1));
    }

    pos_type seekpos(pos_type position, std::ios::openmode which) override {
        return drain() ? moved(mTarget.pubseekpos(position, which)) : pos_type(off_type(-1));
    }

    int sync() override { return drain() ? mTarget.pubsync() : -1; }

  private:
    static constexpr size_t kBlock = size_t(1) << 20;

    pos_type moved(pos_type to) {
        mPosition = to;
        return to;
    }

    /// Waits until the previous block is written. Returns whether that succeeded; if not, errno has the cause. Throws
    /// what the target threw.
    bool wait() {
        mWriting.wait();
        if (mThrown) std::rethrow_exception(std::exchange(mThrown, nullptr));
        if (mError) errno = *mError;
        return !mError;
    }

    /// Starts writing the block that has been filled.
    bool send() {
        if (!wait()) return false;
        std::swap(mFilling, mLeaving);
        mFilling.clear();
        const std::streamoff begin = mPosition - std::streamoff(mLeaving.size());
        mWriting.run([this, begin] { write(begin); });
        return true;
    }

    bool drain() { return send() && wait(); }

    void write(std::streamoff begin) {
        maskUuid(mLeaving, begin);
        mDigest.addBytes(mLeaving.data(), mLeaving.size());
        errno = 0;
        const auto size = std::streamsize(mLeaving.size());
        try {
            if (mTarget.sputn(mLeaving.data(), size) != size) mError = errno;
        } catch (...) { // work in the background must not throw
            mThrown = std::current_exception();
        }
    }

    std::streambuf& mTarget;
    const std::function<bool()>& mCancelled;
    unsigned mPieces = 0; ///< Number of calls.
    std::vector<char> mFilling, mLeaving;
    std::streamoff mPosition = 0; ///< Position of the next byte.
    DigestBuilder mDigest;
    std::optional<int> mError; ///< errno of a failed write.
    std::exception_ptr mThrown;
    Background mWriting; ///< Last member, so that it is destroyed first.
};

uint32_t compressionFlags(Codec codec, const openvdb::GridBase& grid) {
    switch (codec) {
        case Codec::automatic:
            return compressionFlags(grid.getGridClass() == openvdb::GRID_FOG_VOLUME ? Codec::blosc : Codec::none, grid);
        case Codec::zip:
            return openvdb::io::COMPRESS_ACTIVE_MASK | openvdb::io::COMPRESS_ZIP;
        case Codec::blosc:
            return openvdb::io::COMPRESS_ACTIVE_MASK | openvdb::io::COMPRESS_BLOSC;
        case Codec::none:
            break;
    }
    return openvdb::io::COMPRESS_ACTIVE_MASK;
}

/// Writes what OpenVDB's own archives write, but to a seekable stream and with a codec per grid. io::File opens its
/// file by name and does not notice write errors. io::Stream omits the offsets that let other programs read single
/// grids. Both have one codec for all grids.
class SeekableArchive : public openvdb::io::Archive {
  public:
    void writeTo(std::ostream& out, const openvdb::GridCPtrVec& grids, const openvdb::MetaMap& metadata, Codec codec) {
        using openvdb::io::GridDescriptor;
        auto streamMetadata = std::make_shared<openvdb::io::StreamMetadata>();
        streamMetadata->setWriteGridStats(isGridStatsMetadataEnabled());
        openvdb::io::setStreamMetadataPtr(out, streamMetadata);
        writeHeader(out, /*seekable=*/true);
        metadata.writeMeta(out);
        const auto count = int32_t(grids.size());
        out.write(reinterpret_cast<const char*>(&count), sizeof count);

        std::map<std::string, int> named, numbered; // number of grids with the name, and number of those already given
                                                    // a suffix
        for (const auto& grid : grids) ++named[grid->getName()];
        std::map<const openvdb::TreeBase*, GridDescriptor> trees;
        for (const auto& grid : grids) {
            const std::string name = grid->getName();
            // An empty name gets a suffix too, since another grid could not refer to it.
            const bool unique = named[name] == 1 && !name.empty();
            GridDescriptor descriptor(unique ? name : GridDescriptor::addSuffix(name, numbered[name]++), grid->type(),
                                      grid->saveFloatAsHalf());
            setCompression(compressionFlags(codec, *grid));
            const auto [first, fresh] = trees.try_emplace(&grid->baseTree(), descriptor);
            if (fresh || first->second.saveFloatAsHalf() != descriptor.saveFloatAsHalf()) {
                writeGrid(descriptor, grid, out, /*seekable=*/true);
                first->second = descriptor;
            } else {
                descriptor.setInstanceParentName(first->second.uniqueName());
                writeGridInstance(descriptor, grid, out, /*seekable=*/true);
            }
        }
    }
};

void removeHoudiniCreator(openvdb::MetaMap& metadata) {
    const auto creator = metadata.getMetadata<openvdb::StringMetadata>(openvdb::GridBase::META_GRID_CREATOR);
    if (creator && creator->value().starts_with("Houdini")) metadata.removeMeta(openvdb::GridBase::META_GRID_CREATOR);
}

bool hasReals(const openvdb::GridBase& grid) {
    static constexpr std::array<std::string_view, 6> kReal{"float", "double", "vec2s", "vec2d", "vec3s", "vec3d"};
    return std::find(kReal.begin(), kReal.end(), grid.valueType()) != kReal.end();
}

/// Returns a shallow copy of a grid with the metadata that the file will have.
openvdb::GridBase::ConstPtr asWritten(const openvdb::GridBase& grid, const VdbWriteOptions& options) {
    openvdb::MetaMap metadata(static_cast<const openvdb::MetaMap&>(grid));
    removeHoudiniCreator(metadata);
    if (const bool half = writesHalf(grid, options.half && hasReals(grid)); half != grid.saveFloatAsHalf())
        metadata.insertMeta(openvdb::GridBase::META_SAVE_HALF_FLOAT, openvdb::BoolMetadata(half));
    return grid.copyGridReplacingMetadata(metadata);
}

} // namespace

namespace {

/// Returns use(stream). Converts exceptions of OpenVDB and the stream to FileError.
template <class Use>
auto readSafely(std::streambuf& source, const fs::path& path, const Monitor& monitor, const Use& use) {
    openvdb::initialize();
    const auto fail = [&](std::string_view why) {
        return FileError(fmt::format("'{}' {}; write or copy it again", path.string(), why));
    };
    try {
        WatchedBuffer buffer(source, monitor);
        std::istream in(&buffer);
        in.exceptions(std::ios::failbit | std::ios::badbit | std::ios::eofbit);
        return use(in);
    } catch (const std::ios_base::failure&) {
        throw fail("is cut short or damaged");
    } catch (const std::bad_alloc&) {
        throw FileError(
            fmt::format("'{}' needs more memory than is available, or is damaged; free some memory or write it again",
                        path.string()));
    } catch (const openvdb::Exception& error) {
        throw fail(fmt::format("is damaged ({})", oneLine(error.what())));
    } catch (const std::length_error&) {
        throw fail("is damaged");
    }
}

std::vector<openvdb::GridBase::Ptr> readGrids(std::streambuf& source, const fs::path& path, const Monitor& monitor) {
    return readSafely(source, path, monitor, [&](std::istream& in) {
        requireMemory(validateVdb(in, path).bytes, fmt::format("'{}'", path.string()),
                      "free some memory, or write fewer grids into one file");
        openvdb::io::Stream stream(in, /*delayLoad=*/false);
        const openvdb::GridPtrVecPtr grids = stream.getGrids();
        for (const openvdb::GridBase::Ptr& grid : *grids) checkPoints(*grid, monitor);
        return *grids;
    });
}

} // namespace

std::vector<openvdb::GridBase::Ptr> readVdb(const fs::path& path, const Monitor& monitor) {
    return readGrids(*openToRead(path).rdbuf(), path, monitor);
}

std::vector<openvdb::GridBase::Ptr> readVdbBytes(std::string_view bytes, const fs::path& path, const Monitor& monitor) {
    BytesBuffer source(bytes);
    return readGrids(source, path, monitor);
}

std::vector<GridInfo> vdbContents(const fs::path& path) {
    return readSafely(*openToRead(path).rdbuf(), path, {},
                      [&](std::istream& in) { return validateVdbHeaders(in, path); });
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
    writeAtomically(
        path,
        [&](std::ostream& out) {
            DigestBuffer buffer(*out.rdbuf(), cancelled);
            std::ostream digested(&buffer);
            digested.exceptions(std::ios::badbit | std::ios::failbit);
            archive.writeTo(digested, written, metadata, options.codec);
            digested.flush();
            // OpenVDB's UUID is random, so the same content would not give the same bytes.
            const std::string uuid = uuidOf(buffer.digest());
            out.seekp(kUuidBegin);
            out.write(uuid.data(), kUuidLength);
        },
        cancelled);
}

} // namespace curlew
