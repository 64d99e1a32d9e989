#include "curlew/app/Program.h"
#include "curlew/app/Registry.h"

#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <new>

namespace {

volatile std::sig_atomic_t interrupted = 0;

/// The first Ctrl-C asks the program to stop and clean up; the next one ends it at once.
void onInterrupt(int signal) {
    interrupted = 1;
    std::signal(signal, SIG_DFL);
}

int fail(const char* message, int status) {
    fmt::print(stderr, "curlew: {}\n", message);
    return status;
}

} // namespace

int main(int argc, char** argv) {
    using namespace curlew;
#if defined(__x86_64__)
    if (!__builtin_cpu_supports("avx2") || !__builtin_cpu_supports("fma"))
        return fail("this processor lacks AVX2 and FMA, which this build needs", EXIT_FAILURE);
#endif
    std::signal(SIGINT, onInterrupt);
    std::signal(SIGTERM, onInterrupt);
    try {
        openvdb::initialize();
        const std::vector<std::string> tokens(argv + 1, argv + argc);
        app::Console console([] { return interrupted != 0; });
        app::Session session(console);
        app::run(app::parseCommandLine(tokens.empty() ? std::vector<std::string>{"-help"} : tokens), session);
        return std::fflush(stdout) == 0 ? EXIT_SUCCESS : fail("cannot write to the standard output", EXIT_FAILURE);
    } catch (const Interrupted&) {
        return fail("interrupted; files that were not finished have been removed", 130);
    } catch (const std::bad_alloc&) {
        return fail("out of memory; use larger voxels, or fewer points", EXIT_FAILURE);
    } catch (const std::exception& e) {
        return fail(e.what(), EXIT_FAILURE);
    }
}
