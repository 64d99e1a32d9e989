#include "curlew/vdb/Check.h"

#include "curlew/base/Parallel.h"
#include "curlew/track/Scatter.h"

#include <openvdb/tools/GridOperators.h>

#include <algorithm>
#include <mutex>

namespace curlew {

namespace {

constexpr uint64_t kSeed = 0x636865636b;

/// The greatest of `value(k)` over [0, count).
template <class Value>
double greatest(size_t count, const Value& value, const Monitor& monitor) {
    double most = 0;
    std::mutex merging;
    parallelFor(
        count, 256,
        [&](size_t begin, size_t end) {
            double own = 0;
            for (size_t k = begin; k < end; ++k) own = std::max(own, value(k));
            const std::lock_guard lock(merging);
            most = std::max(most, own);
        },
        monitor);
    return most;
}

Vec3d positionOf(const Particles& p, size_t k) { return {{p.x[k], p.y[k], p.z[k]}}; }

/// The divergence at a point by the trace of the derivative, and by central differences, relative to the derivative's
/// norm.
struct Divergence {
    double trace = 0, byDifferences = 0;
};

Divergence divergenceAt(const Dfvn& flow, const Vec3d& p, double h) {
    const FlowSample sample = flow.at(p);
    double trace = 0, squares = 0;
    for (size_t i = 0; i < 3; ++i) {
        trace += sample.derivative.rows[i][static_cast<int>(i)];
        squares += dot(sample.derivative.rows[i], sample.derivative.rows[i]);
    }
    if (!(squares > 0)) return {};
    PointBatch around;
    for (int i = 0; i < 6; ++i) {
        Vec3d q = p;
        q[i / 2] += i % 2 ? h : -h;
        around.push(q);
    }
    VecBatch<double> c;
    flow.velocity(around, c);
    double difference = 0;
    for (int axis = 0; axis < 3; ++axis) difference += (c[2 * axis + 1][axis] - c[2 * axis][axis]) / (2 * h);
    return {std::abs(trace) / std::sqrt(squares), difference / std::sqrt(squares)};
}

/// Moves a point onto the zero level of d; false where that does not work.
bool ontoWall(const ScalarField& distance, const Box& box, Vec3d& p) {
    constexpr int kMostIterations = 30;
    for (int k = 0; k < kMostIterations; ++k) {
        const auto d = distance.at<1>(p);
        if (std::abs(d.value) < 1e-13 * (1 + length(p))) return box.contains(p);
        const double squared = dot(d.gradient, d.gradient);
        if (!(squared > 1e-6)) return false;
        p -= d.gradient * (d.value / squared);
    }
    return false;
}

void checkWall(const Dfvn& flow, size_t samples, FlowCheck& check, const Monitor& monitor) {
    const Wall& wall = *flow.domain().wall;
    // Start near the wall: anywhere within its width, on both sides.
    Domain layer{.box = flow.domain().box, .wall = wall};
    layer.wall->side = Side::both;
    const Particles seeds = scatter(layer, samples, kSeed + 1, monitor);
    std::vector<uint8_t> onWall(samples);
    check.wallFlux = greatest(
                         samples,
                         [&](size_t k) {
                             Vec3d p = positionOf(seeds, k);
                             const double start = wall.sdf.distance.at<0>(p).value;
                             if (std::abs(start) > std::max(wall.width, 0.5 * wall.sdf.reach) ||
                                 !ontoWall(wall.sdf.distance, flow.domain().box, p))
                                 return 0.0;
                             onWall[k] = 1;
                             const auto d = wall.sdf.distance.at<1>(p);
                             return std::abs(dot(flow.at(p).velocity, d.gradient));
                         },
                         monitor) /
                     check.magnitudes.speed;
    check.wallSamples = static_cast<size_t>(std::count(onWall.begin(), onWall.end(), 1));
}

} // namespace

FlowCheck checkFlow(const Dfvn& flow, size_t samples, const Monitor& monitor) {
    FlowCheck check{.magnitudes = magnitudesOf(flow, monitor)};
    const Particles points = scatter(flow.domain(), samples, kSeed, monitor);
    const Vec3d size = flow.domain().box.size();
    const double h = 1e-5 * std::max({size[0], size[1], size[2]});
    std::vector<Divergence> divergence(samples);
    std::vector<uint8_t> beyond(samples, 1);
    const auto& wall = flow.domain().wall;
    parallelFor(
        samples, 256,
        [&](size_t begin, size_t end) {
            for (size_t k = begin; k < end; ++k) {
                const Vec3d p = positionOf(points, k);
                divergence[k] = divergenceAt(flow, p, h);
                if (wall) beyond[k] = beyondWall(wall->side, wall->sdf.distance.at<0>(p).value) < -wall->width;
            }
        },
        monitor);
    double squares = 0;
    for (size_t k = 0; k < samples; ++k) {
        check.divergence = std::max(check.divergence, divergence[k].trace);
        if (beyond[k]) check.divergenceBeyond = std::max(check.divergenceBeyond, divergence[k].trace);
        squares += divergence[k].byDifferences * divergence[k].byDifferences;
    }
    check.divergenceByDifferences = std::sqrt(squares / static_cast<double>(samples));
    if (wall) checkWall(flow, samples, check, monitor);
    return check;
}

GridCheck checkVelocity(const openvdb::Vec3SGrid& velocity) {
    const bool staggered = velocity.getGridClass() == openvdb::GRID_STAGGERED;
    const auto divergence = openvdb::tools::divergence(velocity);
    const double voxel = velocity.voxelSize()[0];
    const auto active = velocity.getConstUnsafeAccessor();
    const auto surrounded = [&](const openvdb::Coord& ijk) {
        for (int axis = 0; axis < 3; ++axis) {
            openvdb::Coord step(0);
            step[axis] = 1;
            if (!active.isValueOn(ijk + step) || (!staggered && !active.isValueOn(ijk - step))) return false;
        }
        return true;
    };
    GridCheck check;
    double speeds = 0, interior = 0, overall = 0;
    for (auto leaf = divergence->tree().cbeginLeaf(); leaf; ++leaf)
        for (auto value = leaf->cbeginValueOn(); value; ++value) {
            const openvdb::Coord ijk = value.getCoord();
            const double squared = static_cast<double>(*value) * static_cast<double>(*value);
            speeds += openvdb::Vec3d(active.getValue(ijk)).lengthSqr();
            ++check.voxels;
            overall += squared;
            if (!surrounded(ijk)) continue;
            ++check.interior;
            interior += squared;
        }
    if (check.voxels == 0 || !(speeds > 0)) return check;
    check.rmsSpeed = std::sqrt(speeds / static_cast<double>(check.voxels));
    const double unit = voxel / check.rmsSpeed;
    check.divergenceOverall = std::sqrt(overall / static_cast<double>(check.voxels)) * unit;
    if (check.interior > 0) check.divergence = std::sqrt(interior / static_cast<double>(check.interior)) * unit;
    return check;
}

ParticleCheck checkParticles(const Dfvn& flow, const Particles& particles, const Monitor& monitor) {
    struct Chunk {
        double squaresF = 0, squaresG = 0, penetration = -std::numeric_limits<double>::infinity();
        size_t converged = 0, outside = 0;
    };
    const size_t count = particles.size();
    std::vector<Chunk> chunks((count + kBatch - 1) / kBatch);
    parallelFor(
        count, kBatch,
        [&](size_t begin, size_t end) {
            Chunk& chunk = chunks[begin / kBatch];
            PointBatch points;
            for (size_t k = begin; k < end; ++k) points.push(positionOf(particles, k));
            std::array<bool, kBatch> allowed;
            std::array<double, kBatch> distance;
            classify(flow.domain(), points, allowed, distance);
            JetBatch<double, 0> f, g;
            flow.f().eval(points, f);
            flow.g().eval(points, g);
            for (size_t i = 0; i < end - begin; ++i) {
                if (flow.domain().wall) {
                    chunk.outside += !allowed[i];
                    chunk.penetration = std::max(chunk.penetration, beyondWall(flow.domain().wall->side, distance[i]));
                }
                const size_t k = begin + i;
                if (!particles.converged.empty() && !particles.converged[k]) continue;
                ++chunk.converged;
                if (!particles.hasTrack()) continue;
                const double df = f.c[0][i] - particles.f[k], dg = g.c[0][i] - particles.g[k];
                chunk.squaresF += df * df;
                chunk.squaresG += dg * dg;
            }
        },
        monitor);
    Chunk total;
    for (const Chunk& chunk : chunks) {
        total.squaresF += chunk.squaresF;
        total.squaresG += chunk.squaresG;
        total.penetration = std::max(total.penetration, chunk.penetration);
        total.converged += chunk.converged;
        total.outside += chunk.outside;
    }
    const FlowMagnitudes typical = magnitudesOf(flow, monitor);
    const double n = static_cast<double>(std::max<size_t>(total.converged, 1));
    const auto relative = [&](double squares, double scale) { return scale > 0 ? std::sqrt(squares / n) / scale : 0; };
    return {.points = count,
            .outside = total.outside,
            .notConverged = count - total.converged,
            .penetration = flow.domain().wall && count > 0 ? total.penetration : 0,
            .driftF = relative(total.squaresF, typical.f),
            .driftG = relative(total.squaresG, typical.g)};
}

} // namespace curlew
