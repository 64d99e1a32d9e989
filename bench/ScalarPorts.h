// SPDX-License-Identifier: Apache-2.0
#pragma once

/// Psrd3 with seed 0 (axis grid, no period, no rotation) as a direct port of a shader to C++: one point at a time, in
/// float. The library is compared with it. Written from the steps of Gustavson and McEwan 2021, which
/// include/curlew/noise/Psrd.h describes.
///
/// The ports share only this header with the rest of the program. They are compiled for the processor of the build
/// machine, so they must not emit inline functions of other headers, which the rest might then use.
namespace curlew::ports {

struct Sample {
    float value, gradient[3];
};

/// How a port computes the gradient of a corner.
enum class Gradients {
    computed, ///< With sine, cosine and square root of the C library, for each corner.
    table     ///< From a table of all 289 gradients.
};

template <Gradients G>
Sample noise(const float (&position)[3]);

/// ∇f × ∇g of two noises. The second noise is the first one at position + kSecond.
inline constexpr float kSecond[3] = {31.25F, 17.5F, -11.75F};
template <Gradients G>
void velocity(const float (&position)[3], float (&velocity)[3]);

extern template Sample noise<Gradients::computed>(const float (&)[3]);
extern template Sample noise<Gradients::table>(const float (&)[3]);
extern template void velocity<Gradients::computed>(const float (&)[3], float (&)[3]);
extern template void velocity<Gradients::table>(const float (&)[3], float (&)[3]);

} // namespace curlew::ports
