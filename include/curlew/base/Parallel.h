// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/base/Monitor.h"

#include <algorithm>
#include <cstddef>
#include <functional>
#include <memory>
#include <vector>

namespace curlew {

/// Starts TBB if it has not started. Everything here does so; call it before the first use of TBB or of OpenVDB's tools
/// alone. Throws std::bad_alloc if there is too little memory, where TBB 2022.1 would wait forever. Thread safe.
void startTbb();

/// Calls `body(begin, end)` on all threads for chunks of at most `grain` indices that together cover [0, count). The
/// chunks do not depend on the number of threads. `monitor` is called between chunks. An exception in the body or a
/// cancelled monitor (Interrupted) ends the loop and is passed on to the caller.
void parallelFor(size_t count, size_t grain, const std::function<void(size_t begin, size_t end)>& body,
                 const Monitor& monitor = {});

/// Sums `body(begin, end)` over the chunks of parallelFor, in the order of the chunks, so any number of threads gives
/// the same bits. The body returns any type that has T{} and +=: a number, or a struct of several sums.
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

/// Calls `work`. If it waits for other threads, the calling thread takes no work of the loops around it meanwhile,
/// which might need a lock that the caller holds. Call functions of others in this way.
void isolated(const std::function<void()>& work);

/// Runs one piece of work at a time in parallel with the caller, on another thread if one is available. The destructor
/// waits for it.
class Background {
  public:
    Background();
    ~Background();
    Background(const Background&) = delete;
    Background& operator=(const Background&) = delete;

    /// Waits for the previous work, then starts this one. `work` must not throw.
    void run(const std::function<void()>& work);
    /// Waits until the work is done. Runs it on the calling thread if no other thread has started it.
    void wait();

  private:
    struct Implementation;
    std::unique_ptr<Implementation> mImplementation;
};

/// Limits parallel loops (ours and OpenVDB's) to this number of threads during its lifetime. 0 means one thread per
/// processor.
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
