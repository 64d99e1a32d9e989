#pragma once

#include <filesystem>
#include <functional>
#include <ostream>

namespace curlew {

/// Calls `write` with the name of a temporary file in the same folder, then renames that file to `path`. So `path` is
/// there whole or not at all: if `write` throws, the temporary file is removed and an earlier `path` is left as it was.
/// A folder of a relative path is made if it is missing and the one above it is there: out/a.png makes out/. A folder
/// of an absolute path is not, since that is where a mistyped name would otherwise put files that nobody finds. Throws
/// FileError, naming `path`, where the folder or file cannot be written.
void writeAtomically(const std::filesystem::path& path,
                     const std::function<void(const std::filesystem::path& temporary)>& write);

/// The same for a writer to a binary stream. The stream throws on failure (a full disk, say), which becomes FileError;
/// `cancelled` is asked now and then while it writes (Interrupted).
void writeAtomically(const std::filesystem::path& path, const std::function<void(std::ostream&)>& write,
                     const std::function<bool()>& cancelled = {});

/// Throws FileError if writeAtomically(path) could not succeed as things stand: to fail before the work, not after it.
void checkWritable(const std::filesystem::path& path);

} // namespace curlew
