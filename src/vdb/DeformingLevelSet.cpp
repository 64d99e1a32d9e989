// SPDX-License-Identifier: Apache-2.0
#include "curlew/vdb/DeformingLevelSet.h"

#include "SurfaceVelocity.h"
#include "curlew/base/Error.h"
#include "curlew/field/Algebra.h"
#include "curlew/field/ForEachBatch.h"
#include "curlew/vdb/Openvdb.h"

#include <algorithm>

namespace curlew {

namespace {

constexpr double kShortest = 1.0 / 16; ///< Shortest interval, as a fraction of the time between two frames.

constexpr double kPartOfDepth = 0.5; ///< Tolerance as a fraction of half the thickness. (A limb that vanishes is off by
                                     ///< all of it.)
constexpr double kCoarser = 1.25;    ///< Size of voxels between frames relative to those of the frames: half as many
                                     ///< voxels.

/// Size of the voxels for velocities, relative to those of the level sets. Along a surface, velocities vary less than
/// distances do across it.
constexpr double kVelocityVoxels = 2;

/// Makes a level set of another mesh with the band width and the metadata of `given`, and other voxels.
LevelSet levelSetLike(const LevelSet& given, double voxel, std::shared_ptr<const Mesh> mesh, const Monitor& monitor) {
    const auto none = openvdb::FloatGrid::create(static_cast<float>(voxel));
    none->setTransform(openvdb::math::Transform::createLinearTransform(voxel));
    none->setGridClass(openvdb::GRID_LEVEL_SET);
    none->insertMeta(*given.grid);
    const double reach = (given.halfWidth() - kSplineSupport) * given.voxelSize();
    return widened({none, std::move(mesh)}, std::max(reach, 0.0) / voxel + kSplineSupport, monitor);
}

Vec3d pointOf(const Mesh& mesh, size_t k) {
    const auto& p = mesh.points[k];
    return {{static_cast<double>(p[0]), static_cast<double>(p[1]), static_cast<double>(p[2])}};
}

/// Returns the distances at the points of a mesh.
std::vector<double> distancesOf(const Mesh& mesh, const ScalarField& distance, const Monitor& monitor) {
    std::vector<double> distances(mesh.points.size());
    forEachBatch(
        PointsBy{mesh.points.size(), [&](size_t k) { return pointOf(mesh, k); }},
        [&](const PointBatch& points, size_t begin) {
            JetBatch<double, 0> d;
            distance.eval(points, d);
            for (int i = 0; i < points.size; ++i) distances[begin + static_cast<size_t>(i)] = d[i].value;
        },
        monitor);
    return distances;
}

/// Estimates the depth of the body below each point of the mesh, half its local thickness, up to `most`.
std::vector<double> depthsBelow(const Mesh& mesh, const ScalarField& distance, double most, const Monitor& monitor) {
    constexpr int kSamples = 4;
    std::vector<double> depths(mesh.points.size());
    forEachBatch(
        PointsBy{mesh.points.size(), [&](size_t k) { return pointOf(mesh, k); }},
        [&](const PointBatch& points, size_t begin) {
            JetBatch<double, 1> at;
            distance.eval(points, at);
            for (int sample = 1; sample <= kSamples; ++sample) {
                PointBatch below;
                for (int i = 0; i < points.size; ++i) {
                    const double slope = std::max(length(at[i].gradient), 0.1);
                    below.push(points[i] - at[i].gradient * (most * sample / kSamples / slope));
                }
                JetBatch<double, 0> deep;
                distance.eval(below, deep);
                for (int i = 0; i < points.size; ++i) {
                    double& depth = depths[begin + static_cast<size_t>(i)];
                    depth = std::max(depth, -deep[i].value);
                }
            }
        },
        monitor);
    return depths;
}

/// The largest deviation of the surface's points halfway between two moments: absolute, and relative to the tolerance.
/// Sampling rounds corners off, and points of overlapping parts are inside. So the deviation is the difference between
/// a point's distance and the mean of its distances at the two moments.
struct Deviation {
    double largest = 0, relative = 0;

