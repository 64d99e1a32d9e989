// SPDX-License-Identifier: Apache-2.0
#include "curlew/gpu/GpuAdvect.h"

#include "curlew/base/Memory.h"
#include "curlew/field/ForEachBatch.h"
#include "curlew/track/AdvectParts.h"

#include <fmt/format.h>

#include <algorithm>

namespace curlew {

namespace {

/// The longest way back onto a track at the end, relative to the diagonal of the box.
constexpr double kLastCorrection = 1e-4;

/// The steps of GpuFlowN::move() that do what advect() does with these options.
GpuMoveOptions moveOptions(const Flow& flow, const AdvectOptions& o, const FlowRms& rms) {
    GpuMoveOptions move{.scheme = *o.scheme,
                        .time = o.time,
                        .steps = o.adaptive() ? 0 : o.steps,
                        .accuracy = o.accuracy,
                        .rmsSpeed = flow.hasTracks() ? rms.speed : 0,
                        .maxStep = o.maxStep,
                        .maxSubdivisions = o.reprojection.maxSubdivisions};
    if (o.adaptive()) move.firstStep = std::min(firstStep(flow, *o.scheme, o.accuracy), std::abs(o.time));
    if (o.reprojection.method == Reprojection::none) {
        move.corrections = 0;
        move.guarded = false;
    } else {
        move.corrections = std::min(move.corrections, o.reprojection.iterations);
    }
    return move;
}

/// Particles in an order; empty: their own.
struct Ordered {
    const Points& particles;
    std::vector<uint32_t> order;

    size_t index(size_t k) const { return order.empty() ? k : order[k]; }
    size_t size() const { return particles.size(); }
    Vec3d position(size_t k) const { return particles.position(index(k)); }
};

/// Gives each point its track, unless it has one, and lets the points beyond the wall stay.
GpuPointsN<3> startOf(const Flow& flow, const Ordered& ordered, const AdvectOptions& o) {
    GpuPointsN<3> points;
    const Points& particles = ordered.particles;
    const size_t count = particles.size();
    const bool onTrack = particles.hasTrack();
    points.position.resize(count);
    points.pace.resize(count);
    points.converged.resize(count);
    points.error.resize(count);
    if (flow.hasTracks()) points.track.resize(count);
    forEachBatch(ordered, [&](const PointBatch& batch, size_t begin) {
        std::array<bool, kBatch> allowed;
        std::array<double, kBatch> distance;
        classify(flow.domain(), batch, allowed, distance);
        FlowBatchN<3> here;
        if (flow.hasTracks() && !onTrack) flow.eval(batch, here.potentials, here.velocity);
        for (size_t i = 0; i < static_cast<size_t>(batch.size); ++i) {
            const size_t k = begin + i, n = ordered.index(k);
            points.position[k] = batch[static_cast<int>(i)];
            points.converged[k] = particles.converged[n];
            points.pace[k] = o.byAge && particles.hasAge() ? static_cast<float>(paceOf(particles.age[n], o.time)) : 1;
            if (o.reprojection.method != Reprojection::none && !allowed[i]) points.pace[k] = 0;
            if (flow.hasTracks())
                points.track[k] = onTrack ? std::array{particles.f[n], particles.g[n]}
                                          : std::array{here.potentials[0].c[0][i], here.potentials[1].c[0][i]};
        }
    });
    return points;
}

/// What landing finds out about points.
struct Landed {
    size_t notConverged = 0, outside = 0;
    double error = 0, maxError = 0;
    std::array<double, 2> squares{}; ///< Of the residuals of converged points.

