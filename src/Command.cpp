// SPDX-License-Identifier: Apache-2.0
#include "Command.h"

#include "curlew/app/actions/Actions.h"
#include "curlew/app/run/IsolatedFiles.h"
#include "curlew/app/run/Session.h"
#include "curlew/base/AtomicFile.h"
#include "curlew/base/HugePages.h"
#include "curlew/base/LibraryError.h"
#include "curlew/base/Parallel.h"
#include "curlew/base/Simd.h"
#include "curlew/base/Text.h"
#include "curlew/vdb/Openvdb.h"

#include <fcntl.h>
#include <sys/time.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <initializer_list>
#include <new>

namespace {

volatile std::sig_atomic_t interrupted = 0; ///< The signal that asked the program to stop.

constexpr const char* kInterrupted = "interrupted; unfinished files have been removed";

/// Ends the process at once, after removing its unfinished files. Safe in a signal handler.
[[noreturn]] void endNow(std::initializer_list<const char*> message, int status) {
    curlew::removeUnfinishedFiles();
    for (const char* part : message)
        if (::write(STDERR_FILENO, part, std::strlen(part)) < 0) break;
    ::_exit(status);
}

/// Returns the exit status that shells and render farms give to a program that a signal has ended.
int interruptedStatus() { return 128 + interrupted; }

void endInterrupted(int) { endNow({"curlew: ", kInterrupted, "\n"}, interruptedStatus()); }

/// The first Ctrl-C asks the program to stop and clean up; the next one terminates it immediately. If a library is busy
/// (OpenVDB writes, Embree builds a tree) and does not ask whether to stop, the process ends after 0.4 s.
void onInterrupt(int signal) {
    interrupted = signal;
    std::signal(signal, endInterrupted);
    itimerval grace{};
    grace.it_value.tv_usec = 400'000;
    ::setitimer(ITIMER_REAL, &grace, nullptr);
}

constexpr const char* kNoMemory = "out of memory; use larger voxels or fewer points";

/// Called where an exception cannot be passed on: when a destructor in OpenVDB runs out of memory, for example.
[[noreturn]] void onTerminate() {
    if (const std::exception_ptr thrown = std::current_exception()) try {
            std::rethrow_exception(thrown);
        } catch (const std::bad_alloc&) {
        } catch (const std::exception& error) {
            endNow({"curlew: ", curlew::messageOf(error).c_str(), "\n"}, EXIT_FAILURE);
        } catch (...) {
        }
    endNow({"curlew: ", kNoMemory, "\n"}, EXIT_FAILURE);
}

/// Installs a handler, unless the caller has the signal ignored (nohup).
void handle(int signal, void (*handler)(int)) {
    if (std::signal(signal, handler) == SIG_IGN) std::signal(signal, SIG_IGN);
}

/// Prints the message on one line, whatever characters the names in it contain.
int fail(std::string message, int status) {
    constexpr size_t kLongest = 2000;
    message = curlew::printable(message);
    if (message.size() > kLongest) message.replace(kLongest, std::string::npos, " …");
    std::fputs(("curlew: " + message + "\n").c_str(), stderr);
    return status;
}

/// Prevents a file that is opened later from taking the place of a standard stream that the caller has closed.
void occupyStandardStreams() {
    for (int stream = 0; stream <= 2; ++stream)
        if (fcntl(stream, F_GETFD) == -1) open("/dev/null", O_RDONLY);
}

/// Returns whether a file is written to the standard output, which must then contain nothing else.
bool writesToOutput(const curlew::app::Graph& graph) {
    const std::vector<std::string> names{"-", "/dev/stdout", "/dev/fd/1", "/proc/self/fd/1"};
    return std::any_of(graph.nodes.begin(), graph.nodes.end(), [&](const curlew::app::Node& node) {
        const curlew::app::Action& action = node.action();
        std::vector<std::string> written;
        if (action.files)
            written = action.files(node.arguments).written;
        else if (action.holds)
            written = node.arguments.words();
        return std::find_first_of(written.begin(), written.end(), names.begin(), names.end()) != written.end();
    });
}

} // namespace

int curlew_command(int argc, char** argv) {
    using namespace curlew;
#if defined(__x86_64__)
    if (!__builtin_cpu_supports("avx2") || !__builtin_cpu_supports("fma"))
        return fail("this build needs a processor with AVX2 and FMA", EXIT_FAILURE);
#endif
    allowHugePages();
    std::signal(SIGINT, onInterrupt);
    std::signal(SIGTERM, onInterrupt);
    std::signal(SIGALRM, endInterrupted);
    handle(SIGHUP, onInterrupt);
    std::set_terminate(onTerminate);
    std::signal(SIGPIPE, SIG_IGN); // a reader that closes the pipe does not end the work
    std::signal(SIGXFSZ, SIG_IGN); // exceeding the file size limit is an error like a full disk
    occupyStandardStreams();
    try {
        activeSimd(); // reports an invalid CURLEW_SIMD before any work
        startTbb();
        openvdb::initialize();
        const std::vector<std::string> tokens(argv + 1, argv + argc);
        if (isIsolatedReader(tokens)) return runIsolatedReader(tokens, app::isolatedReaderOf);
        app::Console console([] { return interrupted != 0; });
        app::Session session(console, /*keeps=*/false);
        app::Graph graph = app::graphOfCommandLine(tokens.empty() ? std::vector<std::string>{"-help"} : tokens,
                                                   {.registry = app::registry(), .world = session.world()});
        if (writesToOutput(graph)) console.printAsMessages();
        session.run(std::move(graph));
        return EXIT_SUCCESS;
    } catch (const Interrupted&) {
        return fail(kInterrupted, interruptedStatus());
    } catch (const std::bad_alloc&) {
        return fail(kNoMemory, EXIT_FAILURE);
    } catch (const std::exception& e) {
        return fail(messageOf(e), EXIT_FAILURE);
    }
}
