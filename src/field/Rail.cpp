// SPDX-License-Identifier: Apache-2.0
#include "curlew/field/Rail.h"

#include "curlew/base/Error.h"
#include "curlew/base/Require.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace curlew {

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Returns a unit vector across v.
Vec3d anyNormal(const Vec3d& v) {
    int least = 0;
    for (int axis = 1; axis < 3; ++axis)
        if (std::abs(v[axis]) < std::abs(v[least])) least = axis;
    Vec3d e;
    e[least] = 1;
    return normalized(cross(v, e));
}

/// Returns the points without those that coincide with the one before.
std::vector<Vec3d> distinct(const std::vector<Vec3d>& points, bool closed) {
    std::vector<Vec3d> kept;
    for (const Vec3d& p : points) {
        if (!(std::isfinite(p[0]) && std::isfinite(p[1]) && std::isfinite(p[2])))
            throw ValueError("a point of a rail is not finite");
        if (kept.empty() || !(p == kept.back())) kept.push_back(p);
    }
    while (closed && kept.size() > 1 && kept.front() == kept.back()) kept.pop_back();
    if (const size_t least = closed ? 3 : 2; kept.size() < least)
        throw ValueError(fmt::format("a{} rail needs at least {} different points", closed ? " closed" : "", least));
    return kept;
}

/// Returns whether the curve turns back onto the line on which it came. The circle through a point and its two
/// neighbours is then a line, or so large that it is useless, and `sum` would lead away from one of them; the curve
/// turns in half circles instead.
bool doublesBack(const Vec3d& before, const Vec3d& after, const Vec3d& sum) {
    constexpr double kAngle = 1e-6; // between `sum` and the longer of the chords
    const double longer = std::max(length(before), length(after));
    return dot(before, after) < 0 &&
           length(cross(before, after)) <= kAngle * length(sum) * length(before) * length(after) * longer;
}

/// Returns the tangents at the points: that of the circle through a point and its two neighbours.
std::vector<Vec3d> tangentsAt(const std::vector<Vec3d>& p, bool closed) {
    const size_t n = p.size();
    std::vector<Vec3d> tangents(n);
    for (size_t k = 0; k < n; ++k) {
        if (!closed && (k == 0 || k == n - 1)) continue;
        const Vec3d before = p[k] - p[(k + n - 1) % n], after = p[(k + 1) % n] - p[k];
        const Vec3d sum = before * (1 / dot(before, before)) + after * (1 / dot(after, after));
        tangents[k] = doublesBack(before, after, sum) ? anyNormal(before) : normalized(sum);
    }
    if (closed) return tangents;
    // The ends: an arc has the same angle with its chord at both ends.
    const auto mirrored = [](const Vec3d& tangent, const Vec3d& chord) {
        const Vec3d u = normalized(chord);
        return u * (2 * dot(tangent, u)) - tangent;
    };
    if (n == 2) {
        tangents[0] = tangents[1] = normalized(p[1] - p[0]);
    } else {
        tangents[0] = mirrored(tangents[1], p[1] - p[0]);
        tangents[n - 1] = mirrored(tangents[n - 2], p[n - 1] - p[n - 2]);
    }
    return tangents;
}

/// Returns where two arcs from p to q meet that begin and end with these tangents, so that both tangents have the same
/// length up to their intersections.
Vec3d jointOf(const Vec3d& p, const Vec3d& q, const Vec3d& first, const Vec3d& last) {
    const Vec3d v = q - p, t = first + last;
    const double a = 2 * (1 - dot(first, last)), b = dot(v, t), c = dot(v, v);
    // a d² + 2 b d - c = 0; this form of its positive root has no cancellation for a = 0 and b > 0.
    const double root = std::sqrt(b * b + a * c);
    if (!(root > 0)) return (p + q) * 0.5; // both tangents are the same, and across the line: two half circles
    constexpr double kParallel = 1e-12;
    // If the tangents are parallel and point backward, that root is infinite or nearly so. The negative one has arcs of
    // more than half a circle.
    const double d = b >= 0 ? c / (b + root) : a > kParallel ? (root - b) / a : c / (b - root);
    return (p + q) * 0.5 + (first - last) * (0.5 * d);
}

Box unionOf(const Box& a, const Box& b) {
    Box box = a;
    for (int k = 0; k < 3; ++k) {
        box.lower[k] = std::min(a.lower[k], b.lower[k]);
        box.upper[k] = std::max(a.upper[k], b.upper[k]);
    }
    return box;
}

double distanceTo(const Box& box, const Vec3d& p) {
    Vec3d away;
    for (int k = 0; k < 3; ++k) away[k] = std::max({box.lower[k] - p[k], p[k] - box.upper[k], 0.0});
    return length(away);
}

