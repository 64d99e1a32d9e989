#include "curlew/base/AtomicFile.h"

#include "curlew/base/Error.h"

#include <fmt/format.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstring>
#include <fstream>

namespace curlew {

namespace {

namespace fs = std::filesystem;

fs::path temporaryName(const fs::path& path) {
    static std::atomic<unsigned> count = 0; // two threads may write the same file
    fs::path name = path;
    name.replace_filename(fmt::format(".{}.{}-{}.part", path.filename().string(), ::getpid(), count++));
    return name;
}

fs::path folderOf(const fs::path& path) { return path.has_parent_path() ? path.parent_path() : fs::path("."); }

/// Makes the folder of a file, which is removed again if it is still empty in the end.
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

/// Removes the temporary file unless it has been renamed.
struct Remover {
    const fs::path& file;
    ~Remover() {
        std::error_code ignored;
        fs::remove(file, ignored);
    }
};

/// A file buffer that gives up as soon as it is cancelled; the stream above it turns that into Interrupted.
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
    std::error_code error;
    fs::path folder = folderOf(path);
    if (path.is_relative() && !fs::exists(folder, error)) folder = folderOf(folder); // FolderOfFile makes it there
    if (!fs::is_directory(folder, error))
        throw FileError(
            fmt::format("cannot write '{}': there is no folder '{}'; create it first", path.string(), folder.string()));
    if (fs::is_directory(path, error))
        throw FileError(fmt::format("cannot write '{}': a folder has that name; choose another", path.string()));
    if (::access(folder.c_str(), W_OK) != 0)
        throw FileError(
            fmt::format("cannot write '{}': no permission to write in '{}'", path.string(), folder.string()));
}

void writeAtomically(const fs::path& path, const std::function<void(const fs::path&)>& write) {
    checkWritable(path);
    const FolderOfFile folder(path);
    const fs::path temporary = temporaryName(path);
    const Remover remover{temporary};
    write(temporary);
    std::error_code error;
    fs::rename(temporary, path, error);
    if (error) throw FileError(fmt::format("cannot write '{}': {}", path.string(), error.message()));
}

void writeAtomically(const fs::path& path, const std::function<void(std::ostream&)>& write,
                     const std::function<bool()>& cancelled) {
    writeAtomically(path, [&](const fs::path& temporary) {
        CancellableBuffer buffer(cancelled);
        errno = 0;
        if (!buffer.open(temporary, std::ios::binary | std::ios::out | std::ios::trunc))
            throw FileError(
                fmt::format("cannot write '{}': {}; choose another folder", path.string(), std::strerror(errno)));
        std::ostream stream(&buffer);
        stream.exceptions(std::ios::badbit | std::ios::failbit);
        try {
            write(stream);
            stream.flush();
            if (!buffer.close()) throw std::ios_base::failure("close");
        } catch (const std::ios_base::failure&) {
            const int cause = errno;
            throw FileError(fmt::format("cannot write '{}': {}; free some space or choose another folder",
                                        path.string(),
                                        cause ? std::strerror(cause) : "the disk did not take all of it"));
        }
    });
}

} // namespace curlew
