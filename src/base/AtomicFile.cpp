// SPDX-License-Identifier: Apache-2.0
#include "curlew/base/AtomicFile.h"

#include "WriteTarget.h"
#include "curlew/base/Digest.h"
#include "curlew/base/Error.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/random.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <climits>
#include <cstring>
#include <fstream>
#include <locale>
#include <optional>

namespace curlew {

namespace {

namespace fs = std::filesystem;

fs::path folderOf(const fs::path& path) { return path.has_parent_path() ? path.parent_path() : fs::path("."); }

/// Creates the folder of a file. The destructor removes it if this object created it and it is still empty.
class FolderOfFile {
  public:
    explicit FolderOfFile(const fs::path& path) : mFolder(folderOf(path)) {
        std::error_code error;
        mMade = fs::create_directory(mFolder, error);
        if (error)
            throw FileError(fmt::format("cannot write '{}': cannot make the folder '{}': {}", path.string(),
                                        mFolder.string(), error.message()));
    }
    ~FolderOfFile() {
        std::error_code ignored;
        if (mMade) fs::remove(mFolder, ignored);
    }
    FolderOfFile(const FolderOfFile&) = delete;
    FolderOfFile& operator=(const FolderOfFile&) = delete;

  private:
    fs::path mFolder;
    bool mMade = false;
};

/// The prefix of the temporary files' names for a path. It is a hash, so it does not grow with the path's name.
std::string prefixFor(const fs::path& path) {
    return fmt::format(".curlew-{:.16}-", DigestBuilder().add(path.filename().string()).digest().hex());
}

/// Removes temporary files that a killed process has left for this path. Files that are locked are being written.
void removeStale(const fs::path& path) {
    const std::string prefix = prefixFor(path);
    std::error_code ignored;
    for (const fs::directory_entry& entry : fs::directory_iterator(folderOf(path), ignored)) {
        if (!entry.path().filename().string().starts_with(prefix)) continue;
        const Descriptor file(::open(entry.path().c_str(), O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC));
        struct stat status {};
        if (!file.valid() || ::fstat(*file, &status) != 0 || !S_ISREG(status.st_mode)) continue;
        if (::flock(*file, LOCK_EX | LOCK_NB) == 0) fs::remove(entry.path(), ignored);
    }
}

uint64_t randomNumber() {
    uint64_t number = 0;
    if (::getrandom(&number, sizeof(number), 0) != sizeof(number)) number = static_cast<uint64_t>(::getpid());
    return number;
}

/// The names of the files being written, for removeUnfinishedFiles(), which a signal handler may call: a fixed table
/// without locks. Files beyond its size are not in it.
struct Unfinished {
    std::atomic<bool> taken = false;    ///< Reserved for a file.
    std::atomic<bool> complete = false; ///< `name` is valid.
    std::array<char, PATH_MAX> name;
};
std::array<Unfinished, 64> unfinishedFiles;

/// Lists a file in this table during the lifetime of this object.
class ListedFile {
  public:
    explicit ListedFile(const fs::path& name) {
        if (name.native().size() >= PATH_MAX) return;
        for (Unfinished& entry : unfinishedFiles) {
            if (entry.taken.exchange(true)) continue;
            entry.name[name.native().copy(entry.name.data(), entry.name.size() - 1)] = '\0';
            entry.complete = true;
            mEntry = &entry;
            return;
        }
    }
    ~ListedFile() {
        if (!mEntry) return;
        mEntry->complete = false;
        mEntry->taken = false;
    }
    ListedFile(const ListedFile&) = delete;
    ListedFile& operator=(const ListedFile&) = delete;

  private:
    Unfinished* mEntry = nullptr;
};

/// A new, empty, locked file in a folder, with an unpredictable name. The destructor removes it unless it was renamed.
class TemporaryFile {
  public:
    /// `path` is the final name, which errors report. `mode` holds the permissions before the umask.
    TemporaryFile(const fs::path& folder, const fs::path& path, mode_t mode) {
        do {
            mName = folder / fmt::format("{}{:016x}.part", prefixFor(path), randomNumber());
            mListed.emplace(mName);
            mFile.emplace(::open(mName.c_str(), O_RDWR | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, mode));
            if (!mFile->valid())
                throw FileError(
                    fmt::format("cannot write '{}': {}; choose another folder", path.string(), std::strerror(errno)));
            while (::flock(**mFile, LOCK_EX) != 0 && errno == EINTR) {
            }
        } while (removedBeforeLocked());
    }
    ~TemporaryFile() {
        std::error_code ignored;
        if (!mMoved) fs::remove(mName, ignored);
    }
    TemporaryFile(const TemporaryFile&) = delete;
    TemporaryFile& operator=(const TemporaryFile&) = delete;

    const fs::path& name() const { return mName; }
    bool empty() const {
        struct stat status {};
        return ::fstat(**mFile, &status) != 0 || status.st_size == 0;
    }

