// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>

namespace curlew {

/// What a name to write to stands for once its symbolic links are followed.
struct WriteTarget {
    enum class Kind {
        file,   ///< A regular file, or nothing yet: written to a temporary file, which then replaces it.
        stream, ///< A pipe, socket or character device, or an open descriptor: written into, never replaced.
    };
    Kind kind = Kind::file;
    std::filesystem::path path; ///< With no symbolic link as its last part.
    int descriptor = -1;        ///< Of this process, for /dev/stdout, /dev/fd/3 and the like.

    /// Throws FileError for block devices, and if links lead in a circle.
    static WriteTarget of(const std::filesystem::path& name);
};

/// Copies a file into a target of kind stream. `cancelled` is asked between pieces (Interrupted). Throws FileError,
/// naming `name`.
void copyInto(const WriteTarget& target, const std::filesystem::path& from, const std::filesystem::path& name,
              const std::function<bool()>& cancelled);

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
