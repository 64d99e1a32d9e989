// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>
#include <ostream>

namespace curlew {

/// Calls `write` with the name of a new temporary file in the same folder, then renames that file to `path`. So `path`
/// is there whole or not at all: if `write` throws, the temporary file is removed and an earlier `path` is left as it
/// was. The file and its folder are on the disk (fsync) when this returns. A file that is replaced hands on its
/// permissions; of a symbolic link, the target is replaced. The temporary file has an unpredictable name, and is locked
/// while it is written; one that a killed process has left for the same path is removed.
///
/// A pipe, socket, terminal or other character device, /dev/stdout and /dev/fd/N are never replaced: the finished file
/// is copied into them, from the folder for temporary files.
///
/// A folder of a relative path is made if it is missing and the one above it is there: out/a.png makes out/. A folder
/// of an absolute path is not, since that is where a mistyped name would otherwise put files that nobody finds. Throws
/// FileError, naming `path`, if the folder or file cannot be written, or if `write` leaves the file empty. Safe from
/// several threads and processes at once: the last one to finish wins.
void writeAtomically(const std::filesystem::path& path,
                     const std::function<void(const std::filesystem::path& temporary)>& write);

/// The same for a writer to a binary stream. The stream throws on failure (a full disk, say), which becomes FileError;
/// `cancelled` is asked now and then while it writes (Interrupted).
void writeAtomically(const std::filesystem::path& path, const std::function<void(std::ostream&)>& write,
                     const std::function<bool()>& cancelled = {});

/// Throws FileError if writeAtomically(path) could not succeed as things stand: to fail before the work, not after it.
void checkWritable(const std::filesystem::path& path);

} // namespace curlew
