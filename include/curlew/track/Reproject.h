#pragma once

#include "curlew/flow/Dfvn.h"

namespace curlew {

enum class Reprojection {
    none,        ///< The integrator's errors stand.
    newton,      ///< One function after the other (ICN Eq. 12).
    gaussNewton, ///< Both at once, by the smallest correction (ICN Eq. 10 and 11).
};

struct ReprojectOptions {
    Reprojection method = Reprojection::gaussNewton;
    double toleranceF = 1e-9; ///< On |f - f0|, in the units of f.
    double toleranceG = 1e-9; ///< On |g - g0|, in the units of g.
    int iterations = 10;      ///< At most so many corrections.
};

/// The track that each point of a batch belongs to: f = f0, g = g0.
struct TrackBatch {
    alignas(64) std::array<double, kBatch> f, g;
};

/// The state of a batch after reprojection.
struct ReprojectedBatch {
    VecBatch<double> velocity;                       ///< At the final position; comes for free with the last residual.
    std::array<double, kBatch> residualF, residualG; ///< f - f0 and g - g0 at the final position.
    std::array<int, kBatch> iterations;              ///< Corrections that were made.
    std::array<bool, kBatch> converged;              ///< Both residuals are within their tolerance.
};

/// Moves each point back onto its track. A correction (of each function, for Newton) is never longer than limit[i] (the
/// length of the step just taken:
/// without a limit, Gauss-Newton throws points across walls). Where the gradients are nearly parallel the
/// track is ill-defined and the flow slow: there the worse of the two functions is corrected alone; where its gradient
/// vanishes, the point is left. No point influences another.
void reproject(const Dfvn& flow, PointBatch& points, const TrackBatch& track, const std::array<double, kBatch>& limit,
               const ReprojectOptions& options, ReprojectedBatch& result);

} // namespace curlew
