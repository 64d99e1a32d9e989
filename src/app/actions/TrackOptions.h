#pragma once

#include "curlew/app/registry/Bind.h"
#include "curlew/track/Reproject.h"

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

} // namespace curlew::app
