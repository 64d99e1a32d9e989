// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/flow/Flow.h"
#include "curlew/render/SurfaceView.h"

namespace curlew {

// Textures of surfaces: colours (sRGB display values) at places in space. A texture that a flow has carried along is
// looked up where the flow has brought each hit from: advect(flow, positions, {.time = -t, …}), as ICN §5.3 has it.

std::vector<Vec3d> positionsOf(const SurfaceView& view);

/// Cubes of two colours, of this edge length (world units), their corners at the origin.
Vec3f checkerAt(const Vec3d& position, double edge, const Vec3f& even, const Vec3f& odd);

/// Bands along the y axis of a ball about `center`, the colours of a banded planet from pole to pole, by latitude.
Vec3f latitudeAt(const Vec3d& position, const Vec3d& center);

/// The colours of a landscape, from deep water at 0 over grass and sand to snow at 1 (Catlike Coding, Noise
/// Derivatives).
Vec3f terrainAt(double height);

/// The waves of ICN Fig. 5, in the colours of viridis, around the y axis: stripes of this width (world units) by height
/// plus distance from the axis, with twelve waves to a turn.
Vec3f wavesAt(const Vec3d& position, double width);

struct SurfaceLicOptions {
    double length = 40; ///< Of a streak, pixels of the view at the middle of the surface.
    double grain = 1.6; ///< Of the noise, pixels.
    uint64_t seed = 0;
    double contrast = 0.2; ///< The standard deviation of the result, about its middle, 1/2.
};

/// Line integral convolution on a surface (Cabral and Leedom 1993, with solid noise as Interrante 1997 has it): for
/// each hit, white noise in space, averaged along the streamline through it with a Hann window, by midpoint steps of
/// half a grain. Values in [0, 1]. For a flow along the surface; its sign and speed do not show. The same for any
/// number of threads. Throws ValueError for options that are not positive.
std::vector<float> surfaceLic(const SurfaceView& view, const Flow& flow, const SurfaceLicOptions& options = {},
                              const Monitor& monitor = {});

} // namespace curlew
