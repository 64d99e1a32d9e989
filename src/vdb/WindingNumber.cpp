// SPDX-License-Identifier: Apache-2.0
#include "curlew/vdb/WindingNumber.h"

#include "WindingMoments.h"
#include "curlew/base/Memory.h"
#include "curlew/base/Parallel.h"

#include <fmt/format.h>
#include <tbb/parallel_invoke.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace curlew {

namespace {

using winding::Moments;
using winding::Triangle;

constexpr size_t kLeaf = 8;   ///< Triangles per leaf.
constexpr double kBeta = 2.7; ///< Distance, in radii, beyond which a cluster is replaced by its moments.

/// The triangles of a leaf, stored by coordinate: kLeaf x of the first vertices, then y, z, x of the second vertices …
/// Unused triangles have no extent and add nothing.
struct FaceGroup {
    std::array<double, 9 * kLeaf> corner{};
};

constexpr size_t kGroup = 8;

/// The far-field approximations of eight clusters, stored side by side for the lanes of vector registers.
struct Group {
    std::array<double, 3 * kGroup> center;
    std::array<float, kGroup> reach2;
    std::array<float, 19 * kGroup> moments{};

    /// Clusters that do not exist are far from every position and add nothing.
    Group() {
        center.fill(1e4);
        reach2.fill(-1);
    }
    void set(size_t lane, const winding::Far& far) {
        for (size_t axis = 0; axis < 3; ++axis) {
            center[axis * kGroup + lane] = far.center.c[axis];
            moments[axis * kGroup + lane] = static_cast<float>(far.a.c[axis]);
        }
        for (size_t n = 0; n < far.b.size(); ++n) moments[(3 + n) * kGroup + lane] = static_cast<float>(far.b[n]);
        for (size_t n = 0; n < far.c.size(); ++n) moments[(9 + n) * kGroup + lane] = static_cast<float>(far.c[n]);
        reach2[lane] = static_cast<float>(far.reach2);
    }

    /// Adds to `sums` the solid angles, as seen from x, of those clusters that are far enough (formula at
    /// winding::Far). Writes the squared distances of all clusters to `distance2`.
    void add(const Vec3d& x, std::array<float, kGroup>& sums, std::array<float, kGroup>& distance2) const {
        std::array<float, 3 * kGroup> r;
        const double px = x[0], py = x[1], pz = x[2];
        for (size_t k = 0; k < kGroup; ++k) {
            r[k] = static_cast<float>(center[k] - px);
            r[kGroup + k] = static_cast<float>(center[kGroup + k] - py);
            r[2 * kGroup + k] = static_cast<float>(center[2 * kGroup + k] - pz);
        }
        const float *const m = moments.data(), *const reach = reach2.data();
        for (size_t k = 0; k < kGroup; ++k) {
            const float u = r[k], v = r[kGroup + k], w = r[2 * kGroup + k];
            const float uu = u * u, vv = v * v, ww = w * w, r2 = uu + vv + ww, uv = u * v, uw = u * w, vw = v * w;
            const float* const c = m + k;
            const float inverse = 1 / (r2 > reach[k] ? r2 : 1.0f), on = r2 > reach[k] ? 1.0f : 0.0f;
            const float linear = c[0] * u + c[kGroup] * v + c[2 * kGroup] * w;
            const float quadratic = c[3 * kGroup] * uu + c[4 * kGroup] * uv + c[5 * kGroup] * uw + c[6 * kGroup] * vv +
                                    c[7 * kGroup] * vw + c[8 * kGroup] * ww;
            const float cubic = u * (c[9 * kGroup] * uu + c[10 * kGroup] * uv + c[11 * kGroup] * uw +
                                     c[12 * kGroup] * vv + c[13 * kGroup] * vw + c[14 * kGroup] * ww) +
                                v * (c[15 * kGroup] * vv + c[16 * kGroup] * vw + c[17 * kGroup] * ww) +
                                c[18 * kGroup] * w * ww;
            sums[k] += on * (linear + (quadratic + cubic * inverse) * inverse) * inverse * std::sqrt(inverse);
            distance2[k] = r2;
        }
    }
};

/// A sum of half solid angles, kept as complex numbers whose arguments are the angles: one per triangle slot of a leaf,
/// the product over all leaves, and its number of full turns.
struct HalfAngles {
    std::array<double, kLeaf> re, im{}, turns{};

