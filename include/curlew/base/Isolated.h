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

// A file that nobody trusts is read by a process of its own: one that is damaged so that the library which reads it
// crashes, hangs or takes all memory ends that process and not the host. The process is the command `curlew` in a mode
// that its help does not show. It is spawned, not forked: hosts have threads. What it has read comes back as parts in
// shared memory.

/// Writes arrays and texts for the other process. Throws FileError if there is no room for them.
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

/// Takes the parts one after another. Throws FileError, naming the file that was read, if they are not what is asked
/// for: the other process is trusted no more than the file.
class PartReader {
  public:
    PartReader(std::shared_ptr<const void> memory, std::string_view bytes, std::filesystem::path path)
        : mMemory(std::move(memory)), mLeft(bytes), mPath(std::move(path)) {}

    template <class T>
    std::vector<T> array() {
        static_assert(std::is_trivially_copyable_v<T>);
        const std::string_view bytes = part();
        if (bytes.size() % sizeof(T) != 0) throw damaged();
        const T* first = reinterpret_cast<const T*>(bytes.data()); // parts begin at multiples of 8 bytes
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

/// Reads one kind of file in the other process.
using IsolatedReader = void (*)(const std::filesystem::path& path, PartWriter& parts);

/// The command `curlew`, which can be that process: this program, or the command beside this library or in the bin/ of
/// its installation, or what the environment variable CURLEW_READER names; "" if there is none, and then files are read
/// in this process. Safe to call from several threads.
const std::string& isolatedProgram();

/// Whether files that cannot be trusted are read by another process: as the host has said last, at first yes, and never
/// without isolatedProgram(). It is of the whole process, as its children are. Safe to call from several threads.
bool readsIsolated();
void setReadsIsolated(bool on);

/// Lets `reader` of that process read a file, which takes at most the memory that is available and a time that grows
/// with the file (30 s of a processor, and 1 s for each MB). Throws what the reader threw, FileError if the process
/// ended without an answer, ResourceError if it cannot be started, and Interrupted once the monitor says so. Needs
/// isolatedProgram(). Safe to call from several threads.
PartReader readIsolated(const std::string& reader, const std::filesystem::path& path, const Monitor& monitor);

/// In the other process: whether these are the arguments of one, and if so, its exit status once it has read the file.
bool isIsolatedReader(const std::vector<std::string>& arguments);
int runIsolatedReader(const std::vector<std::string>& arguments, IsolatedReader (*readerOf)(const std::string& name));

} // namespace curlew
