// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/flow/Flow.h"

#include <string>

namespace curlew {

struct FlowPageOptions {
    std::string title;   ///< Of the page.
    std::string command; ///< That made the flow; shown in the page.
    /// The surface of the wall as triangles, for the eye only: positions in world units, and three indices for each
    /// triangle, counter-clockwise as seen from outside. May be empty. Only in 3D.
    std::vector<Vec<float, 3>> points = {};
    std::vector<uint32_t> corners = {};
};

/// Returns an HTML document that shows a flow in two or three dimensions in a browser with WebGPU or WebGL 2: particles
/// that move by the functions of flowShader() on their tracks, streamlines and the wall. It needs no other file and no
/// network.
///
/// The coefficients of level sets are rounded to 65,536 values between the smallest and the largest. Moves the flow as
/// it is at this moment. Throws ValueError if the flow does not move, if its domain is infinite, if its level sets have
/// more than 8,388,608 coefficients, or as flowShader() does.
template <int N>
std::string flowPage(const FlowN<N>& flow, const FlowPageOptions& options, const Monitor& monitor = {});

} // namespace curlew