    HalfAngles() { re.fill(1); }

    double sum() const {
        double x = re[0], y = im[0], around = turns[0];
        for (size_t k = 1; k < kLeaf; ++k) {
            const double newX = x * re[k] - y * im[k], newY = x * im[k] + y * re[k] + 0.0; // + 0.0: no -0
            around += turns[k] + turned(y, im[k], newY);
            x = newX;
            y = newY;
        }
        return std::atan2(y, x) + 2 * std::numbers::pi * around;
    }

    /// Returns the change of the number of full turns when a turn of less than a half is added. The argument wraps at
    /// the negative real axis. The turn crosses it if it goes counter-clockwise from the upper half plane to the lower
    /// one, or clockwise back.
    static double turned(double from, double by, double to) {
        const double fromUp = from >= 0 ? 1.0 : 0.0, byUp = by >= 0 ? 1.0 : 0.0, toUp = to >= 0 ? 1.0 : 0.0;
        return fromUp * byUp * (1 - toUp) - (1 - fromUp) * (1 - byUp) * toUp;
    }
};

/// Adds the solid angles of a leaf as seen from x: tan(Ω / 2) = det(a, b, c) / (|a||b||c| + (a·b)|c| + …).
void addLeaf(const FaceGroup& leaf, const Vec3d& x, HalfAngles& angles) {
    std::array<double, kLeaf> real, det;
    const double* const corners = leaf.corner.data();
    const double px = x[0], py = x[1], pz = x[2];
    for (size_t k = 0; k < kLeaf; ++k) { // lanes of vector registers
        const double* const p = corners + k;
        const double a0 = p[0] - px, a1 = p[kLeaf] - py, a2 = p[2 * kLeaf] - pz;
        const double b0 = p[3 * kLeaf] - px, b1 = p[4 * kLeaf] - py, b2 = p[5 * kLeaf] - pz;
        const double c0 = p[6 * kLeaf] - px, c1 = p[7 * kLeaf] - py, c2 = p[8 * kLeaf] - pz;
        const double la = std::sqrt(a0 * a0 + a1 * a1 + a2 * a2), lb = std::sqrt(b0 * b0 + b1 * b1 + b2 * b2),
                     lc = std::sqrt(c0 * c0 + c1 * c1 + c2 * c2);
        det[k] = a0 * (b1 * c2 - b2 * c1) + a1 * (b2 * c0 - b0 * c2) + a2 * (b0 * c1 - b1 * c0);
        real[k] = la * lb * lc + (a0 * b0 + a1 * b1 + a2 * b2) * lc + (b0 * c0 + b1 * c1 + b2 * c2) * la +
                  (c0 * a0 + c1 * a1 + c2 * a2) * lb;
    }
    double *const re = angles.re.data(), *const im = angles.im.data(), *const turns = angles.turns.data();
    for (size_t k = 0; k < kLeaf; ++k) {
        // In the plane of the triangle the result is the mean of both sides.
        const double size = std::abs(real[k]) + std::abs(det[k]), side = det[k];
        const double u = side == 0 ? 1.0 : real[k] / size, v = side == 0 ? 0.0 : side / size;
        const double newRe = re[k] * u - im[k] * v, newIm = re[k] * v + im[k] * u + 0.0;
        turns[k] += HalfAngles::turned(im[k], v, newIm);
        re[k] = newRe;
        im[k] = newIm;
    }
}

} // namespace

/// A tree of clusters. Positions are translated and scaled so that the mesh lies between -1/2 and 1/2, where moments
/// keep their precision.
///
/// Halving the triangles repeatedly gives 2^depth leaves. Three halvings form one level of groups, and the remainder,
/// if any, the top level. The clusters of group g are the groups 8 g, 8 g + 1, … of the next level, or the leaves of
/// these indices.
struct WindingNumber::Tree {
    Vec3d center{};
    double scale = 1;
    int depth = 0, top = 0; ///< Number of halvings: in total, and of the first level.
    std::vector<std::vector<Group>> levels;
    std::vector<FaceGroup> leaves;

