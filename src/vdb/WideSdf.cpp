// SPDX-License-Identifier: Apache-2.0
#include "curlew/vdb/WideSdf.h"

#include "SolidChecks.h"
#include "curlew/base/Error.h"
#include "curlew/field/ForEachBatch.h"
#include "curlew/math/Fade.h"
#include "curlew/vdb/LevelSetMesh.h"
#include "curlew/vdb/Openvdb.h"

#include <algorithm>
#include <optional>
#include <vector>

namespace curlew {

namespace {

constexpr double kOneBand = 20;  ///< Half width in voxels up to which one band is made.
constexpr double kFineBand = 12; ///< Half width in voxels of a band that larger voxels continue.
constexpr double kLarger = 3;    ///< Ratio of the sizes of voxels.

/// `near` at the surface, `far` beyond `width` world units from it.
struct Continued {
    ScalarField near, far;
    double width;

    template <int Order, class T>
    void evalBatch(const PointBatch& points, JetBatch<T, Order>& jets) const {
        JetBatch<T, Order> beyond;
        near.eval(points, jets);
        far.eval(points, beyond);
        for (int i = 0; i < points.size; ++i) jets.set(i, blend(jets[i], beyond[i]));
    }
    template <int Order, class T>
    OnLattice<T, Order> onLattice(const PointLattice& lattice) const {
        return [this, nearOn = near.onLattice<T, Order>(lattice), farOn = far.onLattice<T, Order>(lattice)](
                   const LatticeBatch& batch, JetBatch<T, Order>& jets) {
            JetBatch<T, Order> beyond;
            nearOn(batch, jets);
            farOn(batch, beyond);
            for (int i = 0; i < batch.points.size; ++i) jets.set(i, blend(jets[i], beyond[i]));
        };
    }
    template <int Order>
    Jet<Symbol<float>, 3, Order> symbols(SymbolModule& module, const Vec<Symbol<double>, 3>& p) const {
        return blend(near.symbols<Order>(module, p), far.symbols<Order>(module, p));
    }
    Interval range() const {
        const Interval a = near.range(), b = far.range();
        return {std::min(a.lower, b.lower), std::max(a.upper, b.upper)};
    }

  private:
    template <class T, int Order>
    Jet<T, 3, Order> blend(const Jet<T, 3, Order>& close, const Jet<T, 3, Order>& beyond) const {
        const T k = static_cast<T>(1 / width), size = abs(close.value);
        // An even function of the distance.
        const T sign = select(close.value < T(0), T(-1), T(1));
        const Univariate<T> fade = quinticFade(size * k);
        const auto weight = compose(close, Univariate<T>{fade.value, sign * k * fade.first, k * k * fade.second,
                                                         sign * k * k * k * fade.third});
        return select(size >= static_cast<T>(width), beyond, close + weight * (beyond - close));
    }
};

/// Returns the same surface with larger voxels; nullopt if they do not resolve it.
std::optional<LevelSet> coarsened(const LevelSet& levelSet, const Monitor& monitor) {
    const auto mesh = levelSet.mesh ? levelSet.mesh : std::make_shared<const Mesh>(levelSetToMesh(levelSet));
    try {
        return meshToLevelSet(mesh, {.voxel = kLarger * levelSet.voxelSize(), .thickness = thicknessOf(*levelSet.grid)},
                              monitor);
    } catch (const ValueError&) {
        return {};
    }
}

/// Returns the longest gradient at every fourth voxel of a band along each axis.
double steepestAt(const openvdb::FloatGrid& band, const ScalarField& distance, const Monitor& monitor) {
    std::vector<Vec3d> positions;
    for (auto value = band.cbeginValueOn(); value; ++value) {
        const openvdb::Coord ijk = value.getCoord();
        if (((ijk[0] | ijk[1] | ijk[2]) & 3) != 0) continue;
        const auto p = band.indexToWorld(ijk);
        positions.push_back({{p[0], p[1], p[2]}});
    }
    std::vector<double> steepest(positions.size());
    forEachBatch(
        PointsBy{positions.size(), [&](size_t k) { return positions[k]; }},
        [&](const PointBatch& points, size_t begin) {
            JetBatch<double, 1> d;
            distance.eval(points, d);
            for (int i = 0; i < points.size; ++i) steepest[begin + static_cast<size_t>(i)] = length(d[i].gradient);
        },
        monitor);
    return steepest.empty() ? 1 : *std::max_element(steepest.begin(), steepest.end());
}

} // namespace

Sdf sdfUpTo(const LevelSet& levelSet, double distance, const Monitor& monitor) {
    const double voxel = levelSet.voxelSize(), halfWidth = distance / voxel + kSplineSupport;
    if (halfWidth <= std::max(kOneBand, levelSet.halfWidth())) return sdfOf(widened(levelSet, halfWidth, monitor));
    const LevelSet fine = widened(levelSet, kFineBand, monitor);
    const auto coarse = coarsened(fine, monitor);
    if (!coarse) return sdfOf(widened(levelSet, halfWidth, monitor));
    Sdf near = sdfOf(fine);
    const Sdf far = sdfUpTo(*coarse, distance, monitor);
    near.distance = ScalarField(Continued{near.distance, far.distance, near.reach});
    near.lipschitz = std::max(far.lipschitz, steepestAt(*fine.grid, near.distance, monitor));
    near.reach = far.reach;
    return near;
}

} // namespace curlew
