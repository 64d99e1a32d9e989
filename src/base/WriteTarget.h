// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>

namespace curlew {

/// The object behind an output name, after its symbolic links are resolved.
struct WriteTarget {
    enum class Kind {
        file,   ///< A regular file, or nothing yet. A temporary file is written first and then replaces it.
        stream, ///< A pipe, socket, character device or open descriptor. It is written into and never replaced.
    };
    Kind kind = Kind::file;
    std::filesystem::path path; ///< Its last component is not a symbolic link.
    int descriptor = -1;        ///< A descriptor of this process, for /dev/stdout, /dev/fd/3 and the like; else -1.

    /// "-" is the standard output. Throws FileError if the name is a block device, or if its links form a cycle.
    static WriteTarget of(const std::filesystem::path& name);
};

/// Copies a file into a target of kind stream. Polls `cancelled` between pieces and throws Interrupted if it returns
/// true. Throws FileError, naming `name`, on failure.
void copyInto(const WriteTarget& target, const std::filesystem::path& from, const std::filesystem::path& name,
              const std::function<bool()>& cancelled);

/// Returns the system's folder for temporary files. Throws FileError if TMPDIR names something else.
std::filesystem::path temporaryFolder();

/// A file descriptor that is closed with this object.
class Descriptor {
  public:
    explicit Descriptor(int descriptor) : mDescriptor(descriptor) {}
    ~Descriptor();
    Descriptor(const Descriptor&) = delete;
    Descriptor& operator=(const Descriptor&) = delete;

    bool valid() const { return mDescriptor >= 0; }
    int operator*() const { return mDescriptor; }

  private:
    int mDescriptor;
};

} // namespace curlew
