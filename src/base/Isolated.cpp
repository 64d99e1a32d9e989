// SPDX-License-Identifier: Apache-2.0
#include "curlew/base/Isolated.h"

#include "curlew/base/Memory.h"

#include <dlfcn.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <spawn.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <new>

namespace curlew {

namespace {

namespace fs = std::filesystem;

constexpr const char* kMode = "--read-isolated";
constexpr int kResult = 3, kAlive = 4; ///< Descriptors in the reader process: its output; a pipe open while it lives.

/// How the reading ended. It is the first part of the result but is written last, so it is set only if the rest is
/// complete.
enum class Outcome : uint64_t { none, done, valueError, fileError, resourceError };

/// The padding that makes the next part start at a multiple of 8 bytes.
size_t paddingOf(size_t bytes) { return (8 - bytes % 8) % 8; }

/// A file descriptor, closed by close() or the destructor.
struct Descriptor {
    int number = -1;
    explicit Descriptor(int n) : number(n) {}
    Descriptor(const Descriptor&) = delete;
    Descriptor& operator=(const Descriptor&) = delete;
    ~Descriptor() { close(); }
    void close() {
        if (number >= 0) ::close(number);
        number = -1;
    }
};

ResourceError cannotStart(const std::string& what) {
    return ResourceError(fmt::format("cannot start a process to read the file: {}: {}", what, std::strerror(errno)));
}

std::string programBeside(const fs::path& place) {
    for (const char* folder : {"", "../bin", "../../bin"}) {
        std::error_code error;
        const fs::path program = fs::weakly_canonical(place / folder / "curlew", error);
        if (!error && fs::is_regular_file(program, error) && access(program.c_str(), X_OK) == 0)
            return program.string();
    }
    return {};
}

std::string findProgram() {
    if (const char* named = std::getenv("CURLEW_READER")) return named;
    std::error_code error;
    const fs::path self = fs::read_symlink("/proc/self/exe", error);
    if (!error && self.filename() == "curlew") return self.string();
    Dl_info library{};
    if (dladdr(reinterpret_cast<const void*>(&isolatedProgram), &library) == 0 || !library.dli_fname) return {};
    return programBeside(fs::absolute(library.dli_fname, error).parent_path());
}

rlim_t secondsFor(const fs::path& path) {
    constexpr uintmax_t least = 30, bytesPerSecond = 1'000'000;
    std::error_code error;
    const uintmax_t size = fs::file_size(path, error);
    return error ? least : least + size / bytesPerSecond;
}

/// The reader process. The destructor kills it if it still runs.
class Process {
  public:
    Process(const std::vector<std::string>& arguments, int result, int alive) {
        posix_spawn_file_actions_t files;
        posix_spawnattr_t attributes;
        posix_spawn_file_actions_init(&files);
        posix_spawnattr_init(&attributes);
        posix_spawn_file_actions_addopen(&files, 0, "/dev/null", O_RDONLY, 0);
        posix_spawn_file_actions_addopen(&files, 1, "/dev/null", O_WRONLY, 0);
        posix_spawn_file_actions_addopen(&files, 2, "/dev/null", O_WRONLY, 0);
        // Both are above kAlive, so dup2 overwrites neither before it is copied.
        posix_spawn_file_actions_adddup2(&files, result, kResult);
        posix_spawn_file_actions_adddup2(&files, alive, kAlive);
        posix_spawn_file_actions_addclosefrom_np(&files, kAlive + 1);
        // Ctrl-C in the terminal goes to the host only, which kills this process if it wants to.
        sigset_t none;
        sigemptyset(&none);
        posix_spawnattr_setsigmask(&attributes, &none);
        posix_spawnattr_setpgroup(&attributes, 0);
        posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETPGROUP);
        std::vector<char*> pointers;
        for (const std::string& argument : arguments) pointers.push_back(const_cast<char*>(argument.c_str()));
        pointers.push_back(nullptr);
        errno = posix_spawn(&mId, pointers.front(), &files, &attributes, pointers.data(), environ);
        const int error = errno;
        posix_spawn_file_actions_destroy(&files);
        posix_spawnattr_destroy(&attributes);
        errno = error;
        if (error != 0) throw cannotStart(fmt::format("'{}'", arguments.front()));
    }
    ~Process() {
        if (!mEnded) {
            kill(mId, SIGKILL);
            wait();
        }
    }
    Process(const Process&) = delete;
    Process& operator=(const Process&) = delete;

