// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/flow/Flow.h"

#include <functional>
#include <utility>

namespace curlew {

/// A flow that may change with time: at(t) is the flow as it stands at t seconds, frozen. Calls from one thread at a
/// time.
class FlowInTime {
  public:
    /// One that does not change.
    FlowInTime(Flow flow) : mSteady(true), mAt([flow = std::move(flow)](double) { return flow; }) {} // NOLINT
    explicit FlowInTime(std::function<Flow(double time)> at) : mAt(std::move(at)) {}

    bool steady() const { return mSteady; }
    Flow at(double time) const { return mAt(time); }

  private:
    bool mSteady = false;
    std::function<Flow(double time)> mAt;
};

} // namespace curlew
