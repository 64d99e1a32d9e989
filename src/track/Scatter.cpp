// SPDX-License-Identifier: Apache-2.0
#include "curlew/track/Scatter.h"

#include "curlew/base/Error.h"
#include "curlew/base/Parallel.h"
#include "curlew/base/Random.h"

#include <fmt/format.h>

#include <algorithm>

namespace curlew {

namespace {

constexpr uint64_t kMaxTries = 10000;
constexpr uint64_t kDensityStream = uint64_t{1} << 48; ///< Random numbers beyond those of the positions.
constexpr size_t kMaxCells = size_t{1} << 22;

/// Equal cells that cover the region to sample. Candidates outside the region are drawn again.
struct Cells {
    std::vector<Vec<int, 3>> cells;
    Vec3d origin;
    double size;

    Vec3d candidate(uint64_t seed, uint64_t point, uint64_t attempt) const {
        const auto draw = [&](uint64_t k) { return randomUniform(seed, point, 4 * attempt + k); };
        const auto& cell = cells[static_cast<size_t>(draw(0) * static_cast<double>(cells.size()))];
        Vec3d p;
        for (int axis = 0; axis < 3; ++axis)
            p[axis] = origin[axis] + size * (cell[axis] + draw(static_cast<uint64_t>(axis) + 1));
        return p;
    }
};

double longestEdge(const Box& box) {
    if (!box.finite()) throw ValueError("the domain is infinite; give a box");
    const Vec3d extent = box.size();
    if (!(std::min({extent[0], extent[1], extent[2]}) > 0)) throw ValueError("the box is empty");
    return std::max({extent[0], extent[1], extent[2]});
}

using Accepted = std::array<bool, kBatch>;

/// Draws points of a domain's volume.
class VolumeSource {
  public:
    explicit VolumeSource(const Domain& domain) : mDomain(domain) {
        constexpr int kCellsPerEdge = 64;
        const double size = longestEdge(domain.box) / kCellsPerEdge;
        DistanceRange range;
        if (domain.wall && domain.wall->side == Side::inside) range.upper = 0;
        if (domain.wall && domain.wall->side == Side::outside) range.lower = 0;
        mCells = {coveringCells(domain, domain.box.lower, size, range, kMaxCells), domain.box.lower, size};
        if (mCells.cells.empty()) throw ValueError("the domain is empty");
    }
    const Cells& cells() const { return mCells; }
    void sift(PointBatch& points, Accepted& accepted) const {
        std::array<double, kBatch> distance;
        classify(mDomain, points, accepted, distance);
        for (int i = 0; i < points.size; ++i)
            accepted[static_cast<size_t>(i)] = accepted[static_cast<size_t>(i)] && mDomain.box.contains(points[i]);
    }
    const char* failure() const { return "the wall or the density rejects almost every point of the domain"; }

  private:
    const Domain& mDomain;
    Cells mCells;
};

/// Draws points at a given distance from a domain's wall.
class SurfaceSource {
  public:
    SurfaceSource(const Domain& domain, double level) : mLevel(level) {
        constexpr int kCellsPerEdge = 128;
        if (!domain.wall) throw ValueError("there is no surface: the domain has no wall");
        const double longest = longestEdge(domain.box), size = longest / kCellsPerEdge;
        mHalf = size / 4;
        mTolerance = 1e-9 * longest;
        mDistance = domain.wall->sdf.distance;
        const double margin = std::abs(level) + mHalf;
        Domain both{.box = domain.box.padded(margin), .wall = domain.wall};
        both.wall->side = Side::both;
        mCells = {coveringCells(both, both.box.lower, size, {level - mHalf, level + mHalf}, kMaxCells), both.box.lower,
                  size};
        if (mCells.cells.empty()) throw ValueError("the surface does not meet the box");
    }
    const Cells& cells() const { return mCells; }
    /// Moves the points in the shell onto the surface.
    void sift(PointBatch& points, Accepted& accepted) const {
        JetBatch<double, 0> values;
        mDistance->eval(points, values);
        std::array<int, kBatch> of;
        PointBatch shell;
        for (int i = 0; i < points.size; ++i) {
            accepted[static_cast<size_t>(i)] = false;
            if (!(std::abs(values[i].value - mLevel) <= mHalf)) continue;
            of[static_cast<size_t>(shell.size)] = i;
            shell.push(points[i]);
        }
        if (shell.size == 0) return;
        Accepted converged;
        moveOnto(shell, converged);
        for (int i = 0; i < shell.size; ++i) {
            points.set(of[static_cast<size_t>(i)], shell[i]);
            accepted[static_cast<size_t>(of[static_cast<size_t>(i)])] = converged[static_cast<size_t>(i)];
        }
    }
    const char* failure() const { return "the box, the density or the wall rejects almost every point of the surface"; }