    /// Returns the exit status as waitpid does; 0 if the host has told the system to discard its children's status.
    int wait() {
        int status = 0;
        while (waitpid(mId, &status, 0) < 0 && errno == EINTR) {
        }
        mEnded = true;
        return status;
    }

  private:
    pid_t mId = -1;
    bool mEnded = false;
};

/// Moves a descriptor to a number above those that the reader process uses.
int moved(int descriptor) {
    const int high = descriptor < 0 ? -1 : fcntl(descriptor, F_DUPFD_CLOEXEC, 16);
    const int error = errno;
    if (descriptor >= 0) close(descriptor);
    errno = error;
    return high;
}

FileError crashed(const fs::path& path, int status) {
    std::string how = "the process that read it crashed";
    if (WIFSIGNALED(status) && WTERMSIG(status) == SIGXCPU)
        how = "reading it takes too long";
    else if (WIFSIGNALED(status))
        how += fmt::format(" (signal {})", WTERMSIG(status));
    return FileError(fmt::format("'{}' is damaged: {}; write or copy it again", path.string(), how));
}

/// Maps the shared memory that holds the result.
std::string_view mapped(int file, std::shared_ptr<const void>& memory) {
    const off_t size = lseek(file, 0, SEEK_END);
    if (size <= 0) return {};
    const auto bytes = static_cast<size_t>(size);
    void* begin = mmap(nullptr, bytes, PROT_READ, MAP_SHARED | MAP_POPULATE, file, 0);
    if (begin == MAP_FAILED) throw ResourceError("cannot map the data that was read into memory; free some memory");
    memory = std::shared_ptr<const void>(begin, [bytes](const void* p) { munmap(const_cast<void*>(p), bytes); });
    return {static_cast<const char*>(begin), bytes};
}

} // namespace

void PartWriter::write(const void* data, size_t bytes) {
    const char* from = static_cast<const char*>(data);
    while (bytes > 0) {
        const ssize_t done = ::write(mFile, from, bytes);
        if (done < 0 && errno == EINTR) continue;
        if (done <= 0) throw FileError(fmt::format("cannot pass on the data that was read: {}", std::strerror(errno)));
        from += done;
        bytes -= static_cast<size_t>(done);
    }
}

void PartWriter::part(const void* data, size_t bytes) {
    const uint64_t size = bytes;
    constexpr uint64_t zeros = 0;
    write(&size, sizeof size);
    write(data, bytes);
    write(&zeros, paddingOf(bytes));
}

std::string_view PartReader::part() {
    uint64_t size = 0;
    if (mLeft.size() < sizeof size) throw damaged();
    std::memcpy(&size, mLeft.data(), sizeof size);
    mLeft.remove_prefix(sizeof size);
    if (size > mLeft.size()) throw damaged();
    const std::string_view bytes = mLeft.substr(0, size);
    mLeft.remove_prefix(std::min<size_t>(mLeft.size(), size + paddingOf(size)));
    return bytes;
}

FileError PartReader::damaged() const {
    return FileError(fmt::format(
        "'{}' is damaged: the process that read it returned invalid data; write or copy it again", mPath.string()));
}

const std::string& isolatedProgram() {
    static const std::string kProgram = findProgram();
    return kProgram;
}

namespace {
std::atomic<bool> hostWantsIsolation = true;
} // namespace

bool readsIsolated() { return hostWantsIsolation && !isolatedProgram().empty(); }
void setReadsIsolated(bool on) { hostWantsIsolation = on; }

