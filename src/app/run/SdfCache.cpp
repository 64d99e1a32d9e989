// SPDX-License-Identifier: Apache-2.0
#include "SdfCache.h"

#include "curlew/field/Algebra.h"
#include "curlew/field/RigidMotion.h"
#include "curlew/vdb/WideSdf.h"

#include <algorithm>

namespace curlew::app {

namespace {

/// How far the points of a deforming mesh may be from its level set between frames: as a fraction of the distance that
/// is requested, which is the width of a layer; and at least, for thin bodies, this many voxels.
constexpr double kWayTolerance = 0.2, kLeastTolerance = 0.5;

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
        if (known.distance == distance && known.grid.lock() == value.grid) return known;
    LevelSet levelSet = levelSetOf(value.grid);
    levelSet.mesh = value.mesh;
    const double halfWidth = distance / levelSet.voxelSize() + kSplineSupport;
    if (halfWidth > levelSet.halfWidth())
        console.detail(fmt::format("level set '{}': band widened from {:.3g} to {:.3g} voxels", value.grid->getName(),
                                   levelSet.halfWidth(), halfWidth));
    Sdf sdf = sdfUpTo(levelSet, distance, console.follow("widening the band"));
    if (mEntries.size() == kMost) mEntries.erase(mEntries.begin());
    return mEntries.emplace_back(Entry{value.grid, distance, levelSet.voxelSize(), std::move(sdf)});
}

Sdf SdfCache::sdf(const GridValue& value, double distance, const Console& console) {
    if (value.body) {
        const Entry& first = entry(*value.body->first, distance, console);
        Sdf sdf = inPose(first.sdf, value.body->home, value.body->now);
        if (const auto box = boxOf(Value(value))) sdf.bounds = box->padded(first.voxel);
        return sdf;
    }
    if (!value.earlier) return entry(value, distance, console).sdf;
    if (Way* way = wayTo(value)) return known(*way, distance, console).at(value.part);
    if (value.part >= 1) return entry(value, distance, console).sdf;
    const Sdf from = entry(*value.earlier, distance, console).sdf;
    return between(from, entry(value, distance, console).sdf, value.part);
}

void SdfCache::setWay(const GridValue* before, const GridValue& from, const GridValue& to, const MeshKeys& meshes,
                      double seconds) {
    if (std::any_of(mWays.begin(), mWays.end(),
                    [&](const Way& way) { return way.from.grid == from.grid && way.to.grid == to.grid; }))
        return;
    if (mWays.size() == kMostWays) mWays.pop_front();
    mWays.push_back({before ? std::optional(*before) : std::nullopt, from, to, meshes, seconds});
}

SdfCache::Way* SdfCache::wayTo(const GridValue& value) {
    const auto way = std::find_if(mWays.begin(), mWays.end(), [&](const Way& one) {
        return one.from.grid == value.earlier->grid && one.to.grid == value.grid;
    });
    return way != mWays.end() ? &*way : nullptr;
}

const LevelSetWay& SdfCache::known(Way& way, double distance, const Console& console) {
    for (const auto& [reached, known] : way.known)
        if (reached == distance) return known;
    const auto wide = [&](const GridValue& value) { return levelSet(value, distance, console); };
    const LevelSet from = wide(way.from), to = wide(way.to);
    const auto before = way.before ? std::optional(wide(*way.before)) : std::nullopt;
    const double voxel = std::max(from.voxelSize(), to.voxelSize());
    const double least = kLeastTolerance * voxel;
    const LevelSetWay made(
        before, from, to, way.meshes,
        {.tolerance = std::max(kWayTolerance * distance, least), .leastTolerance = least, .seconds = way.seconds},
        console.follow("interpolating level sets between frames"));
    console.detail(fmt::format(
        "level set '{}': {} intermediate level sets between two frames; points of the mesh are within {:.2g} voxels",
        way.to.grid->getName(), made.levelSetsBetween(), made.error() / voxel));
    return way.known.emplace_back(distance, made).second;
}

LevelSet SdfCache::levelSet(const GridValue& value, double distance, const Console& console) {
    for (const Band& known : mBands)
        if (known.distance == distance && known.grid.lock() == value.grid) return known.levelSet;
    LevelSet narrow = levelSetOf(value.grid);
    narrow.mesh = value.mesh;
    const double halfWidth = distance / narrow.voxelSize() + kSplineSupport;
    const LevelSet wide = widened(narrow, halfWidth, console.follow("widening the band"));
    if (mBands.size() == kMostBands) mBands.erase(mBands.begin());
    return mBands.emplace_back(Band{value.grid, distance, wide}).levelSet;
}

} // namespace curlew::app
