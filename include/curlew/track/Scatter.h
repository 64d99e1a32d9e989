// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/base/Monitor.h"
#include "curlew/flow/Domain.h"
#include "curlew/track/Points.h"

namespace curlew {

enum class ScatterOn {
    volume,  ///< Uniform by volume.
    surface, ///< On the wall of the domain, or beside it; uniform by area.
};
inline constexpr std::array<std::string_view, 2> kScatterOnNames{"volume", "surface"};

struct ScatterOptions {
    uint64_t seed = 0;
    ScatterOn on = ScatterOn::volume;
    /// Of points on the surface: the signed distance at which they lie, world units.
    double level = 0;
    /// How dense the points are, from 0 (none) to 1: a point is taken with this probability. Values beyond are clamped.
    std::optional<ScalarField> density = {};
    /// If given, no point lies where this domain's wall does not allow it; its box does not count.
    std::optional<Domain> clear = {};
};

/// `count` points, uniform in the domain, with ids 0 … count-1. Point k depends on the seed and k alone.
/// Throws ValueError where the domain is empty or infinite.
Points scatter(const Domain& domain, size_t count, uint64_t seed, const Monitor& monitor = {});

/// The points from `first` on of those that a larger `count` would give: with ids first … first+count-1.
Points scatterFrom(const Domain& domain, int64_t first, size_t count, uint64_t seed, const Monitor& monitor = {});

/// The same with all options. Points on a surface are drawn uniformly from a shell about it, whose half thickness is
/// 1/512 of the longest edge of the domain's box, and put onto it along the gradient: their density per area is
/// uniform but for a part of (half thickness / radius of curvature)², and beside sharp edges. They lie at the level to
/// within 1e-9 of the box's longest edge, on both sides of the box's faces by less than the level and the half
/// thickness. Throws ValueError also for a surface without a wall, or one that does not meet the box, and if hardly any
/// point is allowed by density and wall.
Points scatterFrom(const Domain& domain, int64_t first, size_t count, const ScatterOptions& options,
                   const Monitor& monitor = {});

} // namespace curlew
