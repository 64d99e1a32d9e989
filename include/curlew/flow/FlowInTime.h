// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/flow/Flow.h"

#include <functional>
#include <utility>

namespace curlew {

/// A flow that may change with time: at(t) returns the flow at t seconds, frozen. Not safe to call from several threads
/// at once.
class FlowInTime {
  public:
    /// A steady flow.
    FlowInTime(Flow flow) : mSteady(true), mAt([flow = std::move(flow)](double) { return flow; }) {} // NOLINT
    explicit FlowInTime(std::function<Flow(double time)> at) : mAt(std::move(at)) {}

    bool steady() const { return mSteady; }
    Flow at(double time) const { return mAt(time); }

  private:
    bool mSteady = false;
    std::function<Flow(double time)> mAt;
};

} // namespace curlew