  private:
    /// Newton's method along the gradient.
    void moveOnto(PointBatch& points, Accepted& converged) const {
        constexpr int kNewtonSteps = 8;
        JetBatch<double, 1> jets;
        for (int step = 0; step <= kNewtonSteps; ++step) {
            mDistance->eval(points, jets);
            bool all = true;
            for (int i = 0; i < points.size; ++i) {
                const auto jet = jets[i];
                const double off = mLevel - jet.value, slope = dot(jet.gradient, jet.gradient);
                converged[static_cast<size_t>(i)] = std::abs(off) <= mTolerance;
                if (converged[static_cast<size_t>(i)] || !(slope > kMinSlope)) continue;
                points.set(i, points[i] + jet.gradient * (off / slope));
                all = false;
            }
            if (all) return;
        }
    }

    static constexpr double kMinSlope = 0.0625; ///< Squared; the field is not a distance where it is less steep.
    double mLevel, mHalf = 0, mTolerance = 0;
    std::optional<ScalarField> mDistance;
    Cells mCells;
};

/// Rejects points that box, density or wall do not allow. `point(i)`: the index of point i of the batch.
template <class PointOf>
void restrict(const ScatterOptions& o, const PointBatch& points, uint64_t attempt, const PointOf& point,
              Accepted& accepted) {
    if (o.clear) {
        Accepted allowed;
        std::array<double, kBatch> distance;
        classify(*o.clear, points, allowed, distance);
        for (size_t i = 0; i < static_cast<size_t>(points.size); ++i) accepted[i] = accepted[i] && allowed[i];
    }
    if (o.within)
        for (int i = 0; i < points.size; ++i)
            accepted[static_cast<size_t>(i)] = accepted[static_cast<size_t>(i)] && o.within->contains(points[i]);
    if (!o.density) return;
    JetBatch<double, 0> density;
    o.density->eval(points, density);
    for (int i = 0; i < points.size; ++i) {
        const double part = randomUniform(o.seed, point(i), kDensityStream + attempt);
        accepted[static_cast<size_t>(i)] = accepted[static_cast<size_t>(i)] && part < density[i].value;
    }
}

/// Returns `count` points at the origin. Gets the memory in parts, as touching all of it may take seconds.
Points blankPoints(size_t count, const Monitor& monitor) {
    constexpr size_t kPart = 1 << 21;
    Points p;
    for (auto* array : {&p.x, &p.y, &p.z}) array->reserve(count);
    p.id.reserve(count);
    for (size_t made = 0; made < count;) {
        monitor.check();
        made = std::min(count, made + kPart);
        for (auto* array : {&p.x, &p.y, &p.z}) array->resize(made);
        p.id.resize(made);
    }
    return p;
}

template <class Source>
Points drawn(const Source& source, int64_t first, size_t count, const ScatterOptions& o, const Monitor& monitor) {
    Points particles = blankPoints(count, monitor);
    parallelFor(
        count, kBatch,
        [&](size_t begin, size_t end) {
            std::array<size_t, kBatch> waiting;
            size_t left = 0;
            for (size_t k = begin; k < end; ++k) waiting[left++] = k;
            for (uint64_t attempt = 0; left > 0; ++attempt) {
                if (attempt == kMaxTries) throw ValueError(source.failure());
                const auto point = [&](auto i) {
                    return static_cast<uint64_t>(first) + waiting[static_cast<size_t>(i)];
                };
                PointBatch points;
                for (size_t i = 0; i < left; ++i) points.push(source.cells().candidate(o.seed, point(i), attempt));
                Accepted accepted;
                source.sift(points, accepted);
                restrict(o, points, attempt, point, accepted);
                size_t again = 0;
                for (size_t i = 0; i < left; ++i) {
                    const size_t k = waiting[i];
                    if (!accepted[i]) {
                        waiting[again++] = k;
                        continue;
                    }
                    particles.setPosition(k, points[static_cast<int>(i)]);
                    particles.id[k] = first + static_cast<int64_t>(k);
                }
                left = again;
            }
        },
        monitor);
    return particles;
}

} // namespace

Points scatter(const Domain& domain, size_t count, uint64_t seed, const Monitor& monitor) {
    return scatterFrom(domain, 0, count, seed, monitor);
}

Points scatterFrom(const Domain& domain, int64_t first, size_t count, uint64_t seed, const Monitor& monitor) {
    return scatterFrom(domain, first, count, ScatterOptions{.seed = seed}, monitor);
}

Points scatterFrom(const Domain& domain, int64_t first, size_t count, const ScatterOptions& options,
                   const Monitor& monitor) {
    if (first < 0) throw ValueError(fmt::format("the first id is {}; it must not be negative", first));
    if (options.on == ScatterOn::volume) return drawn(VolumeSource(domain), first, count, options, monitor);
    return drawn(SurfaceSource(domain, options.level), first, count, options, monitor);
}

} // namespace curlew
