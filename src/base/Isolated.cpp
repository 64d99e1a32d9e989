// SPDX-License-Identifier: Apache-2.0
#include "curlew/base/Isolated.h"

#include "curlew/base/HugePages.h"
#include "curlew/base/LibraryError.h"
#include "curlew/base/Memory.h"
#include "curlew/base/Sanitizer.h"

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
#include <cstring>
#include <new>
#include <optional>

namespace curlew {

/// What comes before the bytes of a part, or instead of more parts.
struct PartReader::Header {
    enum class Kind : uint64_t { part = 1, done, valueError, fileError, resourceError };
    Kind kind = Kind::part;
    uint64_t size = 0; ///< Bytes of the part or of the error's message.
};

namespace {

namespace fs = std::filesystem;

constexpr const char* kMode = "--read-isolated";
constexpr int kResult = 3; ///< Descriptor of the pipe in the reader process.

/// A file descriptor, closed by close() or the destructor.
struct PipeEnd {
    int number = -1;
    explicit PipeEnd(int n) : number(n) {}
    PipeEnd(const PipeEnd&) = delete;
    PipeEnd& operator=(const PipeEnd&) = delete;
    ~PipeEnd() { close(); }
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
    Process(const std::vector<std::string>& arguments, int result) {
        posix_spawn_file_actions_t files;
        posix_spawnattr_t attributes;
        posix_spawn_file_actions_init(&files);
        posix_spawnattr_init(&attributes);
        posix_spawn_file_actions_addopen(&files, 0, "/dev/null", O_RDONLY, 0);
        posix_spawn_file_actions_addopen(&files, 1, "/dev/null", O_WRONLY, 0);
        posix_spawn_file_actions_addopen(&files, 2, "/dev/null", O_WRONLY, 0);
        posix_spawn_file_actions_adddup2(&files, result, kResult);
        posix_spawn_file_actions_addclosefrom_np(&files, kResult + 1);
        // Ctrl-C in the terminal goes to the host only, which kills this process if it wants to.
        sigset_t none;
        sigemptyset(&none);
        posix_spawnattr_setsigmask(&attributes, &none);
        posix_spawnattr_setpgroup(&attributes, 0);
        posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETPGROUP);
        const auto pointersTo = [](const std::vector<std::string>& texts) {
            std::vector<char*> pointers;
            pointers.reserve(texts.size() + 1);
            for (const std::string& text : texts) pointers.push_back(const_cast<char*>(text.c_str()));
            pointers.push_back(nullptr);
            return pointers;
        };
        const std::vector<std::string> variables = environment();
        errno = posix_spawn(&mId, arguments.front().c_str(), &files, &attributes, pointersTo(arguments).data(),
                            pointersTo(variables).data());
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
    /// The environment of this process, with huge pages for what the reader allocates: it ends soon, and page faults
    /// are a large part of its time.
    static std::vector<std::string> environment() {
        std::vector<std::string> variables;
        for (char** variable = environ; *variable != nullptr; ++variable) variables.emplace_back(*variable);
        if (std::getenv(kGlibcTunables) == nullptr) variables.emplace_back(kTunablesForHugePages);
        return variables;
    }

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

/// The error if the process ends without an answer. A signal is a sign of damage, an exit status is not.
FileError crashed(const fs::path& path, int status) {
    if (!WIFSIGNALED(status))
        return FileError(
            fmt::format("cannot read '{}': the process that reads it ended without an answer; check the "
                        "file, and the limits of memory and processes (ulimit -a)",
                        path.string()));
    std::string how = "the process that read it crashed";
    if (WTERMSIG(status) == SIGXCPU)
        how = "reading it takes too long";
    else
        how += fmt::format(" (signal {})", WTERMSIG(status));
    return FileError(fmt::format("'{}' is damaged: {}; write or copy it again", path.string(), how));
}

/// Writes everything to a descriptor. Returns whether that was possible.
bool writeAll(int file, const void* data, size_t bytes) {
    const char* from = static_cast<const char*>(data);
    while (bytes > 0) {
        const ssize_t done = ::write(file, from, bytes);
        if (done < 0 && errno == EINTR) continue;
        if (done <= 0) return false;
        from += done;
        bytes -= static_cast<size_t>(done);
    }
    return true;
}

/// In the reader process: reports the end of its parts, or an error instead of them. Returns whether that was possible.
bool answer(PartReader::Header::Kind kind, std::string_view message = {}) {
    const PartReader::Header header{.kind = kind, .size = message.size()};
    return writeAll(kResult, &header, sizeof header) && writeAll(kResult, message.data(), message.size());
}

constexpr std::string_view kNoMemory = "out of memory while reading the file; free some memory";

/// In the reader process: an exception left a destructor or a thread, so memory or threads are short.
[[noreturn]] void answerAndEnd() {
    constexpr auto kind = PartReader::Header::Kind::resourceError;
    if (const std::exception_ptr thrown = std::current_exception()) try {
            std::rethrow_exception(thrown);
        } catch (const std::bad_alloc&) {
            answer(kind, kNoMemory);
        } catch (const std::exception& error) {
            answer(kind, messageOf(error));
        } catch (...) {
        }
    _exit(EXIT_FAILURE);
}

/// The pipe from a reader process that runs.
class ProcessSource final : public PartSource {
  public:
    ProcessSource(const std::string& reader, const fs::path& path, size_t memory, const Monitor& monitor)
        : mPath(path), mMonitor(monitor) {
        std::array<int, 2> ends{-1, -1};
        if (pipe2(ends.data(), O_CLOEXEC) != 0) throw cannotStart("cannot create a pipe");
        mPipe.number = moved(ends[0]);
        const PipeEnd output(moved(ends[1]));
        if (mPipe.number < 0 || output.number < 0) throw cannotStart("cannot create a pipe");
        fcntl(output.number, F_SETPIPE_SZ, 1 << 20); // larger is faster, but the limit may be lower
        mProcess.emplace(std::vector<std::string>{isolatedProgram(), kMode, reader, path.string(),
                                                  std::to_string(memory), std::to_string(secondsFor(path))},
                         output.number);
    }

