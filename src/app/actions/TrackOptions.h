// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/app/registry/Bind.h"
#include "curlew/track/Reproject.h"
#include "curlew/track/Stepper.h"

namespace curlew::app {

/// tolerance=, iterations= and halvings=. `waits`: what waits if halving does not help.
inline Binding<ReprojectionOptions> solverBinding(const ReprojectionOptions& defaults, const std::string& waits) {
    using namespace options;
    Option tolerance = positive("tolerance", "", "", "on f and g, relative to their root mean squares");
    return Binding<ReprojectionOptions>(defaults)
        .add(
            tolerance, [](auto& o) -> auto& { return o.tolerance; })
        .add(
            integer("iterations", "", 1, 1000, "most corrections a step"),
            [](auto& o) -> auto& { return o.iterations; })
        .add(
            integer("halvings", "", 0, 20, "how often a failing step is halved before the " + waits),
            [](auto& o) -> auto& { return o.maxSubdivisions; });
}

/// reproject= and these. `help`: what is kept on its track.
inline Binding<ReprojectionOptions> reprojectionBinding(const ReprojectionOptions& defaults, const std::string& help,
                                                        const std::string& waits) {
    return Binding<ReprojectionOptions>(defaults)
        .add(
            options::choice("reproject", kReprojectionNames, help), [](auto& o) -> auto& { return o.method; })
        .include(
            solverBinding(defaults, waits), [](auto& o) -> auto& { return o; });
}

/// steps=, scheme= and accuracy= of a struct that has these members. `steps` and `accuracy`: help.
template <class Struct>
Binding<Struct> stepBinding(const std::string& steps, const std::string& accuracy, const Struct& defaults = {}) {
    using namespace options;
    std::vector<std::string> schemes = namesOf(kSchemeNames);
    schemes.insert(schemes.begin(), "auto");
    return Binding<Struct>(defaults)
        .addOptional(
            integer("steps", "", 1, 1e9, steps), [](auto& o) -> auto& { return o.steps; })
        .add(
            choice(
                "scheme", schemes,
                "integrator; auto: rk45 where accuracy= rules, rk4 for equal steps. rk23 (Bogacki-Shampine) and rk45 "
                "(Dormand-Prince) estimate their errors; the others take equal steps"),
            [](auto& o) -> auto& { return o.scheme; })
        .addOptional(
            positive("accuracy", "", "world units", accuracy), [](auto& o) -> auto& { return o.accuracy; });
}

/// Whether only the scheme has been chosen, and it has to take equal steps.
inline bool asksForEqualSteps(const Arguments& a, const std::optional<Scheme>& scheme) {
    return scheme && !tableauOf(*scheme).embedded() && !a.given("steps") && !a.given("accuracy");
}

} // namespace curlew::app
