#include "curlew/track/Scatter.h"

#include "curlew/base/Error.h"
#include "curlew/base/Parallel.h"
#include "curlew/base/Random.h"

#include <fmt/format.h>

#include <algorithm>

namespace curlew {

namespace {

constexpr uint64_t kMostTries = 1000;

Vec3d candidate(const std::vector<Vec<int, 3>>& cells, const Vec3d& origin, double size, uint64_t seed, uint64_t point,
                uint64_t attempt) {
    const auto draw = [&](uint64_t k) { return randomUniform(seed, point, 4 * attempt + k); };
    const auto& cell = cells[static_cast<size_t>(draw(0) * static_cast<double>(cells.size()))];
    Vec3d p;
    for (int axis = 0; axis < 3; ++axis)
        p[axis] = origin[axis] + size * (cell[axis] + draw(static_cast<uint64_t>(axis) + 1));
    return p;
}

} // namespace

Points scatter(const Domain& domain, size_t count, uint64_t seed, const Monitor& monitor) {
    return scatterFrom(domain, 0, count, seed, monitor);
}

Points scatterFrom(const Domain& domain, int64_t first, size_t count, uint64_t seed, const Monitor& monitor) {
    if (first < 0) throw ValueError(fmt::format("the first id is {}; it must not be negative", first));
    if (!domain.box.finite()) throw ValueError("the domain is infinite; give a box");
    const Vec3d extent = domain.box.size();
    const double longest = std::max({extent[0], extent[1], extent[2]});
    if (!(std::min({extent[0], extent[1], extent[2]}) > 0)) throw ValueError("the box is empty");
    // Equal cells around the domain, a 64th of the box: points are drawn from them and those outside are drawn again.
    constexpr int kCellsPerEdge = 64;
    const double size = longest / kCellsPerEdge;
    DistanceRange range;
    if (domain.wall && domain.wall->side == Side::inside) range.upper = 0;
    if (domain.wall && domain.wall->side == Side::outside) range.lower = 0;
    const auto cells = coveringCells(domain, domain.box.lower, size, range, size_t{1} << 22);
    if (cells.empty()) throw ValueError("the domain is empty");

    Points particles;
    for (auto* array : {&particles.x, &particles.y, &particles.z}) array->resize(count);
    particles.id.resize(count);
    parallelFor(
        count, kBatch,
        [&](size_t begin, size_t end) {
            std::array<size_t, kBatch> waiting;
            size_t left = 0;
            for (size_t k = begin; k < end; ++k) waiting[left++] = k;
            for (uint64_t attempt = 0; left > 0; ++attempt) {
                if (attempt == kMostTries)
                    throw ValueError("hardly any point of the domain is on the flow's side of the wall");
                PointBatch points;
                for (size_t i = 0; i < left; ++i)
                    points.push(candidate(cells, domain.box.lower, size, seed,
                                          static_cast<uint64_t>(first) + waiting[i], attempt));
                std::array<bool, kBatch> allowed;
                std::array<double, kBatch> distance;
                classify(domain, points, allowed, distance);
                size_t again = 0;
                for (size_t i = 0; i < left; ++i) {
                    const Vec3d p = points[static_cast<int>(i)];
                    const size_t k = waiting[i];
                    if (!allowed[i] || !domain.box.contains(p)) {
                        waiting[again++] = k;
                        continue;
                    }
                    particles.setPosition(k, p);
                    particles.id[k] = first + static_cast<int64_t>(k);
                }
                left = again;
            }
        },
        monitor);
    return particles;
}

} // namespace curlew