    /// Renames the file to `path`, with the permissions of the file that it replaces. After this, the disk holds the
    /// complete file, even after a power failure.
    void moveTo(const fs::path& path) {
        struct stat before {};
        if (::stat(path.c_str(), &before) == 0) ::fchmod(**mFile, before.st_mode & 07777);
        const auto check = [&](int result) {
            if (result != 0)
                throw FileError(fmt::format("cannot write '{}': {}; free some space or choose another folder",
                                            path.string(), std::strerror(errno)));
        };
        check(::fsync(**mFile));
        check(::rename(mName.c_str(), path.c_str()));
        mMoved = true;
        const Descriptor folder(::open(folderOf(path).c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
        if (folder.valid()) ::fsync(*folder); // some file systems cannot: EINVAL
    }

  private:
    /// Whether another process took the new file for a stale one and removed it.
    bool removedBeforeLocked() const {
        struct stat status {};
        return ::fstat(**mFile, &status) == 0 && status.st_nlink == 0;
    }

    fs::path mName;
    std::optional<ListedFile> mListed;
    std::optional<Descriptor> mFile;
    bool mMoved = false;
};

/// The initial permissions of a file at `path`: those of the file that it replaces, and never more for others. Its
/// owner must be able to write it.
mode_t modeFor(const fs::path& path) {
    struct stat before {};
    return ::stat(path.c_str(), &before) == 0 ? (before.st_mode & 0777) | S_IWUSR : 0666;
}

using WriteFile = std::function<void(const fs::path& temporary)>;

void write(const fs::path& path, const WriteFile& writer, bool mayBeEmpty, const std::function<bool()>& cancelled) {
    checkWritable(path);
    const WriteTarget target = WriteTarget::of(path);
    const bool stream = target.kind == WriteTarget::Kind::stream;
    std::optional<FolderOfFile> folder;
    if (!stream) {
        folder.emplace(target.path);
        removeStale(target.path);
    }
    TemporaryFile temporary(stream ? temporaryFolder() : folderOf(target.path), target.path,
                            stream ? 0600 : modeFor(target.path));
    writer(temporary.name());
    if (!mayBeEmpty && temporary.empty())
        throw FileError(fmt::format("cannot write '{}': nothing was written", path.string()));
    if (stream)
        copyInto(target, temporary.name(), path, cancelled);
    else
        temporary.moveTo(target.path);
}

/// A file buffer that stops when it is cancelled. It throws Interrupted from xsputn(), which the stream passes on.
class CancellableBuffer : public std::filebuf {
  public:
    explicit CancellableBuffer(const std::function<bool()>& cancelled) : mCancelled(cancelled) {}

  protected:
    std::streamsize xsputn(const char* data, std::streamsize size) override {
        if (mCancelled && mCancelled()) throw Interrupted();
        return std::filebuf::xsputn(data, size);
    }

  private:
    const std::function<bool()>& mCancelled;
};

} // namespace

void checkWritable(const fs::path& path) {
    if (path.filename().empty())
        throw FileError(fmt::format("cannot write '{}': it names a folder, not a file", path.string()));
    const WriteTarget target = WriteTarget::of(path);
    const auto noPermission = [&](const fs::path& at) {
        throw FileError(fmt::format("cannot write '{}': no permission to write in '{}'", path.string(), at.string()));
    };
    if (target.kind == WriteTarget::Kind::stream) {
        if (target.descriptor < 0 && ::access(target.path.c_str(), W_OK) != 0) noPermission(target.path);
        return;
    }
    std::error_code error;
    fs::path folder = folderOf(target.path);
    if (target.path.is_relative() && !fs::exists(folder, error))
        folder = folderOf(folder); // FolderOfFile creates it there
    if (!fs::is_directory(folder, error))
        throw FileError(
            fmt::format("cannot write '{}': there is no folder '{}'; create it first", path.string(), folder.string()));
    if (fs::is_directory(target.path, error))
        throw FileError(fmt::format("cannot write '{}': a folder has that name; choose another", path.string()));
    if (::access(folder.c_str(), W_OK) != 0) noPermission(folder);
}

void removeUnfinishedFiles() noexcept {
    for (const Unfinished& entry : unfinishedFiles)
        if (entry.complete) ::unlink(entry.name.data());
}

void writeAtomically(const fs::path& path, const std::function<void(const fs::path&)>& writer) {
    write(path, writer, /*mayBeEmpty=*/false, {});
}

void writeAtomically(const fs::path& path, const std::function<void(std::ostream&)>& writer,
                     const std::function<bool()>& cancelled) {
    const auto toStream = [&](const fs::path& temporary) {
        CancellableBuffer buffer(cancelled);
        errno = 0;
        if (!buffer.open(temporary, std::ios::binary | std::ios::out | std::ios::trunc))
            throw FileError(
                fmt::format("cannot write '{}': {}; choose another folder", path.string(), std::strerror(errno)));
        std::ostream stream(&buffer);
        stream.imbue(std::locale::classic());
        stream.exceptions(std::ios::badbit | std::ios::failbit);
        try {
            writer(stream);
            stream.flush();
            if (!buffer.close()) throw std::ios_base::failure("close");
        } catch (const std::ios_base::failure&) {
            const int cause = errno;
            throw FileError(fmt::format("cannot write '{}': {}; free some space or choose another folder",
                                        path.string(),
                                        cause ? std::strerror(cause) : "not all of it could be written"));
        }
    };
    write(path, toStream, /*mayBeEmpty=*/true, cancelled);
}

} // namespace curlew
