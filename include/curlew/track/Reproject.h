// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/flow/Flow.h"

#include <cstdint>
#include <string_view>

namespace curlew {

enum class Reprojection {
    none,        ///< No reprojection: the integrator's errors remain.
    newton,      ///< One potential after the other (ICN Eq. 12); from the second pass on, each is corrected by the
                 ///< smallest move that leaves those before it as they are.
    gaussNewton, ///< All potentials at once, by the smallest correction (ICN Eq. 10 and 11).
};
/// In the order of the enumerators.
inline constexpr std::array<std::string_view, 3> kReprojectionNames{"none", "newton", "gauss-newton"};

/// How steps along a flow are moved back onto tracks. Part of the options of every function that follows a flow.
struct ReprojectionOptions {
    Reprojection method = Reprojection::gaussNewton;
    double tolerance = 1e-8; ///< On the residuals of f and g, relative to their root mean squares over the domain.
    int iterations = 10;     ///< Maximum number of corrections per step.
    int maxSubdivisions = 8; ///< A step that is not accepted is halved up to this many times.

    /// Throws ValueError if a value is out of range, or if a method is chosen for a flow without tracks.
    void validate(bool hasTracks) const;
};

/// The same with tolerances in the units of each potential, for reproject().
template <int N>
struct ReprojectOptionsN {
    Reprojection method = Reprojection::gaussNewton;
    /// On |f_k - its value on the track|, in the units of each potential.
    std::array<double, size_t{N - 1}> tolerance = filled(1e-9);
    int iterations = 10; ///< Maximum number of corrections.

  private:
    static std::array<double, size_t{N - 1}> filled(double value) {
        std::array<double, size_t{N - 1}> all;
        all.fill(value);
        return all;
    }
};
using ReprojectOptions = ReprojectOptionsN<3>;

/// Returns options for reproject() in a flow whose potentials have these root mean squares.
template <int N>
ReprojectOptionsN<N> inUnitsOf(const FlowRmsN<N>& rms, const ReprojectionOptions& options);

/// The track that each point of a batch belongs to: the value of every potential (in 3D of f, then g).
template <int N>
using TrackBatchN = std::array<std::array<double, kBatch>, size_t{N - 1}>;
using TrackBatch = TrackBatchN<3>;

/// The state of a batch after reprojection.
template <int N>
struct ReprojectedBatchN {
    VecBatchN<double, N> velocity;      ///< At the final position; a by-product of the last residual.
    TrackBatchN<N> residual;            ///< Potentials minus the track's values, at the final position.
    std::array<int, kBatch> iterations; ///< Number of corrections.
    std::array<bool, kBatch> converged; ///< All residuals are within their tolerance.
};
using ReprojectedBatch = ReprojectedBatchN<3>;

/// Moves each point back onto its track (ICN Algorithm 1). A correction (for Newton, that of each potential) is at most
/// limit[i] long, the length of the step just taken: without a limit, Gauss-Newton would throw points across walls.
/// Where gradients are nearly parallel, the track is ill-defined and the flow slow: there only the potentials with the
/// largest residuals are corrected, not those that depend on them. Where all gradients vanish, the point stays in
/// place. No point influences another. Throws ValueError if the flow has no tracks, unless the method is `none`.
template <int N>
void reproject(const FlowN<N>& flow, PointBatchN<N>& points, const TrackBatchN<N>& track,
               const std::array<double, kBatch>& limit, const ReprojectOptionsN<N>& options,
               ReprojectedBatchN<N>& result);

/// The flow at the points of a batch.
template <int N>
struct FlowBatchN {
    typename FlowN<N>::template Jets<double> potentials;
    VecBatchN<double, N> velocity;
};

/// How to correct a point.
enum class Correction : uint8_t {
    none, ///< The point stays in place.
    /// One Gauss-Newton correction without evaluating the flow at the corrected position. All results except the
    /// position are those at the position before.
    once,
    fully ///< Correct until the residuals are within the tolerance.
};

/// The same if the caller has already evaluated `here` at the points; overwrites `here`.
template <int N>
void reproject(const FlowN<N>& flow, PointBatchN<N>& points, const TrackBatchN<N>& track,
               const std::array<double, kBatch>& limit, const ReprojectOptionsN<N>& options,
               const std::array<Correction, kBatch>& wanted, FlowBatchN<N>& here, ReprojectedBatchN<N>& result);

} // namespace curlew
