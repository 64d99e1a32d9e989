// SPDX-License-Identifier: Apache-2.0
#include "curlew/track/Loop.h"

#include "LoopTable.h"
#include "curlew/base/Memory.h"
#include "curlew/base/Require.h"
#include "curlew/field/ForEachBatch.h"
#include "curlew/track/Advect.h"

#include <algorithm>
#include <utility>

namespace curlew {

namespace {

constexpr size_t kSampled = 256; // tracks, from which the memory of all is estimated

void validate(const Flow& flow, const Points& seeds, const LoopOptions& o) {
    if (seeds.y.size() != seeds.size() || seeds.z.size() != seeds.size() || seeds.id.size() != seeds.size())
        throw ValueError("the point arrays differ in length; give x, y, z and id for each point");
    requirePositive(o.duration, "the duration of a loop");
    if (o.accuracy != 0) requirePositive(o.accuracy, "accuracy");
    if (o.vertices < 8) throw ValueError(fmt::format("{} vertices per track; give at least 8", o.vertices));
    if (!flow.hasTracks())
        throw ValueError("this flow has no tracks; only along a track does a particle return to its start");
    if (!flow.domain().wall)
        throw ValueError("no wall contains this flow, so its tracks need not close; bound one of its potentials");
    if (o.reprojection.method == Reprojection::none)
        throw ValueError("without reprojection no particle returns to its start; choose another method");
    o.reprojection.validate(true);
}

/// Returns the elapsed fraction of the loop, 0 to below 1, rounded to units of 2⁻³² so that times that are a loop apart
/// have the same.
double phaseOf(double time, double duration) {
    constexpr double kUnits = 0x1p32;
    const double loops = time / duration, phase = std::round((loops - std::floor(loops)) * kUnits) / kUnits;
    return phase < 1 ? phase : 0;
}

/// Returns every n-th point.
Points thinned(const Points& points, size_t n) {
    Points few;
    for (size_t k = 0; k < points.size(); k += n) {
        few.x.push_back(points.x[k]), few.y.push_back(points.y[k]), few.z.push_back(points.z[k]);
        few.id.push_back(points.id[k]);
    }
    return few;
}

} // namespace

class LoopedPoints::Implementation {
  public:
    Implementation(const Flow& flow, Points seeds, const LoopOptions& options, const Monitor& monitor)
        : mFlow(flow), mOptions(options), mSeeds(std::move(seeds)) {
        validate(flow, mSeeds, options);
        const FlowRms rms = rmsOf(flow, monitor.quiet());
        mReprojection = inUnitsOf(rms, options.reprojection);
        const LoopSetup setup{.stepper = {flow, StepBy::time, Scheme::dormandPrince, mReprojection, StepGuard{}},
                              .maxStep = options.duration / 8,
                              .firstChord = length(flow.domain().box.size()) / 100,
                              .accuracy = options.accuracy > 0 ? options.accuracy : defaultAccuracy(flow.domain()),
                              .vertices = options.vertices};
        const size_t count = mSeeds.size(), every = count / kSampled;
        if (every > 1) {
            const Points few = thinned(mSeeds, every);
            summarize(tablesOf(setup, few, monitor.quiet()));
            const double share = static_cast<double>(count) / static_cast<double>(few.size());
            requireMemory(
                share * static_cast<double>(mSummary.bytes) + 2.0 * static_cast<double>(count) * Points::kBytes,
                fmt::format("the tracks of {} points", count), "use fewer points, a shorter loop or a larger accuracy");
        }
        mTables = tablesOf(setup, mSeeds, monitor);
        summarize(mTables);
        prepareSeeds();
    }

    LoopMoment at(double time, const Monitor& monitor) const {
        if (!std::isfinite(time)) throw ValueError("the time on a loop must be finite");
        const double phase = phaseOf(time, mOptions.duration);
        LoopMoment moment{.points = mSeeds, .outside = mSummary.outside};
        moment.snapped = sumOverBatches(
            mSeeds,
            [&](const PointBatchN<3>& seeds, size_t begin) {
                return place(mTables[begin / kBatch], seeds, begin, phase, moment.points);
            },
            monitor);
        return moment;
    }

    const LoopSummary& summary() const { return mSummary; }
    const LoopPath& path(size_t particle) const { return mTables.at(particle / kBatch).paths.at(particle % kBatch); }
    double duration() const { return mOptions.duration; }

  private:
    std::vector<LoopTable> tablesOf(const LoopSetup& setup, const Points& seeds, const Monitor& monitor) const {
        std::vector<LoopTable> tables((seeds.size() + kBatch - 1) / kBatch);
        parallelFor(
            seeds.size(), kBatch,
            [&](size_t begin, size_t end) {
                tables[begin / kBatch] = loopTable(setup, mOptions.duration, seeds, begin, end, monitor);
            },
            monitor);
        return tables;
    }

