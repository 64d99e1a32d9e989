#include "curlew/vdb/VdbFile.h"

#include "VdbWalk.h"
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
#include <cerrno>
#include <cstring>
#include <new>
#include <string_view>

namespace curlew {

namespace {

namespace fs = std::filesystem;

// ---- Reading

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
            const std::array link{mDigest, hash(data, size_t(size))};
            mDigest = hash(link.data(), sizeof link);
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
    static constexpr std::array<std::string_view, 6> kReal{"float", "double", "vec2s", "vec2d", "vec3s", "vec3d"};
    return std::find(kReal.begin(), kReal.end(), grid.valueType()) != kReal.end();
}

/// A second handle on the same tree, with the metadata that the file is to have.
openvdb::GridBase::ConstPtr asWritten(const openvdb::GridBase& grid, const VdbWriteOptions& options) {
    openvdb::MetaMap metadata(static_cast<const openvdb::MetaMap&>(grid));
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
        walkVdb(in, path);
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
