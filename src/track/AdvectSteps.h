// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/track/Advect.h"

namespace curlew::detail {

/// Throws ValueError if advect() does not accept the options for the flow.
template <int N>
void validate(const FlowN<N>& flow, const AdvectOptions& options);

/// Returns the options with the default accuracy filled in if the steps are adaptive.
template <int N>
AdvectOptions withAccuracy(AdvectOptions options, const DomainN<N>& domain) {
    if (options.adaptive() && options.accuracy == 0) options.accuracy = defaultAccuracy(domain);
    return options;
}

/// Returns whether the steps are adaptive and their accuracy is coarse.
template <int N>
bool isCoarse(const AdvectOptions& options, const DomainN<N>& domain) {
    return options.adaptive() && options.accuracy >= kCoarseAccuracy * length(domain.box.size());
}

/// Returns the options with the default scheme filled in, for a flow that is not split.
template <int N>
AdvectOptions withScheme(AdvectOptions options, const DomainN<N>& domain) {
    if (!options.scheme && isCoarse(options, domain)) options.scheme = Scheme::bogackiShampine;
    return options;
}

/// Returns the options for one of `count` equal parts of the time: a single step, or adaptive steps with their
/// accuracy, which must be set.
inline AdvectOptions oneOf(int count, AdvectOptions options) {
    options.time /= count;
    options.steps = 1;
    return options;
}

/// Moves the newborn particles near a moving wall from where they are beside it at the end of the time to the same
/// place beside it at the beginning (AdvectOptions::byAge). Returns how many of them the wall ran over.
size_t takeNewbornBack(const FlowInTime& flow, Points& particles, double begin, const AdvectOptions& options,
                       const Monitor& monitor);

/// advect() for a part of the time: `options` describe the part, and `wholeTime` is what a newborn particle's age is
/// compared with (AdvectOptions::byAge).
AdvectResult advectPart(const FlowInTime& flow, Points& particles, double begin, const AdvectOptions& options,
                        double wholeTime, const Monitor& monitor);

/// advect() with the rms values of another moment of the flow.
AdvectResult advectKnowing(const Flow& flow, const FlowRms& rms, Points& particles, const AdvectOptions& options,
                           const Monitor& monitor);

} // namespace curlew::detail