/// Returns an angle that differs by whole turns, and is within half a turn of `near`.
double turnedNear(double angle, double near) {
    return angle - 2 * std::numbers::pi * std::round((angle - near) / (2 * std::numbers::pi));
}

} // namespace

// --- arcs

Vec3d Rail::Arc::at(double along) const {
    const double half = 0.5 * curvature * along, chord = half == 0 ? along : along * std::sin(half) / half;
    return start + (tangent * std::cos(half) + normal * std::sin(half)) * chord;
}
Vec3d Rail::Arc::tangentAt(double along) const {
    return tangent * std::cos(curvature * along) + normal * std::sin(curvature * along);
}
Vec3d Rail::Arc::normalAt(double along) const {
    return normal * std::cos(curvature * along) - tangent * std::sin(curvature * along);
}

double Rail::Arc::distanceTo(const Vec3d& position) const {
    const Vec3d d = position - start;
    const double x = dot(d, normal), y = dot(d, tangent), z = dot(d, binormal);
    const double a = 1 - curvature * x, b = curvature * y;
    const double along = curvature == 0 ? y : turnedNear(std::atan2(b, a), 0.5 * curvature * to) / curvature;
    if (along >= from && along <= to) {
        // Not std::hypot: the packages promise glibc 2.34, and this function has a newer version.
        const double root = std::sqrt(a * a + b * b), inPlane = (2 * x - curvature * (x * x + y * y)) / (1 + root);
        return std::sqrt(inPlane * inPlane + z * z);
    }
    double least = kInfinity;
    for (const double end : {from, to})
        if (std::isfinite(end)) least = std::min(least, curlew::length(position - at(end)));
    return least;
}

/// An arc of at most half a circle lies in the ball whose diameter is its chord.
Box Rail::Arc::bounds() const {
    const bool half = curvature * to <= std::numbers::pi;
    const Vec3d centre = half ? (at(from) + at(to)) * 0.5 : start + normal * (1 / curvature);
    const double radius = half ? 0.5 * curlew::length(at(to) - at(from)) : 1 / curvature;
    return Box{centre, centre}.padded(radius * (1 + 1e-12));
}

// --- the curve

Rail::Rail(const std::vector<Vec3d>& points, bool closed, double turns) {
    if (!std::isfinite(turns)) throw ValueError("the turns of a rail must be finite");
    const std::vector<Vec3d> p = distinct(points, closed), tangents = tangentsAt(p, closed);
    for (size_t k = 0; k + (closed ? 0 : 1) < p.size(); ++k) {
        const size_t next = (k + 1) % p.size();
        const Vec3d joint = jointOf(p[k], p[next], tangents[k], tangents[next]);
        addArc(p[k], joint, tangents[k]);
        addArc(joint, p[next], mArcs.back().tangentAt(mArcs.back().to));
    }
    mFinite = mArcs.size();
    setFrames(closed, turns);
    mTree.resize(4 * mFinite);
    buildTree(0, 0, mFinite);
    if (closed) return;
    Arc before = mArcs.front(), beyond = mArcs.back();
    before.curvature = beyond.curvature = 0;
    before.from = -kInfinity, before.to = 0;
    const Arc& last = mArcs.back();
    beyond.start = last.at(last.to), beyond.tangent = last.tangentAt(last.to), beyond.normal = last.normalAt(last.to);
    beyond.angle = last.angle + mTwist * last.to;
    beyond.from = 0, beyond.to = kInfinity;
    mArcs.push_back(before);
    mArcs.push_back(beyond);
}

void Rail::addArc(const Vec3d& start, const Vec3d& end, const Vec3d& tangent) {
    constexpr double kStraight = 1e-9; // the angle with the chord
    Arc arc{.start = start, .tangent = tangent};
    const Vec3d chord = end - start;
    const double ahead = dot(chord, tangent);
    const Vec3d aside = chord - tangent * ahead;
    const double off = curlew::length(aside), squared = dot(chord, chord);
    if (squared == 0) return;
    if (off <= kStraight * ahead) {
        arc.normal = anyNormal(tangent);
        arc.to = ahead;
    } else {
        arc.normal = aside * (1 / off);
        arc.curvature = 2 * off / squared;
        arc.to = 2 * std::atan2(off, ahead) / arc.curvature;
        if (const double radius = 1 / arc.curvature; radius < mBend.radius) mBend = {radius, arc.at(0.5 * arc.to)};
    }
    arc.binormal = cross(tangent, arc.normal);
    mLength += arc.to;
    mArcs.push_back(arc);
}

