// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/base/Monitor.h"
#include "curlew/field/ScalarField.h"
#include "curlew/track/Points.h"

namespace curlew {

struct SnapResult {
    size_t points = 0;
    size_t missed = 0; ///< Points that did not converge; they stay in place.
    double moved = 0;  ///< Mean distance that the other points moved, world units.
};

/// Moves particles onto the level set of a field at `value`, by Newton steps along its gradient (ICN Eq. 12), at most
/// `reach` world units from their start and to within `tolerance` in the value. Clears velocities and tracks. Throws
/// ValueError if `value` is not finite, or `reach` or `tolerance` is not positive.
SnapResult snap(const ScalarField& field, double value, Points& particles, double reach = 1, double tolerance = 1e-9,
                const Monitor& monitor = {});

} // namespace curlew