    Vec3d local(const Vec3d& position) const { return (position - center) * scale; }
    std::vector<Triangle> trianglesOf(const Mesh& mesh);
    void make(std::vector<Triangle>& triangles, const Monitor& monitor);
    Moments build(std::span<Triangle> triangles, size_t number, int halvings, const Monitor& monitor);

    /// Calls near(leaf, squared distance, squared reach) for leaves whose triangles must be summed exactly. Returns the
    /// sum over all other clusters.
    template <class Near>
    double walk(const Vec3d& x, const Near& near) const;
};

template <class Near>
double WindingNumber::Tree::walk(const Vec3d& x, const Near& near) const {
    if (levels.empty()) {
        if (!leaves.empty()) near(leaves[0], 0.0f, 1.0f);
        return 0;
    }
    struct Pending {
        size_t level, group;
    };
    std::array<Pending, 128> stack;
    size_t height = 0;
    stack[height++] = {0, 0};
    std::array<float, kGroup> sums{}, distance2;
    while (height > 0) {
        const Pending pending = stack[--height];
        const Group& group = levels[pending.level][pending.group];
        group.add(x, sums, distance2);
        const bool last = pending.level + 1 == levels.size();
        for (size_t k = 0; k < kGroup; ++k) {
            if (distance2[k] > group.reach2[k]) continue;
            const size_t below = pending.group * kGroup + k;
            if (last)
                near(leaves[below], distance2[k], group.reach2[k]);
            else
                stack[height++] = {pending.level + 1, below};
        }
    }
    double sum = 0;
    for (const float part : sums) sum += static_cast<double>(part);
    return sum;
}

/// Returns the triangles of the mesh that have an area, in local coordinates. Sets center and scale.
std::vector<Triangle> WindingNumber::Tree::trianglesOf(const Mesh& mesh) {
    openvdb::BBoxd box;
    for (const auto& p : mesh.points) box.expand(openvdb::Vec3d(p));
    if (mesh.points.empty()) return {};
    const openvdb::Vec3d middle = box.getCenter(), extents = box.extents();
    center = {{middle[0], middle[1], middle[2]}};
    const double size = std::max({extents[0], extents[1], extents[2]});
    scale = size > 0 ? 1 / size : 1;
    std::vector<Triangle> triangles;
    triangles.reserve(mesh.triangles.size() + 2 * mesh.quads.size());
    const auto add = [&](openvdb::Index32 a, openvdb::Index32 b, openvdb::Index32 c) {
        const auto vertex = [&](openvdb::Index32 n) {
            const auto& p = mesh.points[n];
            return local({{static_cast<double>(p[0]), static_cast<double>(p[1]), static_cast<double>(p[2])}});
        };
        const Triangle triangle{vertex(a), vertex(b), vertex(c)};
        if (dot(triangle.area(), triangle.area()) > 0) triangles.push_back(triangle);
    };
    for (const auto& f : mesh.triangles) add(f[0], f[1], f[2]);
    for (const auto& f : mesh.quads) {
        add(f[0], f[1], f[2]);
        add(f[0], f[2], f[3]);
    }
    return triangles;
}

/// Builds the cluster with index `number` after `halvings` halvings, and all clusters below it. Returns its moments.
Moments WindingNumber::Tree::build(std::span<Triangle> triangles, size_t number, int halvings, const Monitor& monitor) {
    const auto noted = [&](const Moments& moments) {
        if (halvings >= top && (halvings - top) % 3 == 0 && halvings > 0) {
            const auto level = static_cast<size_t>((halvings - top) / 3);
            const size_t group = level == 0 ? 0 : number / kGroup;
            levels[level][group].set(number - group * kGroup, winding::farOf(moments, kBeta));
        }
        return moments;
    };
    if (halvings == depth) {
        monitor.check();
        for (size_t k = 0; k < triangles.size(); ++k)
            for (size_t n = 0; n < 3; ++n)
                for (size_t axis = 0; axis < 3; ++axis)
                    leaves[number].corner[(3 * n + axis) * kLeaf + k] = triangles[k].corner[n].c[axis];
        return noted(winding::momentsOf(triangles));
    }
    Vec3d lower = triangles[0].middle(), upper = lower;
    for (const Triangle& t : triangles)
        for (int axis = 0; axis < 3; ++axis) {
            lower[axis] = std::min(lower[axis], t.middle()[axis]);
            upper[axis] = std::max(upper[axis], t.middle()[axis]);
        }
    const Vec3d extent = upper - lower;
    const int axis = extent[0] >= extent[1] && extent[0] >= extent[2] ? 0 : extent[1] >= extent[2] ? 1 : 2;
    const size_t half = triangles.size() / 2;
    std::nth_element(triangles.begin(), triangles.begin() + static_cast<std::ptrdiff_t>(half), triangles.end(),
                     [axis](const Triangle& s, const Triangle& t) { return s.middle()[axis] < t.middle()[axis]; });
    Moments left, right;
    const auto buildLeft = [&] { left = build(triangles.first(half), 2 * number, halvings + 1, monitor); };
    const auto buildRight = [&] { right = build(triangles.subspan(half), 2 * number + 1, halvings + 1, monitor); };
    if (triangles.size() > 4096) {
        tbb::parallel_invoke(buildLeft, buildRight);
    } else {
        buildLeft();
        buildRight();
    }
    return noted(winding::merged(left, right));
}