    Deviation(const std::vector<double>& a, const std::vector<double>& middle, const std::vector<double>& b,
              double near, const std::vector<double>& tolerance) {
        for (size_t k = 0; k < middle.size(); ++k) {
            if (std::max(std::abs(a[k]), std::abs(b[k])) >= near) continue;
            const double off = std::abs(middle[k] - (a[k] + b[k]) / 2);
            largest = std::max(largest, off);
            relative = std::max(relative, off / tolerance[k]);
        }
    }
};

} // namespace

DeformingLevelSet::DeformingLevelSet(const std::optional<LevelSet>& before, const LevelSet& from, const LevelSet& to,
                                     MeshKeys meshes, const Options& options, const Monitor& monitor)
    : mMeshes(std::move(meshes)), mVoxel(std::max(from.voxelSize(), to.voxelSize())) {
    if (!from.mesh || !to.mesh || !mMeshes.from || !mMeshes.to || mMeshes.from->points.empty())
        throw ValueError("a moving level set must come from a mesh");
    if (before) mBefore = Moment{-1, sdfOf(*before)};
    mMoments = {{0, sdfOf(from)}, {1, sdfOf(to)}};
    const auto distancesAt = [&](const ScalarField& distance, const Mesh& mesh) {
        return distancesOf(mesh, distance, monitor);
    };
    std::vector<std::vector<double>> distances{distancesAt(mMoments[0].sdf.distance, *mMeshes.from),
                                               distancesAt(mMoments[1].sdf.distance, *mMeshes.to)};
    const double near = 2 * mVoxel;
    std::vector<double> tolerance =
        depthsBelow(*mMeshes.from, mMoments[0].sdf.distance, options.tolerance / kPartOfDepth, monitor);
    for (double& one : tolerance) one = std::clamp(kPartOfDepth * one, options.minTolerance, options.tolerance);
    const LevelSet& finer = from.voxelSize() <= to.voxelSize() ? from : to;
    const double voxel = kCoarser * finer.voxelSize();
    // The surface of a sheet is beside its mesh, by half of its thickness.
    const double beside = std::max(0.0, -*std::max_element(distances[0].begin(), distances[0].end()));
    const auto addVelocity = [&](Moment& moment, const Mesh& mesh) {
        if (options.seconds == 0) return;
        moment.sdf.surfaceVelocity =
            surfaceVelocity({mesh, velocitiesBetween(mMeshes, moment.part, options.seconds)},
                            kVelocityVoxels * finer.voxelSize(), mMoments[0].sdf.reach + beside, monitor);
    };
    addVelocity(mMoments[0], *mMeshes.from);
    addVelocity(mMoments[1], *mMeshes.to);
    for (size_t k = 0; k + 1 < mMoments.size();) {
        const double length = mMoments[k + 1].part - mMoments[k].part, part = mMoments[k].part + length / 2;
        const auto mesh = std::make_shared<const Mesh>(meshBetween(mMeshes, part));
        const Deviation deviation(distances[k], distancesAt(interpolated(k, part, *mesh).distance, *mesh),
                                  distances[k + 1], near, tolerance);
        if (deviation.relative <= 1 || length <= kShortest) {
            mError = std::max(mError, deviation.largest);
            mKnown = mKnown && deviation.relative <= 1;
            ++k;
            continue;
        }
        Moment between{part, sdfOf(levelSetLike(finer, voxel, mesh, monitor))};
        addVelocity(between, *mesh);
        const auto next = static_cast<std::ptrdiff_t>(k) + 1;
        distances.insert(distances.begin() + next, distancesAt(between.sdf.distance, *mesh));
        mMoments.insert(mMoments.begin() + next, between);
    }
}

/// Returns the third moment for quadratic interpolation: the one before the interval, or for the first interval the one
/// after it.
const DeformingLevelSet::Moment* DeformingLevelSet::thirdOf(size_t interval) const {
    if (interval > 0) return &mMoments[interval - 1];
    if (mMoments.size() > 2) return &mMoments[2];
    return mBefore ? &*mBefore : nullptr;
}

Sdf DeformingLevelSet::interpolated(size_t interval, double part, const Mesh& mesh) const {
    const Moment &a = mMoments[interval], &b = mMoments[interval + 1], *c = thirdOf(interval);
    const double length = b.part - a.part, s = (part - a.part) / length;
    if (s <= 0) return a.sdf;
    if (s >= 1) return b.sdf;
    Sdf sdf{.distance = a.sdf.distance, .bounds = boundsOf(mesh).padded(mVoxel)};
    double weightA = 1 - s, weightB = s;
    if (c) { // quadratic Lagrange interpolation
        weightA = (part - b.part) * (part - c->part) / ((a.part - b.part) * (a.part - c->part));
        weightB = (part - a.part) * (part - c->part) / ((b.part - a.part) * (b.part - c->part));
    }
    sdf.distance = weightA * a.sdf.distance + weightB * b.sdf.distance;
    sdf.lipschitz = std::abs(weightA) * a.sdf.lipschitz + std::abs(weightB) * b.sdf.lipschitz;
    sdf.reach = mKnown ? std::min(a.sdf.reach, b.sdf.reach) : 0;
    if (a.sdf.surfaceVelocity && b.sdf.surfaceVelocity) {
        const auto &from = *a.sdf.surfaceVelocity, &to = *b.sdf.surfaceVelocity;
        const auto between = [&](size_t axis) { return (1 - s) * from[axis] + s * to[axis]; };
        sdf.surfaceVelocity = {between(0), between(1), between(2)};
    }
    if (!c) return sdf;
    const double weightC = 1 - weightA - weightB;
    sdf.distance = sdf.distance + weightC * c->sdf.distance;
    sdf.lipschitz += std::abs(weightC) * c->sdf.lipschitz;
    return sdf;
}

Sdf DeformingLevelSet::at(double part) const {
    size_t k = 0;
    while (k + 2 < mMoments.size() && mMoments[k + 1].part < part) ++k;
    return interpolated(k, part, meshBetween(mMeshes, part));
}

} // namespace curlew
