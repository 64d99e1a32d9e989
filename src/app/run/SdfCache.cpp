// SPDX-License-Identifier: Apache-2.0
#include "SdfCache.h"

#include "curlew/field/Algebra.h"
#include "curlew/field/RigidMotion.h"
#include "curlew/vdb/Openvdb.h"
#include "curlew/vdb/WideSdf.h"

#include <algorithm>
#include <numbers>

namespace curlew::app {

namespace {

/// How far the points of a deforming mesh may be from its level set between frames: as a fraction of the distance that
/// is requested, which is the width of a layer; and at least, for thin bodies, this many voxels.
constexpr double kTolerance = 0.2, kMinTolerance = 0.5;

/// The distance up to which level sets between frames are made: one of few, so that all layers of a scene, and points
/// emitted on the surface, share them, and successive frames share those of the frame between them.
struct Reach {
    double distance = 8, tolerance = kMinTolerance; ///< In voxels. Distances are 8, 11.3, 16, ….

    explicit Reach(double requested) {
        while (distance < requested) {
            tolerance = std::max(tolerance, kTolerance * distance); // of the smallest distance that it is for
            distance *= std::numbers::sqrt2;
        }
    }
};

double voxelOf(const GridValue& value) { return value.grid->voxelSize()[0]; }

/// Returns the surface between two frames.
Sdf between(const Sdf& from, const Sdf& to, double part) {
    if (part <= 0) return from;
    Box bounds = from.bounds;
    for (int axis = 0; axis < 3; ++axis) {
        bounds.lower[axis] = std::min(bounds.lower[axis], to.bounds.lower[axis]);
        bounds.upper[axis] = std::max(bounds.upper[axis], to.bounds.upper[axis]);
    }
    return {.distance = (1 - part) * from.distance + part * to.distance,
            .bounds = bounds,
            .reach = 0,
            .lipschitz = std::max(from.lipschitz, to.lipschitz)};
}

} // namespace

const SdfCache::Entry& SdfCache::entry(const GridValue& value, double distance, const Console& console) {
    for (const Entry& known : mEntries)
        if ((known.distance == distance || std::max(known.distance, distance) <= known.given) &&
            known.grid.lock() == value.grid)
            return known;
    LevelSet levelSet = levelSetOf(value.grid);
    levelSet.mesh = value.mesh;
    const double halfWidth = distance / levelSet.voxelSize() + kSplineSupport;
    if (halfWidth > levelSet.halfWidth())
        console.detail(fmt::format("level set '{}': band widened from {:.3g} to {:.3g} voxels", value.grid->getName(),
                                   levelSet.halfWidth(), halfWidth));
    Sdf sdf = sdfUpTo(levelSet, distance, console.follow("widening the band"));
    if (mEntries.size() == kMaxEntries) mEntries.erase(mEntries.begin());
    const double given = (levelSet.halfWidth() - kSplineSupport) * levelSet.voxelSize();
    return mEntries.emplace_back(Entry{value.grid, distance, given, levelSet.voxelSize(), std::move(sdf)});
}

Sdf SdfCache::sdf(const GridValue& value, double distance, const Console& console) {
    if (value.body) {
        const Entry& first = entry(*value.body->first, distance, console);
        Sdf sdf = inPose(first.sdf, value.body->home, value.body->now);
        if (const auto box = boxOf(Value(value))) sdf.bounds = box->padded(first.voxel);
        return sdf;
    }
    if (!value.earlier) return entry(value, distance, console).sdf;
    if (Deformation* deformation = deformationTo(value))
        return deforming(*deformation, distance, console).at(value.part);
    if (value.part >= 1) return entry(value, distance, console).sdf;
    if (value.part <= 0) return entry(*value.earlier, distance, console).sdf;
    const Sdf from = entry(*value.earlier, distance, console).sdf;
    return between(from, entry(value, distance, console).sdf, value.part);
}

void SdfCache::addDeformation(const GridValue* before, const GridValue& from, const GridValue& to,
                              const MeshKeys& meshes, double seconds) {
    if (std::any_of(mDeformations.begin(), mDeformations.end(),
                    [&](const Deformation& known) { return known.from.grid == from.grid && known.to.grid == to.grid; }))
        return;
    if (mDeformations.size() == kMaxDeformations) mDeformations.pop_front();
    mDeformations.push_back({before ? std::optional(*before) : std::nullopt, from, to, meshes, seconds});
}

SdfCache::Deformation* SdfCache::deformationTo(const GridValue& value) {
    const auto found = std::find_if(mDeformations.begin(), mDeformations.end(), [&](const Deformation& one) {
        return one.from.grid == value.earlier->grid && one.to.grid == value.grid;
    });
    return found != mDeformations.end() ? &*found : nullptr;
}

const DeformingLevelSet& SdfCache::deforming(Deformation& deformation, double distance, const Console& console) {
    const auto [finer, coarser] = std::minmax({voxelOf(deformation.from), voxelOf(deformation.to)});
    const Reach reach(distance / finer);
    for (const auto& [reached, known] : deformation.known)
        if (reached == reach.distance) return known;
    const auto wide = [&](const GridValue& value) {
        return levelSet(value, std::max(reach.distance * voxelOf(value), distance), console);
    };
    const LevelSet from = wide(deformation.from), to = wide(deformation.to);
    const auto before = deformation.before ? std::optional(wide(*deformation.before)) : std::nullopt;
    const double minTolerance = kMinTolerance * coarser;
    const DeformingLevelSet made(before, from, to, deformation.meshes,
                                 {.tolerance = std::max(reach.tolerance * finer, minTolerance),
                                  .minTolerance = minTolerance,
                                  .seconds = deformation.seconds},
                                 console.follow("interpolating level sets between frames"));
    console.detail(fmt::format(
        "level set '{}': {} intermediate level sets between two frames; points of the mesh are within {:.2g} voxels",
        deformation.to.grid->getName(), made.levelSetsBetween(), made.error() / coarser));
    return deformation.known.emplace_back(reach.distance, made).second;
}

LevelSet SdfCache::levelSet(const GridValue& value, double distance, const Console& console) {
    for (const Band& known : mBands)
        if (known.distance == distance && known.grid.lock() == value.grid) return known.levelSet;
    LevelSet narrow = levelSetOf(value.grid);
    narrow.mesh = value.mesh;
    const double halfWidth = distance / narrow.voxelSize() + kSplineSupport;
    const LevelSet wide = widened(narrow, halfWidth, console.follow("widening the band"));
    std::erase_if(mBands, [](const Band& known) { return known.grid.expired(); });
    if (mBands.size() == kMaxBands) mBands.erase(mBands.begin());
    return mBands.emplace_back(Band{value.grid, distance, wide}).levelSet;
}

} // namespace curlew::app
