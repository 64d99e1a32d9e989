#include "curlew/track/Advect.h"

#include "curlew/base/Parallel.h"

#include <fmt/format.h>

namespace curlew {

namespace {

/// What one batch contributes to AdvectResult.
struct Tally {
    size_t notConverged = 0, keptBack = 0, outside = 0, substeps = 0, retries = 0, iterations = 0;
    std::array<double, 2> squares{}; // of the residuals of f and g

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

/// The particles of one batch on their way through all steps.
class BatchAdvector {
  public:
    BatchAdvector(const Flow& flow, const AdvectOptions& options, const ReprojectOptions& reprojection)
        : mFlow(flow), mOptions(options), mReprojection(reprojection) {}

    Tally run(Particles& particles, bool onTrack, size_t begin, size_t end, const Monitor& monitor) {
        load(particles, onTrack, begin, end);
        for (int k = 0; k < mOptions.steps; ++k) {
            monitor.check(); // the steps of one batch may take hours
            advanceAll();
        }
        store(particles, begin);
        return mTally;
    }

  private:
    bool reprojects() const { return mOptions.reprojection != Reprojection::none; }

    void load(const Particles& p, bool onTrack, size_t begin, size_t end) {
        for (size_t k = begin; k < end; ++k) mPosition.push({{p.x[k], p.y[k], p.z[k]}});
        Flow::Jets<double> potentials;
        mFlow.eval(mPosition, potentials, mVelocity);
        for (size_t i = 0; i < end - begin; ++i) {
            mTrack[0][i] = onTrack ? p.f[begin + i] : potentials[0].c[0][i];
            mTrack[1][i] = onTrack ? p.g[begin + i] : potentials[1].c[0][i];
            mConverged[i] = true;
        }
        classify(mFlow.domain(), mPosition, mAllowed, mDistance);
    }

    void store(Particles& p, size_t begin) {
        Flow::Jets<double> potentials;
        mFlow.eval(mPosition, potentials, mVelocity);
        classify(mFlow.domain(), mPosition, mAllowed, mDistance);
        for (int i = 0; i < mPosition.size; ++i) {
            const auto lane = static_cast<size_t>(i);
            const size_t k = begin + lane;
            const Vec3d x = mPosition[i], v = mVelocity[i];
            p.x[k] = x[0];
            p.y[k] = x[1];
            p.z[k] = x[2];
            p.vx[k] = static_cast<float>(v[0]);
            p.vy[k] = static_cast<float>(v[1]);
            p.vz[k] = static_cast<float>(v[2]);
            if (mFlow.hasTracks()) {
                p.f[k] = mTrack[0][lane];
                p.g[k] = mTrack[1][lane];
            }
            if (!mConverged[lane]) p.converged[k] = 0;
            mTally.outside += !mAllowed[lane];
            if (!p.converged[k]) {
                ++mTally.notConverged;
                continue;
            }
            for (size_t q = 0; q < potentials.size(); ++q) {
                const double residual = potentials[q].c[0][lane] - mTrack[q][lane];
                mTally.squares[q] += residual * residual;
            }
        }
    }

    /// One time step of every particle. What is left of it is counted in parts of 2^-halvings.
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
        PointBatch from, to;
        VecBatch<double> first;
        TrackBatch track;
        for (size_t a = 0; a < count; ++a) {
            const int i = static_cast<int>(active[a]);
            first.set(static_cast<int>(a), mVelocity[i]);
            from.push(mPosition[i]);
            for (size_t q = 0; q < track.size(); ++q) track[q][a] = mTrack[q][active[a]];
        }
        step(
            mOptions.scheme, from, first, dt, [&](const PointBatch& p, VecBatch<double>& v) { mFlow.velocity(p, v); },
            to);
        std::array<double, kBatch> limit;
        for (size_t a = 0; a < count; ++a) limit[a] = length(to[static_cast<int>(a)] - from[static_cast<int>(a)]);
        ReprojectedBatch landed;
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
    void checkChords(const std::array<size_t, kBatch>& active, size_t count, const PointBatch& from,
                     const PointBatch& to, std::array<bool, kBatch>& taken) const {
        const auto& wall = mFlow.domain().wall;
        if (!wall) return;
        constexpr int kSamples = 3;
        PointBatch samples;
        std::array<size_t, kBatch> owner;
        const auto judge = [&] {
            JetBatch<double, 0> d;
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
            const Vec3d start = from[static_cast<int>(a)], move = to[static_cast<int>(a)] - start;
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

    const Flow& mFlow;
    const AdvectOptions& mOptions;
    const ReprojectOptions& mReprojection;
    PointBatch mPosition;
    VecBatch<double> mVelocity;
    TrackBatch mTrack;
    std::array<double, kBatch> mDistance;
    std::array<bool, kBatch> mAllowed, mConverged;
    Tally mTally;
};

void validate(const AdvectOptions& o) {
    if (o.steps < 1) throw ValueError(fmt::format("{} steps; give at least 1", o.steps));
    if (!std::isfinite(o.time)) throw ValueError("time must be finite");
    if (!(o.tolerance > 0)) throw ValueError(fmt::format("tolerance {} must be positive", o.tolerance));
    if (o.iterations < 1) throw ValueError(fmt::format("{} iterations; give at least 1", o.iterations));
    if (o.halvings < 0 || o.halvings > 20) throw ValueError(fmt::format("{} halvings; give 0 to 20", o.halvings));
}

} // namespace

AdvectResult advect(const Flow& flow, Particles& particles, const AdvectOptions& options, const Monitor& monitor) {
    validate(options);
    if (options.reprojection != Reprojection::none && !flow.hasTracks())
        throw ValueError("this flow is a sum and has no tracks to put points back onto; choose no reprojection");
    const FlowMagnitudes typical = magnitudesOf(flow);
    const ReprojectOptions reprojection{
        .method = options.reprojection,
        .tolerance = {options.tolerance * typical.potentials[0], options.tolerance * typical.potentials[1]},
        .iterations = options.iterations};
    const size_t count = particles.size();
    for (auto* array : {&particles.vx, &particles.vy, &particles.vz}) array->resize(count);
    const bool onTrack = particles.hasTrack() && flow.hasTracks();
    for (auto* array : {&particles.f, &particles.g}) array->resize(flow.hasTracks() ? count : 0);
    particles.converged.resize(count, 1);

    const Tally sum = parallelSum(
        count, kBatch,
        [&](size_t begin, size_t end) {
            return BatchAdvector(flow, options, reprojection).run(particles, onTrack, begin, end, monitor);
        },
        monitor);
    const double converged = static_cast<double>(std::max<size_t>(count - sum.notConverged, 1));
    const auto residual = [&](size_t q) {
        const double size = flow.hasTracks() ? typical.potentials[q] : 0;
        return size > 0 ? std::sqrt(sum.squares[q] / converged) / size : 0;
    };
    return {
        .points = count,
        .notConverged = sum.notConverged,
        .keptBack = sum.keptBack,
        .outside = sum.outside,
        .substeps = sum.substeps,
        .retries = sum.retries,
        .meanIterations = static_cast<double>(sum.iterations) / static_cast<double>(std::max<size_t>(sum.substeps, 1)),
        .residualF = residual(0),
        .residualG = residual(1)};
}

} // namespace curlew
