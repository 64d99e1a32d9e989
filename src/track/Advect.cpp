#include "curlew/track/Advect.h"

#include "curlew/base/Parallel.h"
#include "curlew/field/Dimensions.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <utility>

namespace curlew {

namespace {

template <int N>
using Points = std::vector<Vec<double, N>>;

/// What one batch contributes to AdvectResult.
template <int N>
struct Tally {
    size_t notConverged = 0, keptBack = 0, outside = 0, substeps = 0, retries = 0, iterations = 0;
    std::array<double, FlowN<N>::kPotentials> squares{}; // of the residuals

    Tally& operator+=(const Tally& o) {
        notConverged += o.notConverged;
        keptBack += o.keptBack;
        outside += o.outside;
        substeps += o.substeps;
        retries += o.retries;
        iterations += o.iterations;
        for (size_t q = 0; q < squares.size(); ++q) squares[q] += o.squares[q];
        return *this;
    }
};

/// The points of one batch on their way through all steps.
template <int N>
class BatchAdvector {
  public:
    /// The points, each on the track that it begins on.
    BatchAdvector(const FlowN<N>& flow, const AdvectOptions& options, const ReprojectOptionsN<N>& reprojection,
                  const PointBatchN<N>& points)
        : mFlow(flow), mOptions(options), mReprojection(reprojection), mPosition(points) {
        const auto potentials = look();
        for (size_t q = 0; q < mTrack.size(); ++q) mTrack[q] = potentials[q].c[0];
        mConverged.fill(true);
    }

    void run(const Monitor& monitor) {
        for (int k = 0; k < mOptions.steps; ++k) {
            monitor.check(); // the steps of one batch may take hours
            advanceAll();
        }
    }

    /// What has happened, and how far the points are from their tracks now.
    Tally<N> tally() {
        const auto potentials = look();
        Tally<N> sum = mTally;
        for (size_t i = 0; i < static_cast<size_t>(mPosition.size); ++i) {
            sum.outside += !mAllowed[i];
            sum.notConverged += !mConverged[i];
            if (!mConverged[i]) continue;
            for (size_t q = 0; q < potentials.size(); ++q) {
                const double residual = potentials[q].c[0][i] - mTrack[q][i];
                sum.squares[q] += residual * residual;
            }
        }
        return sum;
    }

    const PointBatchN<N>& position() const { return mPosition; }
    const VecBatchN<double, N>& velocity() const { return mVelocity; }
    TrackBatchN<N>& track() { return mTrack; }
    std::array<bool, kBatch>& converged() { return mConverged; }

  private:
    using Jets = typename FlowN<N>::template Jets<double>;

    bool reprojects() const { return mOptions.reprojection != Reprojection::none; }

    /// The potentials where the points are; also their velocities, and where they are of the wall.
    Jets look() {
        Jets potentials;
        mFlow.eval(mPosition, potentials, mVelocity);
        classify(mFlow.domain(), mPosition, mAllowed, mDistance);
        return potentials;
    }

    /// One time step of every point. What is left of it is counted in parts of 2^-halvings.
    void advanceAll() {
        const int whole = 1 << mOptions.halvings;
        std::array<size_t, kBatch> active;
        std::array<int, kBatch> left, part;
        size_t count = 0;
        for (size_t i = 0; i < static_cast<size_t>(mPosition.size); ++i) {
            if (reprojects() && !mAllowed[i]) continue;
            left[i] = part[i] = whole;
            active[count++] = i;
        }
        const double smallest = mOptions.time / mOptions.steps / whole;
        while (count > 0) {
            std::array<double, kBatch> dt;
            for (size_t a = 0; a < count; ++a) dt[a] = smallest * part[active[a]];
            const std::array<bool, kBatch> taken = tryStep(active, count, dt);
            size_t rest = 0;
            for (size_t a = 0; a < count; ++a) {
                const size_t i = active[a];
                if (taken[a]) {
                    ++mTally.substeps;
                    left[i] -= part[i];
                } else if (part[i] > 1) {
                    ++mTally.retries;
                    part[i] /= 2;
                } else {
                    ++mTally.keptBack;
                    mConverged[i] = false;
                    left[i] = 0;
                }
                if (left[i] > 0) active[rest++] = i;
            }
            count = rest;
        }
    }

