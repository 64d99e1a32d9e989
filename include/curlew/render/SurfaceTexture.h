// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/flow/Flow.h"
#include "curlew/render/SurfaceView.h"

#include <optional>

namespace curlew {

// Surface textures: colours (sRGB display values) as functions of the position. An advected texture is looked up at the
// position from which the flow has carried each hit: advect(flow, positions, {.time = -t, …}), as in ICN §5.3.

std::vector<Vec3d> positionsOf(const SurfaceView& view);

/// Returns the colour of a 3D checker of cubes with this edge length (world units) and a corner at the origin.
Vec3f checkerAt(const Vec3d& position, double edge, const Vec3f& even, const Vec3f& odd);

/// Returns the colours of a banded planet around `center` by latitude, with poles along the y axis.
Vec3f latitudeAt(const Vec3d& position, const Vec3d& center);

/// Returns the colour of a landscape at a height, from deep water at 0 over grass and sand to snow at 1 (Catlike
/// Coding, Noise Derivatives).
Vec3f terrainAt(double height);

/// Returns the waves of ICN Fig. 5, in the colours of viridis, around the y axis: stripes of this width (world units)
/// by the sum of the height and the distance from the axis, with twelve waves per turn. kNoValueColor (ColorMap.h) if
/// a coordinate is not finite.
Vec3f wavesAt(const Vec3d& position, double width);

/// Mean and standard deviation of the streaks' values before their contrast is set.
struct LicRange {
    double mean, deviation;
};

struct SurfaceLicOptions {
    double length = 40; ///< Streak length, pixels of the view at the middle of the surface.
    double grain = 1.6; ///< Grain size of the noise, pixels.
    uint64_t seed = 0;
    double contrast = 0.2;              ///< Standard deviation of the result about its mean, 1/2.
    std::optional<LicRange> range = {}; ///< Default: that of the view's hits.
};

/// Line integral convolution on a surface (Cabral and Leedom 1993, with solid noise as in Interrante 1997). For each
/// hit, averages white noise in space along the streamline through it, with a Hann window and midpoint steps of 3/4 of
/// a grain. Values are in [0, 1]. The flow should be tangent to the surface; its sign and speed do not matter. The same
/// for any number of threads. Throws ValueError if an option is not positive.
std::vector<float> surfaceLic(const SurfaceView& view, const Flow& flow, const SurfaceLicOptions& options = {},
                              const Monitor& monitor = {});

/// Returns the range of the streaks at these positions of a surface. `resolution`: SurfaceView::resolution. Throws like
/// surfaceLic().
LicRange surfaceLicRange(const std::vector<Vec3d>& positions, double resolution, const Flow& flow,
                         const SurfaceLicOptions& options = {}, const Monitor& monitor = {});

} // namespace curlew
