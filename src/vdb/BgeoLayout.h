// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

/// The constants of classic .bgeo files.
namespace curlew::bgeo {

constexpr int32_t kVersion = 5;

/// Types of attributes. Integers, floats, vectors and indices have 4 bytes per component.
constexpr int32_t kFloat = 0, kInteger = 1, kString = 2, kMixed = 3, kIndex = 4, kVector = 5;

/// Types of primitives. A run is followed by a 16-bit count and the type of that many primitives.
constexpr int32_t kRun = -1, kPolygon = 1, kParticles = 0x8000;

constexpr char kClosed = '<', kOpen = ':';

/// Returns whether the indices of points have 32 bits instead of 16.
constexpr bool hasWideIndices(size_t points) { return points > 0xffff; }

} // namespace curlew::bgeo
