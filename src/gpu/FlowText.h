// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "Vulkan.h"
#include "curlew/gpu/GpuFlow.h"

#include <deque>

namespace curlew {

/// A flow's functions in GLSL, and the data that they read, on a GPU.
template <int N>
struct FlowText {
    FlowText(Gpu::Vulkan& gpu, const FlowN<N>& flow, ShaderCoordinates coordinates, const Monitor& monitor);

    /// Positions are relative to it.
    Vec<double, N> origin;
    bool hasTracks, hasWall;
    FlowRmsN<N> rms; ///< If the flow has tracks.
    std::string text;
    std::deque<GpuBuffer> data; ///< Bound from kFirstData on.

    static constexpr unsigned kFirstData = 2; ///< Bindings 0 and 1 are those of the programs that use the flow.

    /// Returns a whole program: definitions of the number of dimensions, the flow, and the rest of the text.
    std::string program(const std::string& definitions, const std::string& rest) const;
    /// Returns these two buffers and those of the flow.
    std::vector<const GpuBuffer*> buffers(const GpuBuffer& first, const GpuBuffer& second) const;
};

} // namespace curlew
