// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/math/Vec.h"

#include <vector>

namespace curlew {

/// Where a camera looks from, but for its distance, and its picture.
struct CameraOptions {
    Vec3d from{{0.6, 0.45, 1}};    ///< The direction from the subject to the camera, of any length.
    Vec3d up{{0, 1, 0}};           ///< What is upwards in the picture.
    double fieldOfView = 35;       ///< The angle that the longer edge of the picture spans, degrees.
    int width = 960, height = 720; ///< Pixels.
    double margin = 0.04;          ///< How much of the picture's edges stays free, as a part of each.
};

/// The margin of cameras that are fitted to what they see rather than to its box.
inline constexpr double kFramingMargin = 0.07;

/// A pinhole camera. Pixel positions are in pixels from the upper left corner of the picture, so that the middle of
/// the first pixel is (0.5, 0.5). Immutable, so safe to use from any number of threads.
class Camera {
  public:
    /// From `eye` towards `target`, both world units, with `up` upwards in the picture; `fieldOfView` is the angle that
    /// the longer edge of the picture spans, degrees. Throws ValueError where eye and target coincide, up is parallel
    /// to the way between them, the angle is not between 0 and 170, or there is no pixel.
    Camera(const Vec3d& eye, const Vec3d& target, const Vec3d& up, double fieldOfView, int width, int height);

    /// The nearest camera that sees all of a box and looks at its centre. Throws ValueError also if the box is empty or
    /// infinite, or `from` is zero.
    static Camera around(const Box& box, const CameraOptions& options);
    /// The nearest camera that sees all of these points. Throws ValueError also if they all are the same, or there are
    /// none.
    static Camera around(const std::vector<Vec3d>& points, const CameraOptions& options);

    int width() const { return mWidth; }
    int height() const { return mHeight; }
    const Vec3d& eye() const { return mEye; }
    /// Unit vectors of the picture: to the right, up, and into it.
    const Vec3d& right() const { return mRight; }
    const Vec3d& up() const { return mUp; }
    const Vec3d& forward() const { return mForward; }

    /// The unit direction in which a pixel position is seen from the eye.
    Vec3d direction(double x, double y) const;

    struct Projected {
        double x = 0, y = 0;      ///< Pixel position.
        double depth = 0;         ///< Along forward(), world units; not positive: behind the eye, x and y mean nothing.
        double pixelsPerUnit = 0; ///< How large a world unit across the view is there.
    };
    Projected project(const Vec3d& position) const;

  private:
    Vec3d mEye, mRight, mUp, mForward;
    double mFocal; ///< Pixels.
    int mWidth, mHeight;
};

} // namespace curlew