    void take(void* to, size_t bytes) override {
        char* next = static_cast<char*>(to);
        while (bytes > 0) {
            mMonitor.check();
            pollfd readable{.fd = mPipe.number, .events = POLLIN, .revents = 0};
            if (poll(&readable, 1, 50) <= 0) continue;
            const ssize_t done = ::read(mPipe.number, next, bytes);
            if (done < 0 && errno == EINTR) continue;
            if (done <= 0) throw crashed(mPath, mProcess->wait());
            next += done;
            bytes -= static_cast<size_t>(done);
        }
    }

  private:
    fs::path mPath;
    Monitor mMonitor;
    PipeEnd mPipe{-1};
    std::optional<Process> mProcess; ///< Ends before the pipe is closed.
};

} // namespace

// NOLINTNEXTLINE(readability-make-member-function-const): it writes to the file
void PartWriter::part(const void* data, size_t bytes) {
    const PartReader::Header header{.size = bytes};
    if (!writeAll(mFile, &header, sizeof header) || !writeAll(mFile, data, bytes))
        throw FileError(fmt::format("cannot pass on the data that was read: {}", std::strerror(errno)));
}

/// Takes the next header. Throws the error that it announces.
PartReader::Header PartReader::next() {
    Header header;
    mSource->take(&header, sizeof header);
    if (header.size > mLeft) throw damaged();
    mLeft -= header.size;
    const auto message = [&] {
        constexpr uint64_t longest = 1 << 16;
        std::string text(std::min(header.size, longest), '\0');
        mSource->take(text.data(), text.size());
        return text;
    };
    switch (header.kind) {
        case Header::Kind::valueError:
            throw ValueError(message());
        case Header::Kind::fileError:
            throw FileError(message());
        case Header::Kind::resourceError:
            throw ResourceError(message());
        default:
            return header;
    }
}

size_t PartReader::nextSize() {
    const Header header = next();
    if (header.kind != Header::Kind::part) throw damaged();
    return header.size;
}

/// Asks the system for huge pages: page faults would take a third of the time in which an array is received.
void PartReader::useHugePages(void* memory, size_t bytes) {
    constexpr size_t page = 4096;
    const size_t before = (page - reinterpret_cast<uintptr_t>(memory) % page) % page;
    if (bytes >= before + page)
        madvise(static_cast<char*>(memory) + before, (bytes - before) / page * page, MADV_HUGEPAGE);
}

std::string PartReader::text() {
    const std::vector<char> bytes = array<char>();
    return {bytes.begin(), bytes.end()};
}

void PartReader::finish() {
    if (next().kind != Header::Kind::done) throw damaged();
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
    const size_t memory = availableMemory();
    return {std::make_unique<ProcessSource>(reader, path, memory, monitor), memory, path};
}

bool isIsolatedReader(const std::vector<std::string>& arguments) {
    return arguments.size() == 5 && arguments.front() == kMode;
}

int runIsolatedReader(const std::vector<std::string>& arguments, IsolatedReader (*readerOf)(const std::string& name)) {
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    std::set_terminate(answerAndEnd);
    const auto limit = [](auto what, rlim_t most) {
        const rlimit both{most, most};
        setrlimit(what, &both);
    };
    // Libraries and thread stacks take address space, but hardly any memory.
    constexpr rlim_t addresses = rlim_t{2} << 30;
    limit(RLIMIT_CORE, 0);
    if (!kAddressSanitizer) limit(RLIMIT_AS, std::strtoull(arguments[3].c_str(), nullptr, 10) + addresses);
    // At the first limit the system sends SIGXCPU, which crashed() understands, at the second one SIGKILL.
    const rlim_t seconds = std::strtoull(arguments[4].c_str(), nullptr, 10);
    const rlimit processor{seconds, seconds + 5};
    setrlimit(RLIMIT_CPU, &processor);

    using Kind = PartReader::Header::Kind;
    const auto fail = [](Kind kind, std::string_view message) {
        answer(kind, message);
        return EXIT_FAILURE;
    };
    try {
        const IsolatedReader reader = readerOf(arguments[1]);
        if (!reader) return EXIT_FAILURE;
        PartWriter parts(kResult);
        reader(arguments[2], parts);
        return answer(Kind::done) ? EXIT_SUCCESS : EXIT_FAILURE;
    } catch (const ValueError& error) {
        return fail(Kind::valueError, error.what());
    } catch (const FileError& error) {
        return fail(Kind::fileError, error.what());
    } catch (const ResourceError& error) {
        return fail(Kind::resourceError, error.what());
    } catch (const std::bad_alloc&) {
        return fail(Kind::resourceError, kNoMemory);
    } catch (const std::exception& error) {
        return fail(Kind::fileError, fmt::format("'{}' cannot be read: {}", arguments[2], messageOf(error)));
    }
}

} // namespace curlew
