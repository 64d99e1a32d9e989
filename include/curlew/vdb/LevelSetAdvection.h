// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/track/FlowMap.h"
#include "curlew/vdb/LevelSet.h"

#include <memory>

namespace curlew {

struct AdvectedLevelSet {
    LevelSet levelSet;
    size_t traced = 0;    ///< Voxels that were followed back.
    size_t kept = 0;      ///< Of these: some step left them in place (FlowMapResult).
    size_t unsettled = 0; ///< Voxels whose distance is that to a point of the surface nearby, not to the closest one.
    /// Where the edges between voxels cross the surface: how far the linear interpolant of the result is from zero
    /// there, in voxels. On average, and at most.
    double meanShift = 0, greatestShift = 0;
    bool restarted = false; ///< A sequence begins anew from this level set.
};

/// The surface of a level set as a flow carries it, from the time `begin` for `time` seconds (negative: backward).
///
/// φ(x, t) = φ₀(X(x, -t)), X the flow map, φ₀ the C² spline of the original: one interpolation of the original however
/// long the time is, so nothing diffuses. Evaluated where the surface is, which is found by following it, then made a
/// distance again, with the half width of the original, by the closest points of the surface: so the surface stays
/// where it is (docs/math.md). What gets thinner than a voxel is lost in the result, but not on the way to it.
///
/// Cost: about 7 voxels across for each voxel of the surface, each followed for all of the time; the distances cost
/// about as much as 20 steps of a simple flow.
/// By default the flow is followed to a thousandth of a voxel a step (forVoxels).
/// Throws ValueError where nothing is left that the voxels could resolve, ResourceError where the surface becomes too
/// large, and what FlowMap and FlowInTime throw.
AdvectedLevelSet advectLevelSet(const LevelSet& levelSet, const FlowInTime& flow, double begin, double time,
                                const FlowMapOptions& options = {}, const Monitor& monitor = {});

struct LevelSetSequenceOptions {
    FlowMapOptions map = {}; ///< By default as accurate as forVoxels().
    /// The flow map reaches back so many seconds at most; then the level set of that moment becomes the original.
    /// Infinity: never. Each restart resamples the surface once: that costs about 0.001 voxels where it is smooth, but
    /// sheets of two voxels and less are lost or fattened (docs/math.md has figures).
    double horizon = std::numeric_limits<double>::infinity();
};

/// The same, moment by moment. It keeps the surface, so that finding it again costs no more than the time between two
/// moments, and the flow map at its voxels. In a steady flow the origins of voxels that are still near the surface
/// are only continued, X(x, -t - s) = X(X(x, -t), -s), without interpolation; new voxels are followed back to the last
/// restart. In a flow that changes all are. So the cost of a moment is bounded by the horizon, not by the length of the
/// sequence; and without a horizon nothing is lost, as if each moment were computed on its own.
class LevelSetSequence {
  public:
    LevelSetSequence(const LevelSet& levelSet, FlowInTime flow, double begin,
                     const LevelSetSequenceOptions& options = {}, const Monitor& monitor = {});
    ~LevelSetSequence();
    LevelSetSequence(LevelSetSequence&&) noexcept;
    LevelSetSequence& operator=(LevelSetSequence&&) noexcept;

    double time() const;
    /// The level set at another time, mostly a later one. Throws as advectLevelSet does; then the sequence is where it
    /// was.
    AdvectedLevelSet advance(double time, const Monitor& monitor = {});

  private:
    class Implementation;
    std::unique_ptr<Implementation> mImplementation;
};

/// OpenVDB's LevelSetAdvection (HJ-WENO5, TVD Runge-Kutta of order 3, as many steps as its CFL condition asks for),
/// driven by the flow itself instead of a grid of it: the yardstick. Beyond its wall the flow goes on as in FlowMap.
/// Throws ValueError where nothing is left.
LevelSet advectLevelSetWeno5(const LevelSet& levelSet, const FlowInTime& flow, double begin, double time,
                             const Monitor& monitor = {});

} // namespace curlew
