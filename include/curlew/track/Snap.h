// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/base/Monitor.h"
#include "curlew/field/ScalarField.h"
#include "curlew/track/Points.h"

namespace curlew {

struct SnapResult {
    size_t points = 0;
    size_t missed = 0; ///< Those that did not get there; they stay where they were.
    double moved = 0;  ///< How far the others went, world units, in the mean.
};

/// Moves particles to where a field has a value, by Newton steps along its gradient (ICN Eq. 12) of at most `reach`
/// world units together, to within `tolerance` in the value. Velocities and tracks are forgotten. Throws ValueError for
/// a value that is not finite, and a reach or tolerance that is not positive.
SnapResult snap(const ScalarField& field, double value, Points& particles, double reach = 1, double tolerance = 1e-9,
                const Monitor& monitor = {});

} // namespace curlew
