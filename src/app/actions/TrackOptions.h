// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/app/registry/Bind.h"
#include "curlew/track/Reproject.h"
#include "curlew/track/Stepper.h"

namespace curlew::app {

/// Binds tolerance=, iterations= and maxSubdivisions=. `waits`: for the help, what waits if halving does not help.
/// `reprojects`: conditions of Option::onlyWith for the first two.
inline Binding<ReprojectionOptions> solverBinding(const ReprojectionOptions& defaults, const std::string& waits,
                                                  const std::vector<std::string>& reprojects = {}) {
    using namespace options;
    return Binding<ReprojectionOptions>(defaults)
        .add(
            onlyWith(reprojects, positive("tolerance", "", "", "tolerance on f and g, relative to their rms values")),
            [](auto& o) -> auto& { return o.tolerance; })
        .add(
            onlyWith(reprojects, integer("iterations", "", 1, 1000, "maximum number of corrections per step")),
            [](auto& o) -> auto& { return o.iterations; })
        .add(
            formerly({"halvings"},
                     integer("maxSubdivisions", "", 0, 20,
                             "maximum number of times that a failing step is halved before the " + waits)),
            [](auto& o) -> auto& { return o.maxSubdivisions; });
}

/// Binds reproject= and the options of solverBinding(). `help`: the help of reproject=.
inline Binding<ReprojectionOptions> reprojectionBinding(const ReprojectionOptions& defaults, const std::string& help,
                                                        const std::string& waits) {
    return Binding<ReprojectionOptions>(defaults)
        .add(
            options::choice("reproject", kReprojectionNames,
                            help + "; newton corrects one potential after the other (ICN Eq. 12), which takes up to "
                                   "twice as long as gauss-newton"),
            [](auto& o) -> auto& { return o.method; })
        .include(
            solverBinding(defaults, waits, {"reproject=gauss-newton", "reproject=newton"}),
            [](auto& o) -> auto& { return o; });
}

/// Binds steps=, scheme= and accuracy= to the members of a struct. `steps` and `accuracy` are help texts.
template <class Struct>
Binding<Struct> stepBinding(const std::string& steps, const std::string& accuracy, const Struct& defaults = {}) {
    using namespace options;
    std::vector<std::string> schemes = namesOf(kSchemeNames);
    schemes.insert(schemes.begin(), "auto");
    return Binding<Struct>(defaults)
        .addOptional(
            integer("steps", "", 1, 1e9, steps), [](auto& o) -> auto& { return o.steps; })
        .add(
            choice("scheme", schemes,
                   "integrator; auto: rk45 if accuracy= chooses the steps, rk4 for equal steps. rk23 "
                   "(Bogacki-Shampine) and rk45 (Dormand-Prince) estimate their errors; the others take equal steps"),
            [](auto& o) -> auto& { return o.scheme; })
        .addOptional(
            positive("accuracy", "", "world units", accuracy), [](auto& o) -> auto& { return o.accuracy; });
}

/// Returns whether only the scheme was given and it has no error estimate, so it must take equal steps.
inline bool asksForEqualSteps(const Arguments& a, const std::optional<Scheme>& scheme) {
    return scheme && !tableauOf(*scheme).embedded() && !a.given("steps") && !a.given("accuracy");
}

} // namespace curlew::app
