// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/base/Monitor.h"
#include "curlew/flow/Flow.h"
#include "curlew/picture/Image.h"

#include <functional>

namespace curlew {

struct SliceOptions {
    int axis = 2;          ///< The plane is perpendicular to this axis (0, 1, 2 for x, y, z).
    double position = 0;   ///< Position on that axis, world units.
    int width = 800;       ///< Pixels.
    int supersampling = 2; ///< Samples along each edge of a pixel, averaged.
    double margin = 0.04;  ///< Margin around the box, relative to its longer edge.
};

/// The rectangle of a plane that a picture shows. x points right (for axis x: z), y up (for axis y: z). Pixel positions
/// are in pixels from the upper left corner, so the centre of the first pixel is (0.5, 0.5).
class PicturePlane {
  public:
    /// Shows a box and its margin. Throws ValueError if the box is infinite or empty, the width is not positive, or the
    /// picture has more than 32768 pixels along an edge.
    PicturePlane(const Box& box, const SliceOptions& options);

    int width() const { return mWidth; }
    int height() const { return mHeight; }
    double pixel() const { return mPixel; } ///< Edge of a pixel, world units.
    /// The axes that point right and up.
    int right() const { return mRight; }
    int up() const { return mUp; }

    Vec3d at(double x, double y) const {
        Vec3d p = mCorner;
        p[mRight] += mPixel * x;
        p[mUp] -= mPixel * y;
        return p;
    }

  private:
    int mRight, mUp, mWidth, mHeight;
    double mPixel;
    Vec3d mCorner; ///< Upper left.
};

/// Evaluates what a slice shows: one value per channel, in the order of the channels, at each of a batch of positions;
/// NaN where there is no value.
struct SliceSource {
    using Values = std::vector<std::array<float, kBatch>>;
    std::vector<std::string> channels;
    std::function<void(const PointBatch&, Values&)> eval;
};

/// Samples a source on a plane as an image of its channels. A pixel becomes NaN unless more than half of its samples
/// have a value. Throws like PicturePlane, and ResourceError if the image does not fit into memory.
Image slice(const Box& box, const SliceSource& source, const SliceOptions& options, const Monitor& monitor = {});

/// Returns a source for a flow within its domain: "speed", "vx", "vy", "vz", "f", "g", "distance", or "velocity"
/// (velocity.x, .y, .z). Throws ValueError for other names.
SliceSource flowSource(const Flow& flow, std::string_view name);

/// Returns a source for a field, everywhere: "value", "slope" (the length of the gradient), or "gradient" (gradient.x,
/// .y, .z). Throws ValueError for other names.
SliceSource fieldSource(const ScalarField& field, std::string_view name);

/// Returns a source for the component of a flow's velocity along a direction of any length: "along". Throws ValueError
/// if the direction is zero.
SliceSource alongSource(const Flow& flow, const Vec3d& direction);

/// Returns a source for the signed distance to a domain's wall, also outside the domain and its box: "distance".
SliceSource wallSource(const Domain& domain);

/// Returns the in-plane components of a slice of a vector: channels "right" and "up".
Image inPlane(const Image& vectors, const PicturePlane& plane);

} // namespace curlew
