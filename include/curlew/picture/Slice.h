// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/base/Monitor.h"
#include "curlew/flow/Flow.h"
#include "curlew/picture/Image.h"

#include <functional>

namespace curlew {

struct SliceOptions {
    int axis = 2;          ///< The plane is perpendicular to this axis (0, 1, 2 for x, y, z).
    double position = 0;   ///< Where on that axis, world units.
    int width = 800;       ///< Pixels.
    int supersampling = 2; ///< Samples per pixel along each edge, averaged.
    double margin = 0.04;  ///< What is shown around the box, as a part of its longer edge.
};

/// A picture's rectangle of a plane. x points right (across x: z), y up (across y: z). Pixel positions are in pixels
/// from the upper left corner, so that the middle of the first pixel is (0.5, 0.5).
class PicturePlane {
  public:
    /// That which shows a box and its margin. Throws ValueError for an infinite or empty box, a width that is not
    /// positive or a picture of more than 32768 pixels along an edge.
    PicturePlane(const Box& box, const SliceOptions& options);

    int width() const { return mWidth; }
    int height() const { return mHeight; }
    double pixel() const { return mPixel; } ///< World units.
    /// The axes that point to the right and upwards.
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
    Vec3d mCorner; ///< The upper left one.
};

/// What a slice shows: a value per channel at each of a batch of positions, in the order of the channels; NaN where
/// there is nothing to show.
struct SliceSource {
    using Values = std::vector<std::array<float, kBatch>>;
    std::vector<std::string> channels;
    std::function<void(const PointBatch&, Values&)> eval;
};

/// A source on a plane as an image of its channels. A pixel of which more than half is nothing is NaN. Throws as
/// PicturePlane does, and ResourceError where the memory would not do.
Image slice(const Box& box, const SliceSource& source, const SliceOptions& options, const Monitor& monitor = {});

/// Of a flow, within its domain: "speed", "vx", "vy", "vz", "f", "g", "distance", or "velocity" (velocity.x, .y, .z).
/// ValueError for other names.
SliceSource flowSource(const Flow& flow, std::string_view name);

/// Of a field, everywhere: "value", "slope" (the length of the gradient), or "gradient" (gradient.x, .y, .z).
/// ValueError for other names.
SliceSource fieldSource(const ScalarField& field, std::string_view name);

/// The component of a flow's velocity in a direction (of any length): "along". ValueError for a zero direction.
SliceSource alongSource(const Flow& flow, const Vec3d& direction);

/// The signed distance to the wall of a domain, also outside of the domain and its box: "distance".
SliceSource wallSource(const Domain& domain);

/// The components of a slice through a vector in the plane of the picture: channels "right" and "up".
Image inPlane(const Image& vectors, const PicturePlane& plane);

} // namespace curlew
