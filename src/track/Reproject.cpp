#include "curlew/track/Reproject.h"

namespace curlew {

namespace {

using JetD = Jet<double, 3, 1>;

/// The move along the gradient to the iso-surface, to first order; none where the gradient vanishes.
Vec3d newtonMove(const Vec3d& gradient, double residual) {
    const double squared = dot(gradient, gradient);
    return squared > 0 ? gradient * (-residual / squared) : Vec3d{};
}

/// The smallest v with J v = -r: v = Jᵀ (J Jᵀ)⁻¹ (-r).
Vec3d gaussNewtonMove(const JetD& f, const JetD& g, double rf, double rg, const ReprojectOptions& options) {
    const double ff = dot(f.gradient, f.gradient), gg = dot(g.gradient, g.gradient), fg = dot(f.gradient, g.gradient);
    const double determinant = ff * gg - fg * fg; // = |velocity|²
    constexpr double kParallel = 1e-12;           // sin² of the angle between the gradients: about a microradian
    if (!(determinant > kParallel * ff * gg))
        return std::abs(rf) * options.toleranceG > std::abs(rg) * options.toleranceF ? newtonMove(f.gradient, rf)
                                                                                     : newtonMove(g.gradient, rg);
    return f.gradient * ((fg * rg - gg * rf) / determinant) + g.gradient * ((fg * rf - ff * rg) / determinant);
}

Vec3d limited(const Vec3d& move, double limit) {
    const double size = length(move);
    return size > limit ? move * (limit / size) : move;
}

} // namespace

void reproject(const Dfvn& flow, PointBatch& points, const TrackBatch& track, const std::array<double, kBatch>& limit,
               const ReprojectOptions& options, ReprojectedBatch& result) {
    // The points still to be corrected, and where they belong.
    PointBatch active = points;
    std::array<size_t, kBatch> lane;
    for (size_t i = 0; i < lane.size(); ++i) lane[i] = i;
    JetBatch<double, 1> f, g;
    VecBatch<double> velocity;
    for (int iteration = 0; active.size > 0; ++iteration) {
        flow.eval(active, f, g, velocity);
        PointBatch rest;
        std::array<size_t, kBatch> restLane;
        std::array<double, kBatch> restG;
        for (int i = 0; i < active.size; ++i) {
            const size_t k = lane[static_cast<size_t>(i)];
            const JetD fi = f[i], gi = g[i];
            const double rf = fi.value - track.f[k], rg = gi.value - track.g[k];
            result.residualF[k] = rf;
            result.residualG[k] = rg;
            result.iterations[k] = iteration;
            result.converged[k] = std::abs(rf) <= options.toleranceF && std::abs(rg) <= options.toleranceG;
            result.velocity.set(static_cast<int>(k), velocity[i]);
            points.set(static_cast<int>(k), active[i]);
            if (result.converged[k] || iteration == options.iterations || options.method == Reprojection::none)
                continue;
            const Vec3d move = options.method == Reprojection::newton ? newtonMove(fi.gradient, rf)
                                                                      : gaussNewtonMove(fi, gi, rf, rg, options);
            restLane[static_cast<size_t>(rest.size)] = k;
            restG[static_cast<size_t>(rest.size)] = track.g[k];
            rest.push(active[i] + limited(move, limit[k]));
        }
        if (options.method == Reprojection::newton && rest.size > 0) {
            flow.g().eval(rest, g);
            for (int i = 0; i < rest.size; ++i) {
                const JetD gi = g[i];
                const auto k = static_cast<size_t>(i);
                rest.set(i, rest[i] + limited(newtonMove(gi.gradient, gi.value - restG[k]), limit[restLane[k]]));
            }
        }
        active = rest;
        lane = restLane;
    }
}

} // namespace curlew
