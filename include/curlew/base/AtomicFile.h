// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>
#include <ostream>

namespace curlew {

/// Writes a file atomically. Calls `write` with the name of a new temporary file in the same folder and then renames
/// that file to `path`. `path` is therefore either complete or unchanged: if `write` throws, the temporary file is
/// removed and an existing `path` stays as it was. On return, the file and its folder entry are on the disk (fsync).
/// The new file takes over the permissions of the file that it replaces. If `path` is a symbolic link, its target is
/// replaced. The temporary file has an unpredictable name and is locked while it is written. A temporary file that a
/// killed process has left for the same path is removed.
///
/// "-" is the standard output. Pipes, sockets, terminals and other character devices, /dev/stdout and /dev/fd/N are
/// never replaced. The data is first written to a file in the system's temporary folder and then copied into them.
///
/// If the folder of a relative path is missing and its parent exists, the folder is created: out/a.png creates out/.
/// The folder of an absolute path is not created, because a typing error would then create a folder somewhere.
/// Throws FileError, naming `path`, if the folder or file cannot be written, or if `write` leaves the file empty; and
/// if a temporary folder is needed, but TMPDIR names none. Safe to call from several threads and processes at once: the
/// last one to finish wins.
void writeAtomically(const std::filesystem::path& path,
                     const std::function<void(const std::filesystem::path& temporary)>& write);

/// The same for a function that writes to a binary stream; here the file may be empty. The stream throws on failure (a
/// full disk, for example), which becomes FileError. Polls `cancelled` while it writes, and throws Interrupted if it
/// returns true.
void writeAtomically(const std::filesystem::path& path, const std::function<void(std::ostream&)>& write,
                     const std::function<bool()>& cancelled = {});

/// Removes the temporary files of the calls of writeAtomically() that run in this process, up to 64 at a time. The
/// process must then end without returning to them. For programs that end at once; safe in a signal handler.
void removeUnfinishedFiles() noexcept;

/// Throws FileError if writeAtomically(path) would fail now. Call it before a long computation, to fail early.
void checkWritable(const std::filesystem::path& path);

} // namespace curlew
