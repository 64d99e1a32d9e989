// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/base/Monitor.h"
#include "curlew/flow/Flow.h"

#include <string_view>
#include <vector>

namespace curlew {

/// How points follow a sum Σ ∇f_k × ∇g_k. A sum has no tracks, but each of its terms has. Splitting composes the flows
/// of the terms, each on its own tracks and guarded at the wall. Every factor keeps volumes and sides, so the
/// composition does too, whatever the step: particles stay as dense as they were even where steps are far too long for
/// the places to be right. Its price is an error of its own in the place: none of the labels f_k, g_k is constant along
/// a streamline of the sum, so there is nothing that would correct it. docs/math.md has measurements.
enum class Splitting {
    none,    ///< The sum as a whole, with the order of the scheme; its wall is guarded, but it is not reprojected.
    strang,  ///< Half steps of the terms but the last, a whole one of the last, half steps back: second order (Strang,
             ///< "On the construction and comparison of difference schemes", 1968).
    yoshida, ///< Three of these by the triple jump, the one in the middle backward: fourth order (Yoshida,
             ///< "Construction of higher order symplectic integrators", 1990).
};
/// In the order of the enumerators.
inline constexpr std::array<std::string_view, 3> kSplittingNames{"none", "strang", "yoshida"};

/// A part of a step: the flow of one term for a fraction of the time step, which may be negative.
struct SplitFactor {
    size_t term = 0;
    double fraction = 1;
    friend bool operator==(const SplitFactor&, const SplitFactor&) = default;
};

/// The factors of a step of a sum of `terms` terms in the order in which they move a point. The fractions of each term
/// add up to 1, and the list read backward is the same. Throws ValueError for `none`, and for no term.
std::vector<SplitFactor> compositionOf(Splitting splitting, size_t terms);

/// What a flow, or one term of it, does at the wall of the domain.
struct AtWall {
    double speed = 0; ///< Its root mean square over the domain, world units per second.
    double flux = 0;  ///< The greatest of its speed across the wall, relative to `speed`.
    /// Its streamlines do not cross the wall, up to rounding.
    bool tangent() const { return flux <= 1e-6; }
};

struct SumAtWall {
    AtWall whole;              ///< The sum: what goes through the wall in its terms may cancel.
    std::vector<AtWall> terms; ///< Each by itself; none for a flow without a wall.
};

/// Judges a flow and each of its terms from the same points of the wall at every call, found by Newton's method on the
/// distance. Throws ValueError for an empty or infinite domain.
SumAtWall sumAtWall(const Flow& flow, size_t samples = 2000, const Monitor& monitor = {});

} // namespace curlew
