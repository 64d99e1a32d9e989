// SPDX-License-Identifier: Apache-2.0
#include "curlew/base/Parallel.h"

#include "curlew/base/Error.h"

#include <tbb/global_control.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>
#include <tbb/task_group.h>

#include <algorithm>
#include <mutex>
#include <new>

namespace curlew {

void startTbb() {
    static const bool started = [] {
        constexpr size_t kRoom = 1 << 20;            // enough at each limit in tests/memory/limits.py
        void* volatile room = ::operator new(kRoom); // volatile: the compiler would leave both calls out
        ::operator delete(room);
        // If this ran out of memory, TBB 2022.1 would wait: its exception takes a lock that it holds while it starts.
        tbb::parallel_for(0, 1, [](int) {});
        return true;
    }();
    static_cast<void>(started);
}

void parallelFor(size_t count, size_t grain, const std::function<void(size_t, size_t)>& body, const Monitor& monitor) {
    grain = std::clamp<size_t>(grain, 1, std::max<size_t>(count, 1));
    const size_t chunks = (count + grain - 1) / grain;
    startTbb();
    std::mutex reporting;
    size_t done = 0;
    tbb::parallel_for(
        tbb::blocked_range<size_t>(0, chunks, 1),
        [&](const tbb::blocked_range<size_t>& range) {
            for (size_t chunk = range.begin(); chunk != range.end(); ++chunk) {
                monitor.check();
                body(chunk * grain, std::min(count, (chunk + 1) * grain));
                if (!monitor.report) continue;
                const std::lock_guard lock(reporting);
                monitor.report(static_cast<double>(++done) / static_cast<double>(chunks));
            }
        },
        tbb::simple_partitioner());
    // Within a loop that is cancelled, TBB leaves this one unfinished, without an exception.
    if (tbb::is_current_task_group_canceling()) throw Interrupted();
}

void isolated(const std::function<void()>& work) {
    startTbb();
    tbb::this_task_arena::isolate(work);
}

struct Background::Implementation {
    tbb::task_group tasks;
};

Background::Background() {
    startTbb();
    mImplementation = std::make_unique<Implementation>();
}

Background::~Background() { wait(); }

void Background::run(const std::function<void()>& work) {
    wait();
    mImplementation->tasks.run(work);
}

void Background::wait() { mImplementation->tasks.wait(); }

struct ThreadLimit::Implementation {
    explicit Implementation(size_t threads) : control(tbb::global_control::max_allowed_parallelism, threads) {}
    tbb::global_control control;
};

ThreadLimit::ThreadLimit(int threads) {
    startTbb();
    const int limit = threads > 0 ? threads : tbb::this_task_arena::max_concurrency();
    mImplementation = std::make_unique<Implementation>(static_cast<size_t>(limit));
}

ThreadLimit::~ThreadLimit() = default;

} // namespace curlew
