// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/base/Monitor.h"

#include <openvdb/util/NullInterrupter.h>

namespace curlew {

/// A Monitor in the shape in which OpenVDB's tools take it.
class Interrupter final : public openvdb::util::NullInterrupter {
  public:
    explicit Interrupter(const Monitor& monitor) : mMonitor(monitor) {}
    bool wasInterrupted(int percent = -1) override {
        if (percent >= 0 && mMonitor.report) mMonitor.report(percent / 100.0);
        return mMonitor.cancelled && mMonitor.cancelled();
    }

  private:
    const Monitor& mMonitor;
};

} // namespace curlew
