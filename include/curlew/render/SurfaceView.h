// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/base/Monitor.h"
#include "curlew/picture/Image.h"
#include "curlew/render/Camera.h"
#include "curlew/render/Surface.h"

#include <vector>

namespace curlew {

/// What one ray of a picture sees of a surface.
struct SurfaceSample {
    Vec3d position;
    Vec3f normal;    ///< Unit vector, towards the camera.
    float depth = 0; ///< Along Camera::forward(), world units.
    float lift = 0;  ///< RayHit::lift.
};

/// A surface as seen by a camera: `samples` x `samples` rays per pixel, in a regular pattern.
struct SurfaceView {
    Camera camera;
    int samples = 3;
    double resolution = 0;           ///< Resolution of the ray tracing, world units: a quarter of a pixel.
    std::vector<SurfaceSample> hits; ///< By pixel, row by row, from left to right.
    std::vector<size_t> first;       ///< Index of each pixel's first hit in `hits`; one extra entry at the end.

    size_t samplesPerPixel() const { return static_cast<size_t>(samples) * static_cast<size_t>(samples); }
    /// Returns the fraction of the picture that the surface covers.
    double coverage() const;
};

/// Traces the rays. The surface is resolved to a quarter of a pixel at the middle of its box. Throws ValueError if
/// samples is not 1 to 16; ResourceError if the hits do not fit into memory; Interrupted.
SurfaceView viewSurface(const Surface& surface, const Camera& camera, int samples = 3, const Monitor& monitor = {});

/// Returns the view through the hits of a view: each ray's next hit of the surface, if there is one.
SurfaceView viewThrough(const Surface& surface, const SurfaceView& view, const Monitor& monitor = {});

/// Returns the nearest camera that sees the whole surface (visiblePoints), with the margin kFramingMargin. Returns the
/// camera around the surface's box if almost nothing of the surface is visible. Throws ValueError like Camera::around.
Camera framing(const Surface& surface, CameraOptions options);

/// Returns the hits of a coarse grid of rays, about 128 across the longer edge.
std::vector<Vec3d> visiblePoints(const Surface& surface, const Camera& camera);

} // namespace curlew