    void summarize(const std::vector<LoopTable>& tables) {
        LoopSummary s;
        double paces = 0;
        for (const LoopTable& table : tables) {
            s.vertices += table.vertices.size();
            s.bytes +=
                sizeof table + table.vertices.size() * sizeof(LoopVertex) + table.paths.size() * sizeof(LoopPath);
            for (const LoopPath& path : table.paths) {
                ++s.points;
                s.outside += path.outside;
                s.coarse += path.coarse;
                s.still += path.kind == LoopKind::still;
                s.fading += path.kind == LoopKind::fading;
                s.stuck += path.end == CurveEnd::stuck;
                s.truncated += path.end == CurveEnd::vertices;
                if (path.kind != LoopKind::closed) continue;
                const double pace = path.pace(mOptions.duration);
                s.paceMin = s.closed == 0 ? pace : std::min(s.paceMin, pace);
                s.paceMax = s.closed == 0 ? pace : std::max(s.paceMax, pace);
                s.gapMax = std::max(s.gapMax, path.gap);
                paces += pace;
                ++s.closed;
            }
        }
        if (s.closed > 0) s.paceMean = paces / static_cast<double>(s.closed);
        mSummary = s;
    }

    /// Gives the seeds the arrays of a LoopMoment.
    void prepareSeeds() {
        const size_t count = mSeeds.size();
        for (auto* array : {&mSeeds.f, &mSeeds.g}) array->resize(count);
        for (auto* array : {&mSeeds.vx, &mSeeds.vy, &mSeeds.vz}) array->assign(count, 0);
        mSeeds.fade.assign(count, 1);
        mSeeds.converged.assign(count, 1);
        for (size_t k = 0; k < count; ++k) {
            const TrackBatch& track = mTables[k / kBatch].track;
            mSeeds.f[k] = track[0][k % kBatch], mSeeds.g[k] = track[1][k % kBatch];
        }
    }

    /// Moves particles to their positions at a phase of the loop. Returns the number placed at a vertex of their table.
    size_t place(const LoopTable& table, const PointBatchN<3>& seeds, size_t begin, double phase,
                 Points& points) const {
        PointBatchN<3> at = seeds;
        std::array<double, kBatch> reach{};
        std::array<LoopPlace, kBatch> places;
        std::array<size_t, kBatch> vertex{};
        const auto size = static_cast<size_t>(seeds.size);
        for (size_t i = 0; i < size; ++i) {
            const LoopPath& path = table.paths[i];
            places[i] = placeOn(path, phase, mOptions.duration);
            if (path.kind == LoopKind::still) continue;
            vertex[i] = std::min<size_t>(table.vertexAt(path, places[i].time), path.begin + path.count - 2);
            at.set(static_cast<int>(i), table.interpolate(vertex[i], places[i].time));
            reach[i] = length(table.vertices[vertex[i] + 1].position - table.vertices[vertex[i]].position);
        }
        ReprojectedBatch found;
        reproject(mFlow, at, table.track, reach, mReprojection, found);
        std::array<bool, kBatch> allowed;
        std::array<double, kBatch> distance;
        classify(mFlow.domain(), at, allowed, distance);
        size_t snapped = 0;
        for (size_t i = 0; i < size; ++i) {
            const LoopPath& path = table.paths[i];
            points.fade[begin + i] = places[i].fade;
            if (path.kind == LoopKind::still) continue; // its velocity is 0
            Vec3d position = at[static_cast<int>(i)], velocity = found.velocity[static_cast<int>(i)];
            const bool kept = found.converged[i] && staysOnSide(allowed[i], distance[i], table.distance[i]);
            if (!kept) {
                const LoopVertex &a = table.vertices[vertex[i]], &b = table.vertices[vertex[i] + 1];
                const LoopVertex& nearest = places[i].time - a.time < b.time - places[i].time ? a : b;
                position = nearest.position;
                for (int axis = 0; axis < 3; ++axis) velocity[axis] = static_cast<double>(nearest.velocity[axis]);
                points.converged[begin + i] = 0;
                ++snapped;
            }
            points.setPosition(begin + i, position);
            points.setVelocity(begin + i, velocity * path.pace(mOptions.duration));
        }
        return snapped;
    }

    Flow mFlow;
    LoopOptions mOptions;
    Points mSeeds; ///< With the track and all arrays that change.
    ReprojectOptions mReprojection;
    std::vector<LoopTable> mTables; ///< kBatch particles each.
    LoopSummary mSummary;
};

LoopedPoints::LoopedPoints(const Flow& flow, Points seeds, const LoopOptions& options, const Monitor& monitor)
    : mImplementation(std::make_unique<Implementation>(flow, std::move(seeds), options, monitor)) {}
LoopedPoints::~LoopedPoints() = default;
LoopedPoints::LoopedPoints(LoopedPoints&&) noexcept = default;
LoopedPoints& LoopedPoints::operator=(LoopedPoints&&) noexcept = default;

LoopMoment LoopedPoints::at(double time, const Monitor& monitor) const { return mImplementation->at(time, monitor); }
const LoopSummary& LoopedPoints::summary() const { return mImplementation->summary(); }
LoopKind LoopedPoints::kind(size_t particle) const { return mImplementation->path(particle).kind; }
double LoopedPoints::period(size_t particle) const { return mImplementation->path(particle).period; }
double LoopedPoints::pace(size_t particle) const {
    return mImplementation->path(particle).pace(mImplementation->duration());
}

} // namespace curlew