    /// Tries a step for the particles listed in `active`; keeps those that succeed and says which.
    std::array<bool, kBatch> tryStep(const std::array<size_t, kBatch>& active, size_t count,
                                     const std::array<double, kBatch>& dt) {
        PointBatchN<N> from, to;
        VecBatchN<double, N> first;
        TrackBatchN<N> track;
        for (size_t a = 0; a < count; ++a) {
            const int i = static_cast<int>(active[a]);
            first.set(static_cast<int>(a), mVelocity[i]);
            from.push(mPosition[i]);
            for (size_t q = 0; q < track.size(); ++q) track[q][a] = mTrack[q][active[a]];
        }
        step(
            mOptions.scheme, from, first, dt,
            [&](const PointBatchN<N>& p, VecBatchN<double, N>& v) { mFlow.velocity(p, v); }, to);
        std::array<double, kBatch> limit;
        for (size_t a = 0; a < count; ++a) limit[a] = length(to[static_cast<int>(a)] - from[static_cast<int>(a)]);
        ReprojectedBatchN<N> landed;
        reproject(mFlow, to, track, limit, mReprojection, landed);

        std::array<bool, kBatch> allowed, taken;
        std::array<double, kBatch> distance;
        taken.fill(true);
        if (reprojects()) {
            classify(mFlow.domain(), to, allowed, distance);
            for (size_t a = 0; a < count; ++a) {
                const double before = mDistance[active[a]];
                taken[a] = landed.converged[a] && allowed[a] && (distance[a] < 0) == (before < 0);
                mTally.iterations += static_cast<size_t>(landed.iterations[a]);
            }
            checkChords(active, count, from, to, taken);
        }
        for (size_t a = 0; a < count; ++a) {
            if (!taken[a]) continue;
            const int i = static_cast<int>(active[a]);
            mPosition.set(i, to[static_cast<int>(a)]);
            mVelocity.set(i, landed.velocity[static_cast<int>(a)]);
            if (reprojects()) mDistance[active[a]] = distance[a];
        }
        return taken;
    }

    /// Takes back steps near the wall that are too long, or whose chord leads through it.
    void checkChords(const std::array<size_t, kBatch>& active, size_t count, const PointBatchN<N>& from,
                     const PointBatchN<N>& to, std::array<bool, kBatch>& taken) const {
        const auto& wall = mFlow.domain().wall;
        if (!wall) return;
        constexpr int kSamples = 3;
        PointBatchN<N> samples;
        std::array<size_t, kBatch> owner;
        const auto judge = [&] {
            JetBatchN<double, N, 0> d;
            wall->sdf.distance.eval(samples, d);
            for (size_t s = 0; s < static_cast<size_t>(samples.size); ++s) {
                const size_t a = owner[s];
                const double chord = length(to[static_cast<int>(a)] - from[static_cast<int>(a)]);
                // On which side the chord has to stay: for `both`, the side on which it began.
                const Side side = wall->side != Side::both   ? wall->side
                                  : mDistance[active[a]] < 0 ? Side::inside
                                                             : Side::outside;
                if (!(beyondWall(side, d.c[0][s]) <= chord / 16)) taken[a] = false;
            }
            samples.size = 0;
        };
        for (size_t a = 0; a < count; ++a) {
            if (!taken[a]) continue;
            const Vec<double, N> start = from[static_cast<int>(a)], move = to[static_cast<int>(a)] - start;
            const double chord = length(move);
            if (std::abs(mDistance[active[a]]) > chord) continue;
            if (chord > wall->width) {
                taken[a] = false;
                continue;
            }
            if (samples.size + kSamples > kBatch) judge();
            for (int k = 1; k <= kSamples; ++k) {
                owner[static_cast<size_t>(samples.size)] = a;
                samples.push(start + move * (double(k) / (kSamples + 1)));
            }
        }
        judge();
    }

