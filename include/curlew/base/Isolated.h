// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/base/Error.h"
#include "curlew/base/Monitor.h"

#include <algorithm>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

namespace curlew {

// Untrusted files are read in a process of their own. If a damaged file makes the reading library crash, hang or
// exhaust memory, it ends that process and not the host. The process runs the command `curlew` in a mode that its help
// does not show. It is spawned and not forked, because hosts have threads. It returns the data as parts in a pipe,
// which the host takes while the process still writes.

/// Writes arrays and texts for the host process. Throws FileError if the host does not take them.
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

    int mFile;
};

/// The bytes that a reader process returns.
class PartSource {
  public:
    virtual ~PartSource() = default;

    /// Copies the next `bytes` bytes. Throws FileError if there are fewer, and what the process reported instead of
    /// them.
    virtual void take(void* to, size_t bytes) = 0;
};

/// Returns the parts in the order in which they were written. Throws FileError, naming the file that was read, if a
/// part does not match what the caller requests or all parts together have more than `most` bytes: the reader process
/// is trusted no more than the file. Rethrows the ValueError, FileError or ResourceError that the reader threw.
class PartReader {
  public:
    PartReader(std::unique_ptr<PartSource> source, size_t most, std::filesystem::path path)
        : mSource(std::move(source)), mLeft(most), mPath(std::move(path)) {}

    template <class T>
    std::vector<T> array() {
        static_assert(std::is_trivially_copyable_v<T>);
        const size_t bytes = nextSize(), count = bytes / sizeof(T);
        if (bytes % sizeof(T) != 0) throw damaged();
        std::vector<T> values;
        values.reserve(count);
        useHugePages(values.data(), bytes);
        // Memory is used only for what arrives.
        constexpr size_t step = kStep / sizeof(T) + 1;
        for (size_t k = 0; k < count; k = values.size()) {
            values.resize(std::min(count, k + step));
            mSource->take(values.data() + k, (values.size() - k) * sizeof(T));
        }
        return values;
    }
    std::string text();
    size_t left() const { return mLeft; } ///< What remains of `most`.
    void finish();                        ///< After the last part: throws unless the reader has ended with success.
    FileError damaged() const;

    struct Header;

  private:
    static constexpr size_t kStep = 1 << 18;

    Header next();
    size_t nextSize();
    static void useHugePages(void* memory, size_t bytes);

    std::unique_ptr<PartSource> mSource;
    size_t mLeft;
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
/// processor time of 30 s plus 1 s per MB of the file. Throws ResourceError if it cannot be started. The parts throw
/// FileError if the process ended without an answer, and Interrupted if the monitor cancels. Requires
/// isolatedProgram(). Safe to call from several threads.
PartReader readIsolated(const std::string& reader, const std::filesystem::path& path, const Monitor& monitor);

/// For the reader process: isIsolatedReader() returns whether these are its arguments, and runIsolatedReader() reads
/// the file and returns the exit status.
bool isIsolatedReader(const std::vector<std::string>& arguments);
int runIsolatedReader(const std::vector<std::string>& arguments, IsolatedReader (*readerOf)(const std::string& name));

} // namespace curlew
