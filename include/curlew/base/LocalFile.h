// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <string>

namespace curlew {

/// A new temporary folder. The destructor removes it with its content. Throws FileError if it cannot be created.
class TemporaryFolder {
  public:
    TemporaryFolder();
    ~TemporaryFolder();
    TemporaryFolder(TemporaryFolder&& other) noexcept;
    TemporaryFolder(const TemporaryFolder&) = delete;
    TemporaryFolder& operator=(const TemporaryFolder&) = delete;
    TemporaryFolder& operator=(TemporaryFolder&&) = delete;

    const std::filesystem::path& path() const { return mPath; }

  private:
    std::filesystem::path mPath;
};

/// Returns whether a name denotes a stream: "-" (standard input), /dev/stdin, /dev/fd/N, a pipe, a socket or a
/// character device. A stream can only be read once, from beginning to end.
bool isStream(const std::filesystem::path& name);

/// Returns the extension of a file name in lower case, with its dot: .obj for cow.OBJ and for cow.obj.gz.
std::string endingOf(const std::filesystem::path& name);

/// Makes a file or stream available as a regular, uncompressed file whose name has a given extension. If the file is
/// already all of that, path() is the file itself. Otherwise it is a temporary copy, which the destructor removes. Data
/// that starts with the gzip magic number (RFC 1952) is decompressed, whatever the file's name.
class LocalFile {
  public:
    /// `ending` is the extension with its dot; "" keeps the extension of the name. `cancelled` is polled between
    /// pieces, and Interrupted is thrown if it returns true. Throws FileError if the file cannot be read, if its gzip
    /// data is incomplete, or if the copy does not fit into the system's temporary folder.
    explicit LocalFile(const std::filesystem::path& name, const std::string& ending = "",
                       const std::function<bool()>& cancelled = {});

    const std::filesystem::path& path() const { return mPath; }

  private:
    std::filesystem::path mPath;
    std::shared_ptr<const TemporaryFolder> mFolder; ///< Null if there is no copy.
};

} // namespace curlew