    const FlowN<N>& mFlow;
    const AdvectOptions& mOptions;
    const ReprojectOptionsN<N>& mReprojection;
    PointBatchN<N> mPosition;
    VecBatchN<double, N> mVelocity;
    TrackBatchN<N> mTrack;
    std::array<double, kBatch> mDistance;
    std::array<bool, kBatch> mAllowed, mConverged;
    Tally<N> mTally;
};

template <int N>
void validate(const FlowN<N>& flow, const AdvectOptions& o) {
    if (o.steps < 1) throw ValueError(fmt::format("{} steps; give at least 1", o.steps));
    if (!std::isfinite(o.time)) throw ValueError("time must be finite");
    if (!(o.tolerance > 0)) throw ValueError(fmt::format("tolerance {} must be positive", o.tolerance));
    if (o.iterations < 1) throw ValueError(fmt::format("{} iterations; give at least 1", o.iterations));
    if (o.halvings < 0 || o.halvings > 20) throw ValueError(fmt::format("{} halvings; give 0 to 20", o.halvings));
    if (o.reprojection != Reprojection::none && !flow.hasTracks())
        throw ValueError("this flow is a sum and has no tracks to put points back onto; choose no reprojection");
}

/// Moves points in batches: `batch(advector, begin, end)` loads, runs and stores one.
template <int N, class Batch>
AdvectResultN<N> advectBatches(const FlowN<N>& flow, size_t count, const AdvectOptions& options, const Batch& batch,
                               const Monitor& monitor) {
    const FlowMagnitudesN<N> typical = magnitudesOf(flow);
    ReprojectOptionsN<N> reprojection{.method = options.reprojection, .iterations = options.iterations};
    for (size_t q = 0; q < typical.potentials.size(); ++q)
        reprojection.tolerance[q] = options.tolerance * typical.potentials[q];
    const Tally<N> sum = parallelSum(
        count, kBatch, [&](size_t begin, size_t end) { return batch(reprojection, begin, end); }, monitor);
    const auto converged = static_cast<double>(std::max<size_t>(count - sum.notConverged, 1));
    AdvectResultN<N> result{
        .points = count,
        .notConverged = sum.notConverged,
        .keptBack = sum.keptBack,
        .outside = sum.outside,
        .substeps = sum.substeps,
        .retries = sum.retries,
        .meanIterations = static_cast<double>(sum.iterations) / static_cast<double>(std::max<size_t>(sum.substeps, 1))};
    for (size_t q = 0; q < typical.potentials.size(); ++q)
        if (flow.hasTracks() && typical.potentials[q] > 0)
            result.residual[q] = std::sqrt(sum.squares[q] / converged) / typical.potentials[q];
    return result;
}

} // namespace

template <int N>
AdvectResultN<N> advect(const FlowN<N>& flow, Points<N>& points, const AdvectOptions& options, const Monitor& monitor) {
    validate(flow, options);
    return advectBatches(
        flow, points.size(), options,
        [&](const ReprojectOptionsN<N>& reprojection, size_t begin, size_t end) {
            PointBatchN<N> start;
            for (size_t k = begin; k < end; ++k) start.push(points[k]);
            BatchAdvector<N> batch(flow, options, reprojection, start);
            batch.run(monitor);
            for (size_t k = begin; k < end; ++k) points[k] = batch.position()[static_cast<int>(k - begin)];
            return batch.tally();
        },
        monitor);
}

namespace {

/// The particles in the order of a Z-curve (Morton 1966) through the box: those of a batch are then near each other,
/// and look up the same parts of a level set.
std::vector<uint32_t> alongCurve(const Particles& p, const Box& box) {
    constexpr int kBits = 10;
    const auto cell = [](double x, double lower, double size) {
        const double c = (x - lower) / size * (1 << kBits);
        return c > 0 ? static_cast<uint32_t>(std::min(c, (1 << kBits) - 1.0)) : 0u; // NaN, too
    };
    const Vec3d size = box.size();
    std::vector<std::pair<uint32_t, uint32_t>> codes(p.size());
    for (size_t k = 0; k < p.size(); ++k) {
        const std::array<uint32_t, 3> c{cell(p.x[k], box.lower[0], size[0]), cell(p.y[k], box.lower[1], size[1]),
                                        cell(p.z[k], box.lower[2], size[2])};
        uint32_t code = 0;
        for (int bit = kBits - 1; bit >= 0; --bit)
            for (const uint32_t axis : c) code = code << 1 | (axis >> bit & 1);
        codes[k] = {code, static_cast<uint32_t>(k)};
    }
    std::sort(codes.begin(), codes.end());
    std::vector<uint32_t> order(codes.size());
    for (size_t k = 0; k < codes.size(); ++k) order[k] = codes[k].second;
    return order;
}

} // namespace

AdvectResult advect(const Flow& flow, Particles& particles, const AdvectOptions& options, const Monitor& monitor) {
    validate(flow, options);
    const size_t count = particles.size();
    const bool onTrack = particles.hasTrack() && flow.hasTracks();
    for (auto* array : {&particles.vx, &particles.vy, &particles.vz}) array->resize(count);
    for (auto* array : {&particles.f, &particles.g}) array->resize(flow.hasTracks() ? count : 0);
    particles.converged.resize(count, 1);
    Particles& p = particles;
    // No particle depends on another, so the order changes nothing but the time.
    const bool sorted = flow.domain().wall && flow.domain().box.finite() && count <= UINT32_MAX;
    const std::vector<uint32_t> order = sorted ? alongCurve(p, flow.domain().box) : std::vector<uint32_t>{};
    const auto particle = [&](size_t k) { return sorted ? order[k] : k; };
    return advectBatches(
        flow, count, options,
        [&](const ReprojectOptions& reprojection, size_t begin, size_t end) {
            PointBatch start;
            for (size_t n = begin; n < end; ++n) {
                const size_t k = particle(n);
                start.push({{p.x[k], p.y[k], p.z[k]}});
            }
            BatchAdvector<3> batch(flow, options, reprojection, start);
            for (size_t n = begin; n < end; ++n) {
                const size_t k = particle(n);
                batch.converged()[n - begin] = p.converged[k] != 0;
                if (!onTrack) continue;
                batch.track()[0][n - begin] = p.f[k];
                batch.track()[1][n - begin] = p.g[k];
            }
            batch.run(monitor);
            const Tally<3> tally = batch.tally();
            for (size_t n = begin; n < end; ++n) {
                const size_t k = particle(n);
                const auto lane = static_cast<int>(n - begin);
                const Vec3d x = batch.position()[lane], v = batch.velocity()[lane];
                p.x[k] = x[0];
                p.y[k] = x[1];
                p.z[k] = x[2];
                p.vx[k] = static_cast<float>(v[0]);
                p.vy[k] = static_cast<float>(v[1]);
                p.vz[k] = static_cast<float>(v[2]);
                p.converged[k] = batch.converged()[n - begin] ? 1 : 0;
                if (!flow.hasTracks()) continue;
                p.f[k] = batch.track()[0][n - begin];
                p.g[k] = batch.track()[1][n - begin];
            }
            return tally;
        },
        monitor);
}

#define CURLEW_INSTANTIATE(N) \
    template AdvectResultN<N> advect(const FlowN<N>&, Points<N>&, const AdvectOptions&, const Monitor&);
CURLEW_FOR_FLOW_DIMENSIONS(CURLEW_INSTANTIATE)
#undef CURLEW_INSTANTIATE

} // namespace curlew
