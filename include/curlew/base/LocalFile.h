// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <string>

namespace curlew {

/// A new folder for temporary files, which goes with this object. Throws FileError if none can be made.
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

/// Whether a name stands for a stream: "-" (the standard input), /dev/stdin, /dev/fd/N, a pipe, socket or character
/// device. A stream is read once, from its beginning to its end.
bool isStream(const std::filesystem::path& name);

/// The ending of a file's name in lower case, with its dot: .obj for cow.OBJ and cow.obj.gz.
std::string endingOf(const std::filesystem::path& name);

/// The content of a file or stream as a regular, uncompressed file whose name has a certain ending. That is the file
/// itself where it is all that; otherwise a temporary copy, which goes with this object. What begins as gzip (RFC 1952)
/// is decompressed, whatever its name.
class LocalFile {
  public:
    /// `ending`: with its dot; "" for that of the name. `cancelled` is asked between pieces (Interrupted). Throws
    /// FileError if the file cannot be read, is no whole gzip file, or does not fit into the folder for temporary
    /// files.
    explicit LocalFile(const std::filesystem::path& name, const std::string& ending = "",
                       const std::function<bool()>& cancelled = {});

    const std::filesystem::path& path() const { return mPath; }

  private:
    std::filesystem::path mPath;
    std::shared_ptr<const TemporaryFolder> mFolder; ///< Null if there is no copy.
};

} // namespace curlew
