// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/field/Shapes.h"

#include <memory>
#include <vector>

namespace curlew {

/// A smooth curve with coordinates around it, made of circular arcs (biarcs) through given points.
///
/// A position has the coordinates u and v along two unit vectors N₁ and N₂ across the curve at its nearest point C:
/// u = (x - C) · N₁, v = (x - C) · N₂. The vectors do not turn about the curve (rotation-minimising frame, Bishop
/// 1975), so ∇u = N₁ and ∇v = N₂ exactly, and ∇u × ∇v is the curve's tangent at C: a flow of speed 1 along the curve.
/// On a closed curve, and with a twist, they turn about the curve, and the flow turns with them. The rate is constant
/// on the curve, and nearly so beside it, where it varies to keep ∇u and ∇v continuous.
///
/// The tangent is continuous, the curvature jumps where arcs meet: u and v have continuous gradients. They are smooth
/// as far as every position has one nearest point: up to the radius of curvature, and half way to other parts of the
/// curve. An open curve goes on straight beyond its ends.
///
/// Immutable, safe to share between threads.
class Rail {
  public:
    /// `turns` is the number of turns of N₁ and N₂ about the curve per world unit; on a closed curve it is rounded so
    /// that they fit together. Points that coincide with the one before count once. Throws ValueError if a point is not
    /// finite, or if fewer than 2 different points remain (3 if the curve is closed).
    explicit Rail(const std::vector<Vec3d>& points, bool closed = false, double turns = 0);

    double length() const { return mLength; } ///< World units.
    /// Returns the position at a distance along the curve from its first point, 0 to length().
    Vec3d at(double along) const;

    /// Where the curve bends most, and the radius of curvature there; infinite for a straight line.
    struct Bend {
        double radius = std::numeric_limits<double>::infinity();
        Vec3d at;
    };
    const Bend& sharpestBend() const { return mBend; }

    /// The part of the curve that is nearest to a position.
    struct Nearest {
        size_t arc = 0;
        double distance = std::numeric_limits<double>::infinity();
    };
    Nearest nearest(const Vec3d& position) const;

    /// Returns u and v at a position whose nearest arc is given.
    template <int Order>
    std::array<Jet<double, 3, Order>, 2> across(size_t index, const Vec3d& position) const;

    bool closed() const { return mFinite == mArcs.size(); }
    Box bounds() const; ///< Of the curve itself.

  private:
    /// A circular arc, or a straight line (curvature 0).
    struct Arc {
        Vec3d start, tangent, normal = {}, binormal = {}; ///< At its start; the normal points to the centre.
        double curvature = 0;
        double from = 0, to = 0; ///< Distances along it from `start` at which it begins and ends.
        double angle = 0;        ///< At its start, N₁ = cos(angle) normal + sin(angle) binormal.

        Vec3d at(double along) const;
        Vec3d tangentAt(double along) const;
        Vec3d normalAt(double along) const;
        double distanceTo(const Vec3d& position) const;
        Box bounds() const;
    };
    void addArc(const Vec3d& start, const Vec3d& end, const Vec3d& tangent);
    void setFrames(bool closed, double turns);
    Box buildTree(size_t node, size_t begin, size_t end);
    void search(size_t node, size_t begin, size_t end, const Vec3d& position, Nearest& found) const;
    const Arc& arcAt(double& along) const; ///< Subtracts the distance to the arc's start.
    friend void requireSeparate(const std::vector<std::shared_ptr<const Rail>>& rails, double radius);

    std::vector<Arc> mArcs; ///< In order; then, for an open curve, the straight lines before and beyond it.
    size_t mFinite = 0;     ///< Number of arcs without those lines.
    std::vector<Box> mTree; ///< Boxes around halves of halves … of the arcs; children of k are 2 k + 1 and 2 k + 2.
    double mLength = 0;
    double mTwist = 0; ///< Radians per world unit.
    Bend mBend;
};
using RailPointer = std::shared_ptr<const Rail>;

/// Throws ValueError, naming the place, if tubes of this radius around the rails are wider than a bend of their rail,
/// or touch each other or themselves, so that u and v would jump in them.
void requireSeparate(const std::vector<RailPointer>& rails, double radius);

/// Returns u (axis 0) or v (axis 1) of the nearest rail.
ScalarField acrossRails(std::vector<RailPointer> rails, int axis);

/// Returns the tubes of this radius around rails, as a shape. Exact; C¹ except on the rails and half way between them.
/// Tubes of open rails go on without end, so such a shape is unbounded. Throws ValueError if there are no rails, or if
/// the radius is not positive and finite.
Sdf tubeSdf(std::vector<RailPointer> rails, double radius);

} // namespace curlew
