// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/field/ScalarField.h"

#include <functional>

namespace curlew {

/// A function of positions that the caller implements: writes the values and the gradients at `count` positions in N
/// dimensions. positions[k N + axis] is a coordinate of position k, in world units; gradients[k N + axis] is the
/// derivative along that axis. It is called from several threads at a time, with up to 64 positions, and must return
/// the same for the same position. What it throws ends the evaluation.
using FieldCallback = std::function<void(size_t count, const double* positions, double* values, double* gradients)>;

/// Returns a field that calls a function: for functions that are not made of ours. Slower than a model, since nothing
/// is inlined or vectorised; second derivatives are central differences of the gradients, so they have about 8 digits,
/// and each costs 2 N evaluations. (They are needed by -check and jacobian=, not to follow a flow.) There are no third
/// derivatives.
///
/// Compares the gradients with differences of the values at 64 positions in the box. Throws ValueError, naming the
/// worst position, if a value or gradient is not finite, or if the difference does not fall with the step as it does
/// for the gradient of a function with a continuous gradient.
template <int N>
ScalarFieldN<N> callbackField(FieldCallback callback, const BoxN<N>& box = BoxN<N>{}.padded(1));

} // namespace curlew
