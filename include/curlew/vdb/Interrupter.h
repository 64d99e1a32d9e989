// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/base/Monitor.h"

#include <openvdb/util/NullInterrupter.h>

namespace curlew {

/// Adapts a Monitor to the interrupter interface of OpenVDB's tools.
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