void Rail::setFrames(bool closed, double turns) {
    mArcs.front().angle = 0;
    Vec3d carried = mArcs.front().normal; // N₁ without twist, at the end of the arc
    for (size_t k = 0; k < mFinite; ++k) {
        Arc& arc = mArcs[k];
        arc.angle = std::atan2(dot(carried, arc.binormal), dot(carried, arc.normal));
        carried = arc.normalAt(arc.to) * std::cos(arc.angle) + arc.binormal * std::sin(arc.angle);
    }
    mTwist = 2 * std::numbers::pi * turns;
    if (closed) { // the frame at the end is turned by this angle from that at the start
        const Arc& first = mArcs.front();
        const double off = std::atan2(dot(carried, first.binormal), dot(carried, first.normal));
        mTwist = (2 * std::numbers::pi * std::round(turns * mLength) - off) / mLength;
    }
    double along = 0;
    for (Arc& arc : mArcs) {
        arc.angle += mTwist * along;
        along += arc.to;
    }
}

const Rail::Arc& Rail::arcAt(double& along) const {
    for (size_t k = 0; k + 1 < mFinite; ++k) {
        if (along <= mArcs[k].to) return mArcs[k];
        along -= mArcs[k].to;
    }
    return mArcs[mFinite - 1];
}

Vec3d Rail::at(double along) const {
    const Arc& arc = arcAt(along);
    return arc.at(along);
}

Box Rail::bounds() const { return mTree.front(); }

Box Rail::buildTree(size_t node, size_t begin, size_t end) {
    const size_t middle = begin + (end - begin) / 2;
    mTree[node] = end - begin == 1
                      ? mArcs[begin].bounds()
                      : unionOf(buildTree(2 * node + 1, begin, middle), buildTree(2 * node + 2, middle, end));
    return mTree[node];
}

void Rail::search(size_t node, size_t begin, size_t end, const Vec3d& position, Nearest& found) const {
    if (end - begin == 1) {
        if (const double distance = mArcs[begin].distanceTo(position); distance < found.distance)
            found = {begin, distance};
        return;
    }
    const size_t middle = begin + (end - begin) / 2;
    const std::array<double, 2> away{curlew::distanceTo(mTree[2 * node + 1], position),
                                     curlew::distanceTo(mTree[2 * node + 2], position)};
    for (const size_t child : away[0] <= away[1] ? std::array<size_t, 2>{0, 1} : std::array<size_t, 2>{1, 0})
        if (away[child] < found.distance)
            search(2 * node + 1 + child, child == 0 ? begin : middle, child == 0 ? middle : end, position, found);
}

Rail::Nearest Rail::nearest(const Vec3d& position) const {
    Nearest found;
    search(0, 0, mFinite, position, found);
    for (size_t k = mFinite; k < mArcs.size(); ++k)
        if (const double distance = mArcs[k].distanceTo(position); distance < found.distance) found = {k, distance};
    return found;
}

template <int Order>
std::array<Jet<double, 3, Order>, 2> Rail::across(size_t index, const Vec3d& position) const {
    using J = Jet<double, 3, Order>;
    const Arc& arc = mArcs[index];
    const auto d = J::variables(position - arc.start);
    const auto along = [&](const Vec3d& axis) { return d[0] * axis[0] + d[1] * axis[1] + d[2] * axis[2]; };
    const J x = along(arc.normal), y = along(arc.tangent), q = along(arc.binormal);
    const double curvature = arc.curvature;
    const J a = J(1) - x * curvature, b = y * curvature, squared = a * a + b * b;
    if (!(squared.value > 0)) return {}; // the centre of curvature, which has no nearest point
    // The distance from the arc towards its centre, without cancellation if the curvature is small or zero.
    const J p = (x * 2.0 - (x * x + y * y) * curvature) * reciprocal(J(1) + sqrt(squared));
    J turned(arc.angle);
    if (mTwist != 0 && curvature == 0) turned += y * mTwist;
    if (mTwist != 0 && curvature != 0) {
        const double angle = std::atan2(b.value, a.value), c = std::cos(angle), s = std::sin(angle);
        const J tangent = (b * c - a * s) * reciprocal(a * c + b * s); // of the angle from here, so zero here
        const double whole = turnedNear(angle, 0.5 * curvature * arc.to);
        const J part = compose(tangent, Univariate<double>{whole, 1, 0, -2}) * (1 / (curvature * arc.to)); // 0 to 1
        // The gradient of the distance along the arc is 1 / (1 - curvature p), which jumps where arcs meet. This cubic
        // is 0 at both ends of the arc, with slopes of -1, and makes the gradient 1 there.
        const J cubic = part * (J(1) - part) * (J(1) - part * 2.0);
        turned += (part - cubic * p * curvature) * (mTwist * arc.to);
    }
    const J c = cos(turned), s = sin(turned);
    return {c * p + s * q, c * q - s * p};
}
template std::array<Jet<double, 3, 0>, 2> Rail::across(size_t, const Vec3d&) const;
template std::array<Jet<double, 3, 1>, 2> Rail::across(size_t, const Vec3d&) const;
template std::array<Jet<double, 3, 2>, 2> Rail::across(size_t, const Vec3d&) const;
template std::array<Jet<double, 3, 3>, 2> Rail::across(size_t, const Vec3d&) const;