PartReader readIsolated(const std::string& reader, const fs::path& path, const Monitor& monitor) {
    monitor.check();
    const Descriptor result(moved(memfd_create("curlew", MFD_CLOEXEC)));
    if (result.number < 0) throw cannotStart("cannot create shared memory");
    std::array<int, 2> ends{-1, -1};
    if (pipe2(ends.data(), O_CLOEXEC) != 0) throw cannotStart("cannot create a pipe");
    const Descriptor living(moved(ends[0]));
    Descriptor alive(moved(ends[1]));
    if (living.number < 0 || alive.number < 0) throw cannotStart("cannot create a pipe");

    Process process({isolatedProgram(), kMode, reader, path.string(), std::to_string(availableMemory()),
                     std::to_string(secondsFor(path))},
                    result.number, alive.number);
    alive.close();
    for (pollfd end{.fd = living.number, .events = 0, .revents = 0}; poll(&end, 1, 50) <= 0;) monitor.check();
    const int status = process.wait();

    std::shared_ptr<const void> memory;
    std::string_view bytes = mapped(result.number, memory);
    auto outcome = Outcome::none;
    if (bytes.size() >= sizeof outcome) {
        std::memcpy(&outcome, bytes.data(), sizeof outcome);
        bytes.remove_prefix(sizeof outcome);
    }
    PartReader parts(memory, bytes, path);
    switch (outcome) {
        case Outcome::done:
            return parts;
        case Outcome::valueError:
            throw ValueError(std::string(parts.text()));
        case Outcome::fileError:
            throw FileError(std::string(parts.text()));
        case Outcome::resourceError:
            throw ResourceError(std::string(parts.text()));
        default:
            throw crashed(path, status);
    }
}

bool isIsolatedReader(const std::vector<std::string>& arguments) {
    return arguments.size() == 5 && arguments.front() == kMode;
}

int runIsolatedReader(const std::vector<std::string>& arguments, IsolatedReader (*readerOf)(const std::string& name)) {
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    const auto limit = [](auto what, rlim_t most) {
        const rlimit both{most, most};
        setrlimit(what, &both);
    };
    // Libraries and thread stacks take address space, but hardly any memory.
    constexpr rlim_t addresses = rlim_t{2} << 30;
    limit(RLIMIT_CORE, 0);
    limit(RLIMIT_AS, std::strtoull(arguments[3].c_str(), nullptr, 10) + addresses);
    limit(RLIMIT_CPU, std::strtoull(arguments[4].c_str(), nullptr, 10));

    const auto finish = [](Outcome outcome) {
        return pwrite(kResult, &outcome, sizeof outcome, 0) == ssize_t{sizeof outcome} ? EXIT_SUCCESS : EXIT_FAILURE;
    };
    const auto fail = [&](Outcome outcome, std::string_view message) {
        if (ftruncate(kResult, sizeof outcome) != 0 || lseek(kResult, sizeof outcome, SEEK_SET) < 0)
            return EXIT_FAILURE;
        PartWriter(kResult).text(message);
        return finish(outcome);
    };
    try {
        const auto none = Outcome::none;
        if (::write(kResult, &none, sizeof none) != ssize_t{sizeof none}) return EXIT_FAILURE;
        const IsolatedReader reader = readerOf(arguments[1]);
        if (!reader) return EXIT_FAILURE;
        PartWriter parts(kResult);
        reader(arguments[2], parts);
        return finish(Outcome::done);
    } catch (const ValueError& error) {
        return fail(Outcome::valueError, error.what());
    } catch (const FileError& error) {
        return fail(Outcome::fileError, error.what());
    } catch (const ResourceError& error) {
        return fail(Outcome::resourceError, error.what());
    } catch (const std::bad_alloc&) {
        return fail(Outcome::resourceError, "out of memory while reading the file; free some memory");
    } catch (const std::exception& error) {
        return fail(Outcome::fileError, fmt::format("'{}' cannot be read: {}", arguments[2], error.what()));
    }
}

} // namespace curlew
