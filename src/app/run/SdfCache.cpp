// SPDX-License-Identifier: Apache-2.0
#include "SdfCache.h"

#include "curlew/field/Algebra.h"

#include <algorithm>

namespace curlew::app {

namespace {

/// The surface on its way from one to the other.
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
            .steepness = std::max(from.steepness, to.steepness)};
}

} // namespace

const SdfCache::Entry& SdfCache::entry(const GridValue& value, double distance, const Console& console) {
    for (const Entry& known : mEntries)
        if (known.distance == distance && known.grid.lock() == value.grid) return known;
    LevelSet levelSet = levelSetOf(value.grid);
    levelSet.mesh = value.mesh;
    const double halfWidth = distance / levelSet.voxelSize() + kSplineSupport;
    if (halfWidth > levelSet.halfWidth()) {
        console.detail(fmt::format("level set '{}': band widened from {:.3g} to {:.3g} voxels", value.grid->getName(),
                                   levelSet.halfWidth(), halfWidth));
        levelSet = widened(levelSet, halfWidth, console.follow("widening the band"));
    }
    Sdf sdf = sdfOf(levelSet);
    if (mEntries.size() == kMost) mEntries.erase(mEntries.begin());
    return mEntries.emplace_back(Entry{value.grid, distance, std::move(levelSet), std::move(sdf)});
}

Sdf SdfCache::sdf(const GridValue& value, double distance, const Console& console) {
    if (!value.earlier || value.part >= 1) return entry(value, distance, console).sdf;
    const Sdf from = entry(*value.earlier, distance, console).sdf;
    return between(from, entry(value, distance, console).sdf, value.part);
}

LevelSet SdfCache::levelSet(const GridValue& value, double distance, const Console& console) {
    return entry(value, distance, console).levelSet;
}

} // namespace curlew::app
