// SPDX-License-Identifier: Apache-2.0
#include "curlew/base/HugePages.h"

#include <malloc.h>
#include <tbb/global_control.h>

#include <atomic>
#include <cstddef>

namespace curlew {

namespace {

constexpr int kGrowth = 64 << 20; ///< The size of a thread's heap in glibc (HEAP_MAX_SIZE).

std::atomic<bool> allowed = false;

} // namespace

void allowHugePages() { allowed = true; }

void growHeapInHugePages(double bytes) {
    if (!allowed) return;
    const size_t threads = tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism);
    if (!(bytes >= double{kGrowth} * static_cast<double>(threads)) || hasLimitedAddressSpace()) return;
    mallopt(M_TOP_PAD, kGrowth);
    // The first call ends glibc's own choice of this threshold, which rises to this at most.
    mallopt(M_MMAP_THRESHOLD, kGrowth / 2);
}

} // namespace curlew
