// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/base/Monitor.h"

namespace curlew {

/// Cancels loops of libraries from the functions that they call for each element: every thread asks the monitor at
/// every 2¹⁴th call. The Interrupted that it then throws passes through the library's loop.
class PacedMonitor {
  public:
    explicit PacedMonitor(const Monitor& monitor) : mMonitor(monitor) {}

    void operator()() const {
        thread_local unsigned calls = 0;
        if (++calls % (1u << 14) == 0) mMonitor.check();
    }

  private:
    const Monitor& mMonitor;
};

} // namespace curlew
