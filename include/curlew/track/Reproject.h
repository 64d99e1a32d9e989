// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/flow/Flow.h"

#include <cstdint>
#include <string_view>

namespace curlew {

enum class Reprojection {
    none,        ///< The integrator's errors stand.
    newton,      ///< One function after the other (ICN Eq. 12).
    gaussNewton, ///< Both at once, by the smallest correction (ICN Eq. 10 and 11).
};
/// In the order of the enumerators.
inline constexpr std::array<std::string_view, 3> kReprojectionNames{"none", "newton", "gauss-newton"};

/// How the steps along a flow are moved back onto tracks; part of the options of all who follow one.
struct ReprojectionOptions {
    Reprojection method = Reprojection::gaussNewton;
    double tolerance = 1e-8; ///< On the residuals of f and g, relative to their root mean squares over the domain.
    int iterations = 10;     ///< Corrections per step, at most.
    int maxSubdivisions = 8; ///< A step that is not accepted is halved up to this many times.

    /// Throws ValueError for a value out of range, and for reprojection in a flow without tracks.
    void validate(bool hasTracks) const;
};

/// The same with tolerances in the units of each potential, for reproject().
template <int N>
struct ReprojectOptionsN {
    Reprojection method = Reprojection::gaussNewton;
    /// On |f_k - its value on the track|, in the units of each potential.
    std::array<double, size_t{N - 1}> tolerance = filled(1e-9);
    int iterations = 10; ///< At most so many corrections.

  private:
    static std::array<double, size_t{N - 1}> filled(double value) {
        std::array<double, size_t{N - 1}> all;
        all.fill(value);
        return all;
    }
};
using ReprojectOptions = ReprojectOptionsN<3>;

/// Options for reproject() in a flow whose potentials have these root mean squares.
template <int N>
ReprojectOptionsN<N> inUnitsOf(const FlowMagnitudesN<N>& rms, const ReprojectionOptions& options);

/// The track that each point of a batch belongs to: the value of every potential (in 3D of f, then g).
template <int N>
using TrackBatchN = std::array<std::array<double, kBatch>, size_t{N - 1}>;
using TrackBatch = TrackBatchN<3>;

/// The state of a batch after reprojection.
template <int N>
struct ReprojectedBatchN {
    VecBatchN<double, N> velocity;      ///< At the final position; comes for free with the last residual.
    TrackBatchN<N> residual;            ///< Potentials less the track's, at the final position.
    std::array<int, kBatch> iterations; ///< Corrections that were made.
    std::array<bool, kBatch> converged; ///< All residuals are within their tolerance.
};
using ReprojectedBatch = ReprojectedBatchN<3>;

/// Moves each point back onto its track (ICN Algorithm 1). A correction (of each function, for Newton) is never longer
/// than limit[i], the length of the step just taken: without a limit, Gauss-Newton throws points across walls. Where
/// gradients are nearly parallel the track is ill-defined and the flow slow: there the functions that are farthest off
/// are corrected, and those that depend on them are not; where all gradients vanish, the point is left. No point
/// influences another. Throws ValueError for a flow without tracks, unless the method is `none`.
template <int N>
void reproject(const FlowN<N>& flow, PointBatchN<N>& points, const TrackBatchN<N>& track,
               const std::array<double, kBatch>& limit, const ReprojectOptionsN<N>& options,
               ReprojectedBatchN<N>& result);

/// What the flow has at the points of a batch.
template <int N>
struct FlowBatchN {
    typename FlowN<N>::template Jets<double> potentials;
    VecBatchN<double, N> velocity;
};

/// What is wanted for a point.
enum class Correction : uint8_t {
    none, ///< It is left where it is.
    once, ///< One correction by Gauss-Newton, and no look at what it comes to: the flow need not be evaluated for it.
          ///< What is returned beside the position is that of the place before.
    fully ///< Until it is within the tolerance.
};

/// The same where `here` has been evaluated at the points already (it is overwritten).
template <int N>
void reproject(const FlowN<N>& flow, PointBatchN<N>& points, const TrackBatchN<N>& track,
               const std::array<double, kBatch>& limit, const ReprojectOptionsN<N>& options,
               const std::array<Correction, kBatch>& wanted, FlowBatchN<N>& here, ReprojectedBatchN<N>& result);

} // namespace curlew
