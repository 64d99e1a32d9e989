// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/track/Advect.h"

namespace curlew::detail {

/// Returns the options with the default accuracy filled in if the steps are adaptive.
template <int N>
AdvectOptions withAccuracy(AdvectOptions options, const DomainN<N>& domain) {
    if (options.adaptive() && options.accuracy == 0) options.accuracy = defaultAccuracy(domain);
    return options;
}

/// Returns the options with the default scheme filled in, for a flow that is not split.
template <int N>
AdvectOptions withScheme(AdvectOptions options, const DomainN<N>& domain) {
    const bool coarse = options.adaptive() && options.accuracy >= kCoarseAccuracy * length(domain.box.size());
    if (!options.scheme && coarse) options.scheme = Scheme::bogackiShampine;
    return options;
}

/// Returns the options for one of `count` equal parts of the time: a single step, or adaptive steps with their
/// accuracy, which must be set.
inline AdvectOptions oneOf(int count, AdvectOptions options) {
    options.time /= count;
    options.steps = 1;
    return options;
}

/// What advect() measures of a flow, once for all steps.
template <int N>
struct AdvectScalesN {
    FlowRmsN<N> flow;
    std::vector<FlowRmsN<N>> terms; ///< For each term by itself, if the flow is split.
};
using AdvectScales = AdvectScalesN<3>;

template <int N>
AdvectScalesN<N> scalesOf(const FlowN<N>& flow, const AdvectOptions& options, const Monitor& monitor = {});

/// advect() in a flow whose scales are already measured, for callers that take it step by step.
AdvectResult advectKnowing(const Flow& flow, const AdvectScales& scales, Points& particles,
                           const AdvectOptions& options, const Monitor& monitor);

} // namespace curlew::detail
