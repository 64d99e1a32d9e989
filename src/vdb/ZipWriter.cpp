// SPDX-License-Identifier: Apache-2.0
#include "ZipWriter.h"

#include "curlew/base/Error.h"

#include <fmt/format.h>
#include <minizip/zip.h>

#include <algorithm>
#include <streambuf>
#include <utility>

namespace curlew {

struct ZipWriter::Archive {
    zipFile file;
};

namespace {

constexpr double kZip64From = 4.0e9; // a little less than 2^32, for members that do not shrink

constexpr unsigned long kUtf8 = 1 << 11; // the flag for names in UTF-8; without it they are in code page 437

bool isAscii(const std::string& name) {
    return std::all_of(name.begin(), name.end(), [](char c) { return static_cast<unsigned char>(c) < 0x80; });
}

FileError unwritable(const std::filesystem::path& path) {
    return FileError(fmt::format("cannot write '{}': the disk may be full", path.string()));
}

/// Passes bytes on to the open member of an archive.
class MemberBuffer : public std::streambuf {
  public:
    MemberBuffer(zipFile file, const std::filesystem::path& path, const std::function<bool()>& cancelled)
        : mFile(file), mPath(path), mCancelled(cancelled) {}

  protected:
    std::streamsize xsputn(const char* data, std::streamsize size) override {
        constexpr std::streamsize kPiece = std::streamsize{1} << 20;
        for (std::streamsize done = 0; done < size;) {
            if (mCancelled && mCancelled()) throw Interrupted();
            const std::streamsize piece = std::min(size - done, kPiece);
            if (zipWriteInFileInZip(mFile, data + done, static_cast<unsigned>(piece)) != ZIP_OK)
                throw unwritable(mPath);
            done += piece;
        }
        return size;
    }

    int_type overflow(int_type c) override {
        const char byte = traits_type::to_char_type(c);
        return xsputn(&byte, 1) == 1 ? traits_type::not_eof(c) : traits_type::eof();
    }

  private:
    zipFile mFile;
    const std::filesystem::path& mPath;
    const std::function<bool()>& mCancelled;
};

} // namespace

ZipWriter::ZipWriter(std::filesystem::path path, bool deflate, std::function<bool()> cancelled)
    : mPath(std::move(path)), mDeflate(deflate), mCancelled(std::move(cancelled)) {
    const zipFile file = zipOpen64(mPath.c_str(), APPEND_STATUS_CREATE);
    if (!file) throw unwritable(mPath);
    mArchive = std::make_unique<Archive>(Archive{file});
}

ZipWriter::~ZipWriter() {
    if (mArchive) zipClose(mArchive->file, nullptr);
}

void ZipWriter::add(const std::string& name, double bytes, const std::function<void(std::ostream&)>& write) {
    zip_fileinfo info{};
    info.tmz_date.tm_mday = 1;
    info.tmz_date.tm_year = 1980;
    if (zipOpenNewFileInZip4_64(mArchive->file, name.c_str(), &info, nullptr, 0, nullptr, 0, nullptr,
                                mDeflate ? Z_DEFLATED : 0, Z_DEFAULT_COMPRESSION, 0, -MAX_WBITS, DEF_MEM_LEVEL,
                                Z_DEFAULT_STRATEGY, nullptr, 0, 0, isAscii(name) ? 0 : kUtf8,
                                bytes >= kZip64From) != ZIP_OK)
        throw unwritable(mPath);
    MemberBuffer buffer(mArchive->file, mPath, mCancelled);
    std::ostream out(&buffer);
    out.exceptions(std::ios::badbit | std::ios::failbit);
    write(out);
    if (zipCloseFileInZip(mArchive->file) != ZIP_OK) throw unwritable(mPath);
}

void ZipWriter::close() {
    const std::unique_ptr<Archive> archive = std::move(mArchive);
    if (zipClose(archive->file, nullptr) != ZIP_OK) throw unwritable(mPath);
}

} // namespace curlew
