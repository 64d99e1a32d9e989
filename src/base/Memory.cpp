// SPDX-License-Identifier: Apache-2.0
#include "curlew/base/Memory.h"

#include "curlew/base/Error.h"
#include "curlew/base/HugePages.h"

#include <fmt/format.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <fstream>
#include <limits>

namespace curlew {

namespace {

constexpr size_t kNoLimit = std::numeric_limits<size_t>::max();

size_t systemMemory() {
    std::ifstream stream("/proc/meminfo");
    std::string key;
    size_t kibibytes = 0;
    while (stream >> key >> kibibytes) {
        if (key == "MemAvailable:") return kibibytes * 1024;
        stream.ignore(std::numeric_limits<std::streamsize>::max(), '\n');
    }
    return static_cast<size_t>(sysconf(_SC_AVPHYS_PAGES)) * static_cast<size_t>(sysconf(_SC_PAGESIZE));
}

struct ProcessMemory {
    size_t virtualBytes = 0, residentBytes = 0;

    static ProcessMemory now() {
        std::ifstream stream("/proc/self/statm");
        size_t total = 0, resident = 0;
        stream >> total >> resident;
        const auto page = static_cast<size_t>(sysconf(_SC_PAGESIZE));
        return {total * page, resident * page};
    }
};

/// Returns what remains of the limit on the address space (ulimit -v).
size_t addressSpace() {
    rlimit limit{};
    if (getrlimit(RLIMIT_AS, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY) return kNoLimit;
    return limit.rlim_cur - std::min<size_t>(limit.rlim_cur, ProcessMemory::now().virtualBytes);
}

/// Appends an estimate and the memory in use to the file that CURLEW_MEMORY_TRACE names, for tests/memory/run.py.
void traceEstimate(double bytes, const std::string& what) {
    const char* path = std::getenv("CURLEW_MEMORY_TRACE");
    if (!path) return;
    std::ofstream(path, std::ios::app) << fmt::format("{:.0f}\t{}\t{}\n", bytes, ProcessMemory::now().residentBytes,
                                                      what);
}

} // namespace

size_t availableMemory() {
    return std::min({systemMemory(), controlGroupMemory("/proc/self/cgroup", "/sys/fs/cgroup"), addressSpace()});
}

size_t peakMemory() {
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    return static_cast<size_t>(usage.ru_maxrss) * 1024;
}

std::string formatBytes(double bytes) {
    constexpr std::array units{"B", "KiB", "MiB", "GiB", "TiB", "PiB", "EiB"};
    if (!(bytes < 0x1p70)) return "more than 1024 EiB";
    size_t unit = 0;
    while (bytes >= 1024 && unit + 1 < units.size()) {
        bytes /= 1024;
        ++unit;
    }
    return fmt::format("{:.{}f} {}", bytes, unit == 0 ? 0 : 1, units[unit]);
}

void requireMemory(double bytes, const std::string& what, const std::string& remedy) {
    traceEstimate(bytes, what);
    const auto available = static_cast<double>(availableMemory());
    if (!(bytes <= available))
        throw ResourceError(fmt::format("{} would need about {} of memory, but only {} are available; {}", what,
                                        formatBytes(bytes), formatBytes(available), remedy));
    growHeapInHugePages(bytes);
}

} // namespace curlew
