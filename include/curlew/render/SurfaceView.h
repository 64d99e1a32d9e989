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

/// Rows `begin` to `end` - 1 of a picture.
struct RowsOfPixels {
    int begin = 0, end = 0;
};

/// A surface as seen by a camera, in a picture or in some of its rows: `samples` x `samples` rays per pixel, in a
/// regular pattern.
struct SurfaceView {
    Camera camera;
    int samples = 3;
    double resolution = 0;           ///< Resolution of the ray tracing (resolutionOf).
    RowsOfPixels rows;               ///< Of the picture.
    std::vector<SurfaceSample> hits; ///< By pixel, row by row, from left to right.
    std::vector<size_t> first;       ///< Index of each pixel's first hit in `hits`; one extra entry at the end.

    size_t samplesPerPixel() const { return static_cast<size_t>(samples) * static_cast<size_t>(samples); }
    /// Returns the fraction of the rows that the surface covers.
    double coverage() const;
};

/// Traces the rays. The surface is resolved to a quarter of a pixel at the middle of its box. Throws ValueError if
/// samples is not 1 to 16; ResourceError if the hits do not fit into memory; Interrupted.
SurfaceView viewSurface(const Surface& surface, const Camera& camera, int samples = 3, const Monitor& monitor = {});

/// The same for some rows of the picture, which must be within it; does not check whether the hits fit into memory.
SurfaceView viewRows(const Surface& surface, const Camera& camera, int samples, const RowsOfPixels& rows,
                     const Monitor& monitor = {});

/// Returns the resolution of such views, world units: a quarter of a pixel's size at the middle of the surface.
double resolutionOf(const Surface& surface, const Camera& camera);

/// Returns the view through the hits of a view: each ray's next hit of the surface, if there is one.
SurfaceView viewThrough(const Surface& surface, const SurfaceView& view, const Monitor& monitor = {});

/// Returns the nearest camera that sees the whole surface (visiblePoints), with the margin kFramingMargin. Returns the
/// camera around the surface's box if almost nothing of the surface is visible. Throws ValueError like Camera::around.
Camera framing(const Surface& surface, CameraOptions options);

/// Returns the hits of a coarse grid of rays, about 128 across the longer edge.
std::vector<Vec3d> visiblePoints(const Surface& surface, const Camera& camera);

} // namespace curlew