    Landed& operator+=(const Landed& o) {
        notConverged += o.notConverged;
        outside += o.outside;
        error += o.error;
        maxError = std::max(maxError, o.maxError);
        for (size_t q = 0; q < squares.size(); ++q) squares[q] += o.squares[q];
        return *this;
    }
};

/// Moves a batch back onto its tracks, unless that leads beyond the wall.
void landOnTracks(const Flow& flow, PointBatch& batch, const TrackBatch& track, const ReprojectOptions& reprojection,
                  ReprojectedBatch& landed) {
    const PointBatch before = batch;
    const Box& box = flow.domain().box;
    std::array<double, kBatch> limit, distance;
    limit.fill(kLastCorrection * (box.finite() ? length(box.size()) : 1));
    reproject(flow, batch, track, limit, reprojection, landed);
    std::array<bool, kBatch> allowed;
    classify(flow.domain(), batch, allowed, distance);
    bool all = true;
    for (int i = 0; i < batch.size; ++i)
        if (const auto k = static_cast<size_t>(i); !landed.converged[k] || !allowed[k]) {
            batch.set(i, before[i]);
            all = false;
        }
    if (all) return;
    FlowBatchN<3> here;
    std::array<Correction, kBatch> none;
    none.fill(Correction::none);
    flow.eval(batch, here.potentials, here.velocity);
    reproject(flow, batch, track, limit, reprojection, none, here, landed);
}

/// Moves the points back onto their tracks, in double, and writes them with their velocities and tracks.
Landed land(const Flow& flow, const GpuPointsN<3>& points, const ReprojectOptions& reprojection, const Ordered& ordered,
            Points& p) {
    const bool tracks = flow.hasTracks();
    return sumOverBatches(points.position, [&](PointBatch batch, size_t begin) {
        ReprojectedBatch landed;
        TrackBatch track{};
        for (size_t i = 0; i < static_cast<size_t>(batch.size) && tracks; ++i)
            for (size_t q = 0; q < track.size(); ++q) track[q][i] = points.track[begin + i][q];
        if (tracks) {
            landOnTracks(flow, batch, track, reprojection, landed);
        } else {
            flow.velocity(batch, landed.velocity);
            landed.residual = {};
        }
        std::array<bool, kBatch> allowed;
        std::array<double, kBatch> distance;
        classify(flow.domain(), batch, allowed, distance);
        Landed sum;
        for (size_t i = 0; i < static_cast<size_t>(batch.size); ++i) {
            const size_t k = begin + i, n = ordered.index(k);
            p.setPosition(n, batch[static_cast<int>(i)]);
            p.setVelocity(n, landed.velocity[static_cast<int>(i)]);
            if (tracks) p.f[n] = track[0][i], p.g[n] = track[1][i];
            p.converged[n] = points.converged[k];
            const auto error = static_cast<double>(points.error[k]);
            sum += {.notConverged = p.converged[n] == 0, .outside = !allowed[i], .error = error, .maxError = error};
            if (p.converged[n] == 0) continue;
            for (size_t q = 0; q < track.size(); ++q) sum.squares[q] += landed.residual[q][i] * landed.residual[q][i];
        }
        return sum;
    });
}

} // namespace

std::string whyNotOnGpu(const Flow& flow, const AdvectOptions& options) {
    if (splittingOf(flow, options) != Splitting::none) return "a sum is split into its terms on the processor only";
    if (options.reprojection.method == Reprojection::newton)
        return "a GPU corrects all potentials at once, as with reproject=gauss-newton";
    return {};
}

AdvectResult advectOnGpu(const std::shared_ptr<Gpu>& gpu, const Flow& flow, Points& particles,
                         const AdvectOptions& options, const Monitor& monitor) {
    const AdvectOptions chosen = chosenSteps(flow, options);
    if (const std::string why = whyNotOnGpu(flow, chosen); !why.empty()) throw ValueError(why);
    const FlowRms rms = rmsOf(flow, monitor.quiet());
    const size_t count = particles.size();
    requireMemory(static_cast<double>(count) *
                      (Points::kBytes - Points::kPlainBytes + sizeof(Vec3d) + 2 * sizeof(double) + 3 * sizeof(float)),
                  fmt::format("{} points and a copy for the GPU", count), "use fewer points");
    const GpuFlowN<3> onGpu(gpu, flow, monitor);
    particles.converged.resize(count, 1);
    const Ordered ordered{particles, advectionOrder(flow, particles)};
    GpuPointsN<3> points = startOf(flow, ordered, chosen);
    const GpuMoved moved = onGpu.move(points, moveOptions(flow, chosen, rms), monitor);
    for (auto* array : {&particles.vx, &particles.vy, &particles.vz}) array->resize(count);
    for (auto* array : {&particles.f, &particles.g}) array->resize(flow.hasTracks() ? count : 0);
    const Landed landed = land(flow, points, inUnitsOf(rms, chosen.reprojection), ordered, particles);
    const auto per = [](double sum, size_t n) { return sum / static_cast<double>(std::max<size_t>(n, 1)); };
    AdvectResult result{
        .points = count,
        .notConverged = landed.notConverged,
        .stalled = moved.stalled,
        .outside = landed.outside,
        .substeps = moved.substeps,
        .retries = moved.retries,
        .coarse = moved.coarse,
        .meanIterations = per(static_cast<double>(moved.corrections), moved.substeps + moved.retries + moved.stalled),
        .errorMean = per(landed.error, count),
        .errorMax = landed.maxError};
    for (size_t q = 0; q < rms.potentials.size() && flow.hasTracks(); ++q)
        if (rms.potentials[q] > 0)
            result.residual[q] = std::sqrt(per(landed.squares[q], count - landed.notConverged)) / rms.potentials[q];
    return result;
}

} // namespace curlew
