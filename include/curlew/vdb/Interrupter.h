// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/base/Monitor.h"

#include <openvdb/Exceptions.h>
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

/// Calls a function of OpenVDB that throws RuntimeError when it is interrupted; throws Interrupted in that case.
template <class Function>
auto interruptible(const Monitor& monitor, const Function& function) {
    try {
        return function();
    } catch (const openvdb::RuntimeError&) {
        monitor.check();
        throw;
    }
}

} // namespace curlew
