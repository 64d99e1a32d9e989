// SPDX-License-Identifier: Apache-2.0
#include "WriteTarget.h"

#include "curlew/base/Error.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <charconv>
#include <cstring>
#include <optional>
#include <vector>

namespace curlew {

namespace fs = std::filesystem;

namespace {

/// Returns N if the path is /proc/self/fd/N, under any name of this process in /proc.
std::optional<int> ownDescriptor(const fs::path& path) {
    const std::string name = path.filename().string();
    int number = -1;
    const auto [end, error] = std::from_chars(name.data(), name.data() + name.size(), number);
    if (error != std::errc() || end != name.data() + name.size() || number < 0) return {};
    std::error_code ignored;
    const fs::path folder = fs::canonical(path.parent_path(), ignored), own = fs::canonical("/proc/self/fd", ignored);
    if (ignored || folder != own) return {};
    return number;
}

} // namespace

WriteTarget WriteTarget::of(const fs::path& name) {
    if (name == "-") return of("/dev/stdout");
    WriteTarget target{.path = name};
    constexpr int kMostLinks = 40; // as in Linux
    std::error_code error;
    for (int links = 0; fs::is_symlink(target.path, error); ++links) {
        if (links == kMostLinks)
            throw FileError(fmt::format("cannot write '{}': its symbolic links form a loop", name.string()));
        if (const auto descriptor = ownDescriptor(target.path))
            return {.kind = Kind::stream, .path = target.path, .descriptor = *descriptor};
        const fs::path to = fs::read_symlink(target.path, error);
        if (error) throw FileError(fmt::format("cannot write '{}': {}", name.string(), error.message()));
        target.path = to.is_absolute() ? to : target.path.parent_path() / to;
    }
    const fs::file_status status = fs::status(target.path, error);
    if (fs::is_block_file(status))
        throw FileError(fmt::format("cannot write '{}': it is a block device, such as a disk", name.string()));
    if (fs::is_character_file(status) || fs::is_fifo(status) || fs::is_socket(status)) target.kind = Kind::stream;
    return target;
}

fs::path temporaryFolder() {
    std::error_code error;
    fs::path folder = fs::temp_directory_path(error);
    if (error)
        throw FileError(fmt::format("cannot use the folder for temporary files: {}; set TMPDIR to one that exists",
                                    error.message()));
    return folder;
}

void copyInto(const WriteTarget& target, const fs::path& from, const fs::path& name,
              const std::function<bool()>& cancelled) {
    const auto fail = [&](const char* what) {
        throw FileError(fmt::format("cannot {} '{}': {}", what, name.string(), std::strerror(errno)));
    };
    const Descriptor in(::open(from.c_str(), O_RDONLY | O_CLOEXEC));
    const Descriptor out(target.descriptor >= 0 ? ::fcntl(target.descriptor, F_DUPFD_CLOEXEC, 3)
                                                : ::open(target.path.c_str(), O_WRONLY | O_NOCTTY | O_CLOEXEC));
    if (!in.valid() || !out.valid()) fail("open");
    std::vector<char> piece(size_t{1} << 20);
    for (ssize_t size = 0; (size = ::read(*in, piece.data(), piece.size())) != 0;) {
        if (size < 0) fail("read the temporary file for");
        for (ssize_t done = 0; done < size;) {
            if (cancelled && cancelled()) throw Interrupted();
            const ssize_t written = ::write(*out, piece.data() + done, static_cast<size_t>(size - done));
            if (written < 0 && errno != EINTR) fail("write");
            done += std::max<ssize_t>(written, 0);
        }
    }
}

Descriptor::~Descriptor() {
    if (valid()) ::close(mDescriptor);
}

} // namespace curlew
