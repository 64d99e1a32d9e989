// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/base/Monitor.h"
#include "curlew/flow/Domain.h"
#include "curlew/track/Points.h"

namespace curlew {

enum class ScatterOn {
    volume,  ///< Uniform by volume.
    surface, ///< On the domain's wall or at a distance from it; uniform by area.
};
inline constexpr std::array<std::string_view, 2> kScatterOnNames{"volume", "surface"};

struct ScatterOptions {
    uint64_t seed = 0;
    ScatterOn on = ScatterOn::volume;
    /// For ScatterOn::surface: the signed distance of the points, world units.
    double level = 0;
    /// Relative density of the points: each point is accepted with this probability. Clamped to 0 … 1.
    std::optional<ScalarField> density = {};
    /// If given, no point lies where this domain's wall does not allow it; its box is ignored.
    std::optional<Domain> clear = {};
    std::optional<Box> within = {}; ///< If given, no point lies outside this box.
};

/// Returns `count` points, uniform in the domain, with ids 0 … count-1. Point k depends only on the seed and k. Throws
/// ValueError if the domain is empty or infinite.
Points scatter(const Domain& domain, size_t count, uint64_t seed, const Monitor& monitor = {});

/// Returns the points with the ids first … first+count-1 of the sequence that scatter() gives for a larger `count`.
Points scatterFrom(const Domain& domain, int64_t first, size_t count, uint64_t seed, const Monitor& monitor = {});

/// The same with all options. Points on a surface are drawn uniformly from a shell around it, whose half thickness is
/// 1/512 of the longest edge of the domain's box, and moved onto it along the gradient. Their density per area is
/// uniform up to a relative error of (half thickness / radius of curvature)², except near sharp edges. They lie at the
/// level to within 1e-9 of the box's longest edge. They may lie outside the box's faces by less than the level and the
/// half thickness together, unless ScatterOptions::within forbids it. Also throws ValueError if a surface is requested
/// but there is no wall or the surface does not meet the box, or if density, wall and box allow hardly any point.
Points scatterFrom(const Domain& domain, int64_t first, size_t count, const ScatterOptions& options,
                   const Monitor& monitor = {});

} // namespace curlew
