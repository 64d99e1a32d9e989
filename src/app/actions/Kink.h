// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/app/run/Context.h"

#include <fmt/format.h>

namespace curlew::app {

/// Says that a combination of two fields or shapes has a kink, if its smoothing= is 0.
inline void sayKink(const Context& c, const Arguments& a) {
    if (a.real("smoothing") != 0) return;
    c.info(
        fmt::format("{}: smoothing=0 leaves a kink, at which the velocity of a flow jumps; -check detects it by finite "
                    "differences, not by the trace of the Jacobian",
                    a.action().name));
}

} // namespace curlew::app
