// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/render/SurfacePaint.h"
#include "curlew/render/SurfaceShading.h"

namespace curlew {

struct SurfacePictureOptions {
    int samples = 3; ///< Along each edge of a pixel.
    SurfacePaint paint = {};
    SurfaceLook look = {};
    bool shadows = true; ///< Whether the surface casts shadows on itself.
};

/// How well a texture was carried: AdvectResult of all hits.
struct CarriedTexture {
    size_t notConverged = 0, retries = 0, substeps = 0;
    double meanIterations = 0; ///< Per substep.

    CarriedTexture& operator+=(const AdvectResult& part);
};

struct SurfacePicture {
    Image image;                                ///< The channels of shadeSurface().
    size_t hits = 0;                            ///< Samples that show the surface.
    double coverage = 0;                        ///< Their fraction of all samples.
    std::optional<CarriedTexture> carried = {}; ///< If the texture was carried.
};

/// Traces, paints and shades a surface, a few rows of pixels at a time, so that the samples need little memory. If
/// `paint` has no range, the range is that of visiblePoints(), or of the centres of all pixels if these are few. A
/// mirror also shows the far side of the surface (its next hits), without regard to what that hides. `behind`: as of
/// shadeSurface(). The same for any number of threads. Throws ValueError if `samples` is not 1 to 16, ResourceError if
/// the picture does not fit into memory, and like paintedColors() and shadeSurface().
SurfacePicture drawSurface(const Surface& surface, const Camera& camera, const SurfacePictureOptions& options,
                           const Image* behind = nullptr, const Monitor& monitor = {});

} // namespace curlew
