// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/resource.h>

namespace curlew {

// Huge pages (2 MiB) make the first use of memory cheaper: in a virtual machine, a new page of 4 KiB can take 10 µs.
// Linux provides them always, never, or to programs that ask for them. glibc asks if an environment variable says so
// when the program starts.

/// The name of that variable.
inline constexpr const char* kGlibcTunables = "GLIBC_TUNABLES";
/// The variable with its value, for the environment of a process.
inline constexpr const char* kTunablesForHugePages = "GLIBC_TUNABLES=glibc.malloc.hugetlb=1";

/// Whether the address space has a limit (ulimit -v), which counts memory that is never used too, so that there is none
/// for huge pages.
inline bool hasLimitedAddressSpace() {
    rlimit limit{};
    return getrlimit(RLIMIT_AS, &limit) != 0 || limit.rlim_cur != RLIM_INFINITY;
}

/// Lets large jobs of this process change how its heap grows. For programs that are alone in their process, in main();
/// the host of a plugin decides about its own heap. src/StartWithHugePages.cpp, linked into such a program, sets the
/// variable.
void allowHugePages();

/// Called before about `bytes` are allocated. If allowHugePages() has been called, and at least 64 MiB are for each
/// thread, the heaps of all threads grow by 64 MiB at a time from now on. Otherwise, glibc's heaps of threads grow by
/// 4 KiB at a time, so they get no huge pages. The system provides only what is used. A thread may use little of its
/// last huge page, so this takes at most a thirty-second more. Does nothing if the address space is limited. Thread
/// safe.
void growHeapInHugePages(double bytes);

} // namespace curlew
