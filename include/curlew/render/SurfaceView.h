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

/// A surface as a camera sees it: `samples` x `samples` rays per pixel, in a regular pattern.
struct SurfaceView {
    Camera camera;
    int samples = 3;
    double resolution = 0;           ///< To which the surface was traced, world units: a quarter of a pixel.
    std::vector<SurfaceSample> hits; ///< By pixels: row by row, from left to right.
    std::vector<size_t> first;       ///< Where those of each pixel begin in `hits`; one more at the end.

    size_t samplesPerPixel() const { return static_cast<size_t>(samples) * static_cast<size_t>(samples); }
    /// The part of the picture that the surface covers.
    double coverage() const;
};

/// Traces the rays. The surface is resolved to a quarter of a pixel at the middle of its box. Throws ValueError for
/// samples not between 1 and 16; ResourceError where the hits would not fit the memory; Interrupted.
SurfaceView viewSurface(const Surface& surface, const Camera& camera, int samples = 3, const Monitor& monitor = {});

/// What is seen through the hits of a view: for each ray the next place where it meets the surface, if there is one.
SurfaceView viewThrough(const Surface& surface, const SurfaceView& view, const Monitor& monitor = {});

/// The nearest camera that sees all of the surface (visiblePoints), with the margin kFramingMargin; the camera around
/// the surface's box if it sees next to nothing of the surface. Throws ValueError as Camera::around does.
Camera framing(const Surface& surface, CameraOptions options);

/// Where a coarse grid of rays, about 128 across the longer edge, meets the surface.
std::vector<Vec3d> visiblePoints(const Surface& surface, const Camera& camera);

} // namespace curlew
