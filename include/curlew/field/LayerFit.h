// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/field/Bound.h"

namespace curlew {

/// How well the layer of a wall fits into an object.
struct LayerFit {
    /// The part of the inside, by volume, where paths inwards end before alpha is 1: the object is thinner than two
    /// layers there.
    double unreached = 0;
    /// The width for which `unreached` would be kMaxUnreached, if it exceeds that; else the wall's width.
    double fitting = 0;
};

/// A fraction that is not worth a warning: corners, and the tips of limbs.
inline constexpr double kMaxUnreached = 0.05;

/// Follows the distance inwards from about 2048 pseudo-random positions inside (the same at every call), until the
/// depth reaches the width or stops rising (at the medial axis). The fraction is accurate to about 1 % of the volume.
/// An object without a finite box fits any layer. Throws ValueError if the width is not positive.
template <int N>
LayerFit layerFit(const WallN<N>& wall);

} // namespace curlew
