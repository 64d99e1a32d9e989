#pragma once

#include "curlew/base/Monitor.h"

#include <cstddef>
#include <functional>
#include <memory>

namespace curlew {

/// Calls `body(begin, end)` for chunks of at most `grain` indices that together cover [0, count), on all threads.
/// The chunks are the same for any number of threads. `monitor` is served between chunks; an exception in the body, or
/// a cancelled monitor (Interrupted), ends the loop and reaches the caller.
void parallelFor(size_t count, size_t grain, const std::function<void(size_t begin, size_t end)>& body,
                 const Monitor& monitor = {});

/// Sums `body(begin, end)` over the chunks of parallelFor, in the order of the chunks: the same bits for any number of
/// threads.
double parallelSum(size_t count, size_t grain, const std::function<double(size_t begin, size_t end)>& body,
                   const Monitor& monitor = {});

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
