// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <string_view>
#include <vector>

namespace curlew {

/// How points follow a sum Σ ∇f_k × ∇g_k. A sum has no tracks, but each of its terms does. Splitting composes the flows
/// of the terms, each on its own tracks and guarded at the wall. Every factor preserves volumes and sides, so the
/// composition does too, for any step size: the particle density stays right even if steps are far too long for
/// accurate positions. The price is a splitting error in the position. Reprojection cannot correct it, because none of
/// the labels f_k, g_k is constant along a streamline of the sum. docs/math.md has measurements.
enum class Splitting {
    none, ///< The sum as a whole, with the order of the scheme; guarded at its wall but not reprojected.
    /// Half steps of all terms but the last, a whole step of the last, half steps in reverse order: second order
    /// (Strang, "On the construction and comparison of difference schemes", 1968).
    strang,
    /// Three Strang steps by the triple jump, the middle one backward in time: fourth order (Yoshida, "Construction of
    /// higher order symplectic integrators", 1990).
    yoshida,
};
/// In the order of the enumerators.
inline constexpr std::array<std::string_view, 3> kSplittingNames{"none", "strang", "yoshida"};

/// One factor of a step: the flow of one term for a fraction of the time step, which may be negative.
struct SplitFactor {
    size_t term = 0;
    double fraction = 1;
    friend bool operator==(const SplitFactor&, const SplitFactor&) = default;
};

/// Returns the factors of a step of a sum of `terms` terms, in the order in which they move a point. The fractions of
/// each term add up to 1, and the list is symmetric. Throws ValueError if `splitting` is `none` or there is no term.
std::vector<SplitFactor> compositionOf(Splitting splitting, size_t terms);

} // namespace curlew
