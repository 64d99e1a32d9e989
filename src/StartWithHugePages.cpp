// SPDX-License-Identifier: Apache-2.0
// Part of the programs that are alone in their process, not of the library: starts them again with an environment in
// which glibc takes huge pages.
#include "curlew/base/HugePages.h"
#include "curlew/base/Sanitizer.h"

#include <fcntl.h>
#include <sys/auxv.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <string_view>

#if defined(__GLIBC__)

namespace {

using namespace curlew;

bool contains(char* const* environment, std::string_view variable) {
    for (; *environment != nullptr; ++environment) {
        const std::string_view one = *environment;
        if (one.starts_with(variable) && one.substr(variable.size()).starts_with('=')) return true;
    }
    return false;
}

/// Whether the kernel provides huge pages to programs that ask for them, and only to these.
bool mustAsk() {
    std::array<char, 64> setting{};
    const int file = open("/sys/kernel/mm/transparent_hugepage/enabled", O_RDONLY | O_CLOEXEC);
    if (file < 0) return false;
    const ssize_t size = read(file, setting.data(), setting.size());
    close(file);
    return size > 0 &&
           std::string_view(setting.data(), static_cast<size_t>(size)).find("[madvise]") != std::string_view::npos;
}

/// Whether this is the program that the system has started, with these arguments. Otherwise, that was the dynamic
/// linker, or a tool that preloads a library (Valgrind, another allocator) would lose the program.
bool isStartedProgram(char* const* environment) {
    return getauxval(AT_BASE) != 0 && getauxval(AT_SECURE) == 0 && !contains(environment, "LD_PRELOAD");
}

void startWithHugePages(int count, char** arguments, char** environment) {
    const bool mayBeLarge = count > 2; // not -help or -version
    if (kAddressSanitizer || kThreadSanitizer || !mayBeLarge || contains(environment, kGlibcTunables) ||
        hasLimitedAddressSpace() || !isStartedProgram(environment) || !mustAsk())
        return;
    size_t variables = 0;
    while (environment[variables] != nullptr) ++variables;
    auto** const extended = static_cast<char**>(std::calloc(variables + 2, sizeof(char*)));
    if (extended == nullptr) return;
    std::copy_n(environment, variables, extended);
    extended[variables] = const_cast<char*>(kTunablesForHugePages);                  // execve() changes nothing
    const auto* const program = reinterpret_cast<const char*>(getauxval(AT_EXECFN)); // NOLINT: it is a pointer
    execve(program, arguments, extended);
    std::free(extended); // it cannot be started again, and goes on
}

/// Called before libraries are initialised, so that they are initialised once.
[[gnu::section(".preinit_array"), gnu::used]] void (*const kBeginning)(int, char**, char**) = startWithHugePages;

} // namespace

#endif