// --- fields

namespace {

struct NearestRail {
    const Rail* rail = nullptr;
    Rail::Nearest nearest;
};

NearestRail nearestOf(const std::vector<RailPointer>& rails, const Vec3d& position) {
    NearestRail found;
    for (const RailPointer& rail : rails)
        if (const auto nearest = rail->nearest(position); nearest.distance < found.nearest.distance)
            found = {rail.get(), nearest};
    return found;
}

/// A field that `of(u, v)` makes of the coordinates across the nearest rail.
template <class Of>
struct RailField {
    std::vector<RailPointer> rails;
    Of of;

    template <int Order, class T>
    void evalBatch(const PointBatch& points, JetBatch<T, Order>& jets) const {
        for (int i = 0; i < points.size; ++i) {
            Jet<double, 3, Order> jet(std::numeric_limits<double>::quiet_NaN());
            if (const NearestRail near = nearestOf(rails, points[i]); near.rail)
                jet = of(near.rail->template across<Order>(near.nearest.arc, points[i]));
            for (int k = 0; k < jet.kSize; ++k)
                jets.c[static_cast<size_t>(k)][static_cast<size_t>(i)] = static_cast<T>(jet.component(k));
        }
    }
};

template <class Of>
ScalarField railField(std::vector<RailPointer> rails, Of of) {
    if (rails.empty()) throw ValueError("there are no rails");
    return ScalarField(RailField<Of>{std::move(rails), std::move(of)});
}

} // namespace

void requireSeparate(const std::vector<RailPointer>& rails, double radius) {
    requirePositive(radius, "the radius of a tube");
    for (const RailPointer& rail : rails) {
        if (const auto& bend = rail->sharpestBend(); bend.radius <= radius)
            throw ValueError(fmt::format(
                "a tube of radius {:.4g} is wider than the bend of its curve at {:.4g},{:.4g},{:.4g}, whose "
                "radius is {:.4g}; use a smaller radius or a smoother curve",
                radius, bend.at[0], bend.at[1], bend.at[2], bend.radius));
        // If another part is nearer to a point just inside the surface of the tube, tubes overlap.
        constexpr int kAround = 8;
        constexpr double kInside = 0.999, kMostSamples = 1e5;
        const auto steps = static_cast<size_t>(std::clamp(std::ceil(2 * rail->length() / radius), 1.0, kMostSamples));
        for (size_t k = 0; k < steps; ++k) {
            double along = rail->length() * (static_cast<double>(k) + 0.5) / static_cast<double>(steps);
            const Rail::Arc& arc = rail->arcAt(along);
            for (int turn = 0; turn < kAround; ++turn) {
                const double angle = 2 * std::numbers::pi * turn / kAround;
                const Vec3d position =
                    arc.at(along) +
                    (arc.normalAt(along) * std::cos(angle) + arc.binormal * std::sin(angle)) * (kInside * radius);
                if (nearestOf(rails, position).nearest.distance < kInside * radius * (1 - 1e-6))
                    throw ValueError(
                        fmt::format("the tubes of radius {:.4g} touch near {:.4g},{:.4g},{:.4g}; use a smaller radius",
                                    radius, position[0], position[1], position[2]));
            }
        }
    }
}

ScalarField acrossRails(std::vector<RailPointer> rails, int axis) {
    return railField(std::move(rails), [axis](const auto& uv) { return uv[static_cast<size_t>(axis)]; });
}

Sdf tubeSdf(std::vector<RailPointer> rails, double radius) {
    requirePositive(radius, "the radius of a tube");
    Box bounds;
    bool open = false;
    for (size_t k = 0; k < rails.size(); ++k) {
        bounds = k == 0 ? rails[k]->bounds() : unionOf(bounds, rails[k]->bounds());
        open = open || !rails[k]->closed();
    }
    const ScalarField distance = railField(std::move(rails), [radius](const auto& uv) {
        using J = std::remove_cvref_t<decltype(uv[0])>;
        const J squared = uv[0] * uv[0] + uv[1] * uv[1];
        return squared.value > 0 ? sqrt(squared) - J(radius) : J(-radius);
    });
    return {.distance = distance, .bounds = open ? bounds.padded(kInfinity) : bounds.padded(radius)};
}

} // namespace curlew