void WindingNumber::Tree::make(std::vector<Triangle>& triangles, const Monitor& monitor) {
    if (triangles.empty()) return;
    while ((triangles.size() >> depth) >= kLeaf) ++depth; // halves differ by at most one triangle
    top = depth % 3 == 0 ? std::min(depth, 3) : depth % 3;
    for (int halvings = 0; halvings < depth; halvings = halvings == 0 ? top : halvings + 3)
        levels.emplace_back(size_t(1) << halvings);
    leaves.resize(size_t(1) << depth);
    build(triangles, 0, 0, monitor);
}

WindingNumber::WindingNumber(const Mesh& mesh, const Monitor& monitor) {
    auto tree = std::make_shared<Tree>();
    const double faces = static_cast<double>(mesh.triangles.size()) + 2 * static_cast<double>(mesh.quads.size());
    requireMemory(faces * 250, fmt::format("a tree over {:.3g} triangles", faces), "give a mesh with fewer faces");
    std::vector<Triangle> triangles = tree->trianglesOf(mesh);
    tree->make(triangles, monitor);
    mTree = std::move(tree);
}

namespace {

/// Returns whether x is within a million mesh sizes. Farther away the solid angle is negligible.
bool inSight(const Vec3d& x) { return dot(x, x) < 1e12; }

} // namespace

double WindingNumber::at(const Vec3d& position) const {
    const Vec3d x = mTree->local(position);
    if (!inSight(x)) return 0;
    HalfAngles angles;
    const double far = mTree->walk(x, [&](const FaceGroup& leaf, float, float) { addLeaf(leaf, x, angles); });
    return (far + 2 * angles.sum()) / (4 * std::numbers::pi);
}

std::array<double, 2> WindingNumber::beside(const Vec3d& position, const Vec3d& step) const {
    const Vec3d x = mTree->local(position), by = step * mTree->scale, above = x + by, below = x - by;
    if (!inSight(x)) return {0, 0};
    HalfAngles common, up, down;
    const auto close = static_cast<float>(32 * length(by));
    const double far = mTree->walk(x, [&](const FaceGroup& leaf, float distance2, float reach2) {
        if (std::sqrt(distance2) > std::sqrt(reach2) / static_cast<float>(kBeta) + close) {
            addLeaf(leaf, x, common);
        } else {
            addLeaf(leaf, above, up);
            addLeaf(leaf, below, down);
        }
    });
    const double both = far + 2 * common.sum(), whole = 4 * std::numbers::pi;
    return {(both + 2 * up.sum()) / whole, (both + 2 * down.sum()) / whole};
}

std::vector<double> WindingNumber::at(std::span<const Vec3d> positions, const Monitor& monitor) const {
    std::vector<double> result(positions.size());
    parallelFor(
        positions.size(), 1024,
        [&](size_t begin, size_t end) {
            for (size_t n = begin; n < end; ++n) result[n] = at(positions[n]);
        },
        monitor);
    return result;
}

double WindingNumber::exactAt(const Vec3d& position) const {
    const Vec3d x = mTree->local(position);
    if (!inSight(x)) return 0;
    HalfAngles angles;
    for (const FaceGroup& leaf : mTree->leaves) addLeaf(leaf, x, angles);
    return 2 * angles.sum() / (4 * std::numbers::pi);
}

} // namespace curlew
