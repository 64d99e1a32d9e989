// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/field/Bound.h"

namespace curlew {

/// Whether the layer of a wall fits the inside of an object.
struct LayerFit {
    double unreached = 0; ///< The part of the inside, by volume, from which the way deeper into the object ends before
                          ///< alpha is 1: there the object is thinner than twice the layer.
    double fitting = 0;   ///< A width for which that is kMostUnreached, if it is more; else the wall's width.
};

/// What is not worth a warning: corners, and the tips of limbs.
inline constexpr double kMostUnreached = 0.05;

/// Follows the distance inwards from up to 2048 pseudo-random positions inside (the same at every call), until it
/// reaches the width or rises no more (the medial axis): so the figure is within about 1 % of the volume. An object
/// without a finite box fits everything. Throws ValueError for a width that is not positive.
template <int N>
LayerFit layerFit(const WallN<N>& wall);

} // namespace curlew
