// SPDX-License-Identifier: Apache-2.0
#pragma once

/// Psrd3 of seed 0 (axis grid, no period, no rotation) as one gets it by carrying a shader over to C++: one point after
/// the other, in float. What the library is compared with. Written from the steps of Gustavson and McEwan 2021; see
/// include/curlew/noise/Psrd.h for what they are.
///
/// This header is all that the ports share with the rest: they are compiled for this machine's processor, and must not
/// leave inline functions of others behind.
namespace curlew::ports {

struct Sample {
    float value, gradient[3];
};

/// How a port gets the gradient of a corner.
enum class Gradients {
    computed, ///< Sine, cosine and square root of the C library, for each corner anew.
    table     ///< From a table of all 289.
};

template <Gradients G>
Sample noise(const float (&position)[3]);

/// ∇f × ∇g of two of them; the second noise is the first one elsewhere, at position + kSecond.
inline constexpr float kSecond[3] = {31.25F, 17.5F, -11.75F};
template <Gradients G>
void velocity(const float (&position)[3], float (&velocity)[3]);

extern template Sample noise<Gradients::computed>(const float (&)[3]);
extern template Sample noise<Gradients::table>(const float (&)[3]);
extern template void velocity<Gradients::computed>(const float (&)[3], float (&)[3]);
extern template void velocity<Gradients::table>(const float (&)[3], float (&)[3]);

} // namespace curlew::ports
