// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/base/Monitor.h"

#include <algorithm>
#include <cstddef>
#include <functional>
#include <memory>
#include <vector>

namespace curlew {

/// Calls `body(begin, end)` for chunks of at most `grain` indices that together cover [0, count), on all threads.
/// The chunks are the same for any number of threads. `monitor` is served between chunks; an exception in the body, or
/// a cancelled monitor (Interrupted), ends the loop and reaches the caller.
void parallelFor(size_t count, size_t grain, const std::function<void(size_t begin, size_t end)>& body,
                 const Monitor& monitor = {});

/// Sums `body(begin, end)` over the chunks of parallelFor, in the order of the chunks: the same bits for any number of
/// threads. What it sums is anything that T{} += adds up: numbers, or what several sums are kept in.
template <class Body>
auto parallelSum(size_t count, size_t grain, const Body& body, const Monitor& monitor = {}) {
    using T = decltype(body(size_t{}, size_t{}));
    grain = std::clamp<size_t>(grain, 1, std::max<size_t>(count, 1));
    std::vector<T> sums((count + grain - 1) / grain);
    parallelFor(
        count, grain, [&](size_t begin, size_t end) { sums[begin / grain] = body(begin, end); }, monitor);
    T total{};
    for (const T& sum : sums) total += sum;
    return total;
}

/// One piece of work at a time beside the caller's, on another thread where there is one. Waits at its end.
class Background {
  public:
    Background();
    ~Background();
    Background(const Background&) = delete;
    Background& operator=(const Background&) = delete;

    /// Begins it, after wait(). It must not throw.
    void run(const std::function<void()>& work);
    /// Until it is done; does it itself if no thread has begun it.
    void wait();

  private:
    struct Implementation;
    std::unique_ptr<Implementation> mImplementation;
};

/// While it lives, parallel loops (ours and OpenVDB's) use at most this many threads; 0 means one per processor.
class ThreadLimit {
  public:
    explicit ThreadLimit(int threads);
    ~ThreadLimit();
    ThreadLimit(const ThreadLimit&) = delete;
    ThreadLimit& operator=(const ThreadLimit&) = delete;

  private:
    struct Implementation;
    std::unique_ptr<Implementation> mImplementation;
};

} // namespace curlew
