// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/base/Error.h"

#include <functional>

namespace curlew {

/// Callbacks of a long computation: `report` receives the fraction done, and `cancelled` returns whether to stop.
/// Either may be empty. Neither may throw. Any thread of the computation may call them; calls of `report` never
/// overlap.
struct Monitor {
    std::function<void(double fraction)> report;
    std::function<bool()> cancelled;

    /// Throws Interrupted if the caller has asked to stop.
    void check() const {
        if (cancelled && cancelled()) throw Interrupted();
    }
    /// Returns a monitor for a part of the work, which can be cancelled but reports no progress.
    Monitor quiet() const { return {.report = {}, .cancelled = cancelled}; }
};

} // namespace curlew
