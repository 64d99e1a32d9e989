// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/base/Error.h"
#include "curlew/base/Monitor.h"

#include <cstring>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

namespace curlew {

// Untrusted files are read in a process of their own. If a damaged file makes the reading library crash, hang or
// exhaust memory, it ends that process and not the host. The process runs the command `curlew` in a mode that its help
// does not show. It is spawned and not forked, because hosts have threads. It returns the data as parts in shared
// memory.

/// Writes arrays and texts for the host process. Throws FileError if there is no room for them.
class PartWriter {
  public:
    explicit PartWriter(int file) : mFile(file) {}

    template <class T>
    void array(const std::vector<T>& values) {
        static_assert(std::is_trivially_copyable_v<T>);
        part(values.data(), values.size() * sizeof(T));
    }
    void text(std::string_view text) { part(text.data(), text.size()); }

  private:
    void part(const void* data, size_t bytes);
    void write(const void* data, size_t bytes);

    int mFile;
};

/// Returns the parts in the order in which they were written. Throws FileError, naming the file that was read, if a
/// part does not match what the caller requests: the reader process is trusted no more than the file.
class PartReader {
  public:
    PartReader(std::shared_ptr<const void> memory, std::string_view bytes, std::filesystem::path path)
        : mMemory(std::move(memory)), mLeft(bytes), mPath(std::move(path)) {}

    template <class T>
    std::vector<T> array() {
        static_assert(std::is_trivially_copyable_v<T>);
        const std::string_view bytes = part();
        if (bytes.size() % sizeof(T) != 0) throw damaged();
        const T* first = reinterpret_cast<const T*>(bytes.data()); // parts start at multiples of 8 bytes
        return std::vector<T>(first, first + bytes.size() / sizeof(T));
    }
    std::string_view text() { return part(); }
    size_t left() const { return mLeft.size(); } ///< Bytes of the parts that have not been taken.
    FileError damaged() const;

  private:
    std::string_view part();

    std::shared_ptr<const void> mMemory;
    std::string_view mLeft;
    std::filesystem::path mPath;
};

/// Reads one kind of file; runs in the reader process.
using IsolatedReader = void (*)(const std::filesystem::path& path, PartWriter& parts);

/// Returns the command `curlew` that serves as the reader process: the value of the environment variable CURLEW_READER
/// if it is set, else this program if it is `curlew`, else the command beside this library or in the bin/ of its
/// installation. Returns "" if there is none; files are then read in the host process. Safe to call from several
/// threads.
const std::string& isolatedProgram();

/// Returns whether untrusted files are read in a process of their own. The default is yes; without isolatedProgram() it
/// is always no. setReadsIsolated() changes the setting for the whole process. Safe to call from several threads.
bool readsIsolated();
void setReadsIsolated(bool on);

/// Runs the named `reader` on a file in a new process. The process may use the memory that is available now, and
/// processor time of 30 s plus 1 s per MB of the file. Rethrows the ValueError, FileError or ResourceError that the
/// reader threw. Throws FileError if the process ended without an answer, ResourceError if it cannot be started, and
/// Interrupted if the monitor cancels. Requires isolatedProgram(). Safe to call from several threads.
PartReader readIsolated(const std::string& reader, const std::filesystem::path& path, const Monitor& monitor);

/// For the reader process: isIsolatedReader() returns whether these are its arguments, and runIsolatedReader() reads
/// the file and returns the exit status.
bool isIsolatedReader(const std::vector<std::string>& arguments);
int runIsolatedReader(const std::vector<std::string>& arguments, IsolatedReader (*readerOf)(const std::string& name));

} // namespace curlew
