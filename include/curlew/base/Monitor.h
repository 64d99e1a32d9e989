// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/base/Error.h"

#include <functional>

namespace curlew {

/// How a long computation speaks with its caller: it reports the fraction done and asks whether to go on. Both
/// functions may be empty. They are called from any thread that takes part in the computation, one at a time for
/// `report`, and must not throw.
struct Monitor {
    std::function<void(double fraction)> report;
    std::function<bool()> cancelled;

    /// Throws Interrupted if the caller has asked to stop.
    void check() const {
        if (cancelled && cancelled()) throw Interrupted();
    }
};

} // namespace curlew
