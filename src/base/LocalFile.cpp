// SPDX-License-Identifier: Apache-2.0
#include "curlew/base/LocalFile.h"

#include "WriteTarget.h"
#include "curlew/base/Error.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <utility>
#include <vector>

namespace curlew {

namespace fs = std::filesystem;

namespace {

constexpr size_t kPiece = size_t{1} << 20;
constexpr uintmax_t kSpared = uintmax_t{256} << 20; // bytes to leave free in the temporary folder

std::string lowerEnding(const fs::path& name) {
    std::string ending = name.extension().string();
    for (char& c : ending) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    return ending;
}

FileError unreadable(const fs::path& name, const std::string& why) {
    return FileError(fmt::format("cannot read '{}': {}", name.string(), why));
}

bool isGzip(const fs::path& file) {
    std::array<char, 2> begin{};
    std::ifstream(file, std::ios::binary).read(begin.data(), begin.size());
    return begin == std::array{'\x1f', '\x8b'};
}

/// Returns the file name without its folders, its extension and .gz.
std::string plainName(const fs::path& name) {
    if (name == "-" || name == "/dev/stdin") return "stdin";
    fs::path stem = name.filename();
    if (lowerEnding(stem) == ".gz") stem = stem.stem();
    return stem.stem().string();
}

/// A file read through zlib, compressed or not.
class GzipFile {
  public:
    explicit GzipFile(const fs::path& name) : mName(name) {
        errno = 0;
        const int descriptor =
            name == "-" ? ::fcntl(STDIN_FILENO, F_DUPFD_CLOEXEC, 3) : ::open(name.c_str(), O_RDONLY | O_CLOEXEC);
        if (descriptor < 0) throw unreadable(name, fmt::format("{}; check its permissions", std::strerror(errno)));
        mFile = gzdopen(descriptor, "rb");
        if (!mFile) {
            ::close(descriptor);
            throw unreadable(name, "not enough memory; free some");
        }
        gzbuffer(mFile, kPiece);
    }
    ~GzipFile() {
        if (mFile) gzclose_r(mFile);
    }
    GzipFile(const GzipFile&) = delete;
    GzipFile& operator=(const GzipFile&) = delete;

    /// Returns the number of bytes read; 0 at the end.
    size_t read(std::vector<char>& piece) {
        const int size = gzread(mFile, piece.data(), static_cast<unsigned>(piece.size()));
        if (size < 0) throw damaged();
        return static_cast<size_t>(size);
    }
    /// Throws FileError if the gzip data was incomplete.
    void finish() {
        if (gzclose_r(std::exchange(mFile, nullptr)) != Z_OK) throw damaged();
    }

  private:
    FileError damaged() const {
        return unreadable(mName, "its gzip data is cut short or damaged; write or copy it again");
    }

    fs::path mName;
    gzFile mFile = nullptr;
};

void copy(const fs::path& name, const fs::path& to, const std::function<bool()>& cancelled) {
    GzipFile in(name);
    std::ofstream out(to, std::ios::binary);
    std::vector<char> piece(kPiece);
    size_t total = 0;
    while (const size_t size = in.read(piece)) {
        if (cancelled && cancelled()) throw Interrupted();
        total += size;
        std::error_code error;
        const fs::space_info space = fs::space(to.parent_path(), error);
        if ((!error && space.available < kSpared) || !out.write(piece.data(), static_cast<std::streamsize>(size)))
            throw unreadable(name,
                             fmt::format("after {} MiB there is no space left in '{}'; free some space, or set TMPDIR",
                                         total >> 20, to.parent_path().string()));
    }
    in.finish();
    out.close();
    if (!out) throw unreadable(name, "its copy cannot be written; free some space, or set TMPDIR");
    if (total == 0) throw unreadable(name, "it is empty; write or copy it again");
}

} // namespace

TemporaryFolder::TemporaryFolder() {
    std::string name = (temporaryFolder() / "curlew-XXXXXX").string();
    if (!::mkdtemp(name.data()))
        throw FileError(
            fmt::format("cannot make a folder '{}': {}; set TMPDIR to another", name, std::strerror(errno)));
    mPath = name;
}

TemporaryFolder::TemporaryFolder(TemporaryFolder&& other) noexcept : mPath(std::exchange(other.mPath, {})) {}

TemporaryFolder::~TemporaryFolder() {
    std::error_code ignored;
    if (!mPath.empty()) fs::remove_all(mPath, ignored);
}

bool isStream(const fs::path& name) {
    if (name == "-" || name == "/dev/stdin" || name.string().starts_with("/dev/fd/") ||
        name.string().starts_with("/proc/self/fd/"))
        return true;
    std::error_code error;
    const fs::file_status status = fs::status(name, error);
    return fs::is_fifo(status) || fs::is_socket(status) || fs::is_character_file(status);
}

std::string endingOf(const fs::path& name) {
    const std::string ending = lowerEnding(name);
    return ending == ".gz" ? lowerEnding(name.stem()) : ending;
}

LocalFile::LocalFile(const fs::path& name, const std::string& ending, const std::function<bool()>& cancelled)
    : mPath(name) {
    const std::string wanted = ending.empty() ? endingOf(name) : ending;
    std::error_code error;
    if (!isStream(name)) {
        const bool whole = wanted == lowerEnding(name) && !isGzip(name);
        if (whole || !fs::is_regular_file(name, error)) return; // the caller's reader reports what is wrong
    }
    mFolder = std::make_shared<const TemporaryFolder>();
    mPath = mFolder->path() / (plainName(name) + wanted);
    copy(name, mPath, cancelled);
}

} // namespace curlew
