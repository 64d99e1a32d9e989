// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/math/Vec.h"

#include <vector>

namespace curlew {

/// The view of a camera, except for its distance, and the size of its picture.
struct CameraOptions {
    Vec3d from{{0.6, 0.45, 1}};    ///< The direction from the subject to the camera, of any length.
    Vec3d up{{0, 1, 0}};           ///< The direction that is up in the picture.
    double fieldOfView = 35;       ///< Field of view along the longer edge of the picture, degrees.
    int width = 960, height = 720; ///< Pixels.
    double margin = 0.04;          ///< Free margin at each edge, relative to the picture's width or height.
};

/// The margin of cameras that are fitted to the visible geometry rather than to its box.
inline constexpr double kFramingMargin = 0.07;

/// A pinhole camera. Pixel positions are in pixels from the upper left corner of the picture, so the centre of the
/// first pixel is (0.5, 0.5). Immutable, safe to share between threads.
class Camera {
  public:
    /// Looks from `eye` towards `target`, both world units, with `up` upwards in the picture. `fieldOfView` is the
    /// angle along the longer edge of the picture, degrees. Throws ValueError if eye and target coincide, up is
    /// parallel to the view direction, the angle is not above 0 and at most 170, or there is no pixel.
    Camera(const Vec3d& eye, const Vec3d& target, const Vec3d& up, double fieldOfView, int width, int height);

    /// Returns a camera at the origin that looks as the options say. Also throws ValueError if `from` is zero.
    static Camera atOrigin(const CameraOptions& options);
    /// Returns the nearest camera that sees the whole box and looks at its centre. Also throws ValueError if the box is
    /// empty or infinite, or `from` is zero.
    static Camera around(const Box& box, const CameraOptions& options);
    /// Returns the nearest camera that sees all of these points. Also throws ValueError if there are no points, all
    /// coincide, or `from` is zero.
    static Camera around(const std::vector<Vec3d>& points, const CameraOptions& options);

    int width() const { return mWidth; }
    int height() const { return mHeight; }
    const Vec3d& eye() const { return mEye; }
    /// Unit vectors of the picture: right, up, and into it.
    const Vec3d& right() const { return mRight; }
    const Vec3d& up() const { return mUp; }
    const Vec3d& forward() const { return mForward; }
    /// Size in pixels of a world unit at the depth 1, perpendicular to the view.
    double focal() const { return mFocal; }

    /// Returns the unit direction from the eye through a pixel position.
    Vec3d direction(double x, double y) const;

    template <class T>
    struct Projected {
        T x, y; ///< Pixel position.
        /// Along forward(), world units; if it is not positive, the position is behind the eye, and x and y are
        /// meaningless.
        T depth;
        T pixelsPerUnit; ///< Size of a world unit perpendicular to the view at that depth.
    };
    /// T is double or lanes of it.
    template <class T = double>
    Projected<T> project(const Vec3<T>& position) const {
        const auto of = [](const Vec3d& v) { return Vec3<T>{{T(v[0]), T(v[1]), T(v[2])}}; };
        const Vec3<T> p = position - of(mEye);
        const T depth = dot(p, of(mForward)), scale = T(mFocal) / depth;
        return {.x = T(0.5 * mWidth) + dot(p, of(mRight)) * scale,
                .y = T(0.5 * mHeight) - dot(p, of(mUp)) * scale,
                .depth = depth,
                .pixelsPerUnit = scale};
    }

  private:
    Vec3d mEye, mRight, mUp, mForward;
    double mFocal; ///< Pixels.
    int mWidth, mHeight;
};

} // namespace curlew
