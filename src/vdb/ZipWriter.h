// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <ostream>
#include <string>

namespace curlew {

/// Writes a new ZIP archive. The same members give the same bytes: all have the date 1 January 1980. Throws FileError,
/// naming the archive, if it cannot be written. Not safe to use from several threads at once.
class ZipWriter {
  public:
    /// Members are compressed with Deflate if `deflate` is true, otherwise stored.
    ZipWriter(std::filesystem::path path, bool deflate, std::function<bool()> cancelled = {});
    ~ZipWriter();
    ZipWriter(const ZipWriter&) = delete;
    ZipWriter& operator=(const ZipWriter&) = delete;

    /// Adds a member of at most `bytes` bytes, which `write` writes to a stream. Throws Interrupted once `cancelled`
    /// returns true.
    void add(const std::string& name, double bytes, const std::function<void(std::ostream&)>& write);

    /// Completes the archive.
    void close();

  private:
    struct Archive;
    std::unique_ptr<Archive> mArchive;
    std::filesystem::path mPath;
    bool mDeflate;
    std::function<bool()> mCancelled;
};

} // namespace curlew
