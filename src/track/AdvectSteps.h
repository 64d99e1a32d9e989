// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/track/Advect.h"

namespace curlew::detail {

/// The options with the accuracy that they stand for, where it rules the steps.
template <int N>
AdvectOptions withAccuracy(AdvectOptions options, const DomainN<N>& domain) {
    if (options.adaptive() && options.accuracy == 0) options.accuracy = defaultAccuracy(domain);
    return options;
}

/// The options with the scheme that they stand for, for a flow that is followed as a whole.
template <int N>
AdvectOptions withScheme(AdvectOptions options, const DomainN<N>& domain) {
    const bool coarse = options.adaptive() && options.accuracy >= kCoarseAccuracy * length(domain.box.size());
    if (!options.scheme && coarse) options.scheme = Scheme::bogackiShampine;
    return options;
}

/// The options for one of `count` equal parts of the time: one step, or as many as their accuracy (which is known) asks
/// for.
inline AdvectOptions oneOf(int count, AdvectOptions options) {
    options.time /= count;
    options.steps = 1;
    return options;
}

/// What advect() measures of a flow, once for all of its steps.
template <int N>
struct AdvectScalesN {
    FlowMagnitudesN<N> flow;
    std::vector<FlowMagnitudesN<N>> terms; ///< Of each term by itself, if the flow is split.
};
using AdvectScales = AdvectScalesN<3>;

template <int N>
AdvectScalesN<N> scalesOf(const FlowN<N>& flow, const AdvectOptions& options, const Monitor& monitor = {});

/// advect() in a flow that has been measured: for those who take it step by step.
AdvectResult advectKnowing(const Flow& flow, const AdvectScales& scales, Points& particles,
                           const AdvectOptions& options, const Monitor& monitor);

} // namespace curlew::detail
