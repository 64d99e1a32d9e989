// SPDX-License-Identifier: Apache-2.0
#include "FlowSampler.h"
#include "curlew/base/Parallel.h"
#include "curlew/vdb/Openvdb.h"

#include <bit>
#include <utility>

namespace curlew {

namespace {

/// The voxels of one plane of a leaf form a batch, and a word of the leaf's active mask.
static_assert(kBatch == kLeafEdge * kLeafEdge);

constexpr uint64_t kAll = ~uint64_t{0};
using Factors = std::array<float, kBatch>;

PointBatch centresOfPlane(const openvdb::Coord& origin, int plane, double voxel) {
    PointBatch points;
    points.size = kBatch;
    points.c[0].fill((origin[0] + plane) * voxel);
    for (int j = 0; j < kLeafEdge; ++j)
        for (int k = 0; k < kLeafEdge; ++k) {
            const int n = j * kLeafEdge + k;
            points.c[1][static_cast<size_t>(n)] = (origin[1] + j) * voxel;
            points.c[2][static_cast<size_t>(n)] = (origin[2] + k) * voxel;
        }
    return points;
}

/// Returns the mask of the points where the velocity is not zero, and its fade factors there. `whole`: all points are
/// in the box. `fades`: the factor differs from 1 somewhere.
uint64_t activePoints(const FlowOnVoxels& sampled, const PointBatch& points, bool whole, bool fades, Factors& factors) {
    const Domain& domain = sampled.flow.domain();
    uint64_t active = kAll;
    if (!whole)
        for (int i = 0; i < kBatch; ++i)
            if (!domain.box.contains(points[i])) active &= ~(uint64_t{1} << i);
    factors.fill(1);
    if (active == 0 || !fades) return active;
    JetBatch<float, 0> d;
    wallDistances(domain, points, d);
    for (size_t i = 0; i < kBatch; ++i)
        factors[i] = static_cast<float>(sampled.fade.at(static_cast<double>(d.c[0][i])));
    for (size_t i = 0; i < kBatch; ++i)
        if (!(factors[i] > 0)) active &= ~(uint64_t{1} << i);
    return active;
}

/// Moves the active points and their factors to the front, and stores the voxel of the plane that each belongs to.
void compact(uint64_t active, PointBatch& points, Factors& factors, std::array<uint8_t, kBatch>& voxel) {
    points.size = 0;
    for (; active != 0; active &= active - 1) {
        const int i = std::countr_zero(active);
        const auto to = static_cast<size_t>(points.size);
        factors[to] = factors[static_cast<size_t>(i)];
        voxel[to] = static_cast<uint8_t>(i);
        points.push(points[i]);
    }
}

/// Adds the wall's velocity to a plane, and activates those voxels in the box where it is not zero.
void addWall(const FlowOnVoxels& sampled, bool whole, int plane, VelocityLeaf& leaf) {
    const PointBatch points = centresOfPlane(leaf.origin(), plane, sampled.voxel);
    VecBatch<double> w;
    sampled.moving->eval(points, w);
    openvdb::Vec3s* values = leaf.buffer().data() + plane * kBatch;
    auto& active = leaf.getValueMask().getWord<uint64_t>(plane);
    for (int i = 0; i < kBatch; ++i) {
        const Vec3d added = w[i];
        if (added == Vec3d{} || !(whole || sampled.flow.domain().box.contains(points[i]))) continue;
        for (int axis = 0; axis < 3; ++axis) values[i][axis] += static_cast<float>(added[axis]);
        active |= uint64_t{1} << i;
    }
}

void addWall(const FlowOnVoxels& sampled, VelocityLeaf& leaf) {
    if (sampled.rests(leaf.origin())) return;
    const bool whole = sampled.inBox(leaf.origin());
    for (int plane = 0; plane < kLeafEdge; ++plane) addWall(sampled, whole, plane, leaf);
}

/// The voxels of a leaf at which a source computes the velocity, and their fade factors (empty: all are 1).
struct Wanted {
    size_t first = 0, count = 0; ///< Of the positions of all leaves.
    std::vector<float> factors;
};

/// Activates the voxels of a leaf where the velocity is not zero.
Wanted activate(const FlowOnVoxels& sampled, VelocityLeaf& leaf) {
    const bool whole = sampled.inBox(leaf.origin()), fades = !sampled.isFar(leaf.origin());
    Wanted wanted;
    for (int plane = 0; plane < kLeafEdge; ++plane) {
        Factors factors;
        const uint64_t active =
            activePoints(sampled, centresOfPlane(leaf.origin(), plane, sampled.voxel), whole, fades, factors);
        leaf.getValueMask().getWord<uint64_t>(plane) = active;
        wanted.count += static_cast<size_t>(std::popcount(active));
        for (uint64_t rest = fades ? active : 0; rest != 0; rest &= rest - 1)
            wanted.factors.push_back(factors[static_cast<size_t>(std::countr_zero(rest))]);
    }
    return wanted;
}

} // namespace

void sampleCollocated(const FlowOnVoxels& sampled, const VelocitySource& source,
                      const std::vector<VelocityLeaf*>& leaves, const Monitor& monitor) {
    constexpr size_t kAtOnce = 1 << 11, kGrain = 16; // leaves
    std::vector<Vec3d> positions;
    std::vector<Vec3f> velocities;
    for (size_t begin = 0; begin < leaves.size(); begin += kAtOnce) {
        const size_t count = std::min(kAtOnce, leaves.size() - begin);
        std::vector<Wanted> wanted(count);
        const auto forEachLeaf = [&](const auto& use) {
            parallelFor(count, kGrain, [&](size_t from, size_t to) {
                for (size_t n = from; n < to; ++n) use(*leaves[begin + n], wanted[n]);
            });
        };
        forEachLeaf([&](VelocityLeaf& leaf, Wanted& one) { one = activate(sampled, leaf); });
        size_t all = 0;
        for (Wanted& one : wanted) one.first = std::exchange(all, all + one.count);
        positions.resize(all);
        forEachLeaf([&](VelocityLeaf& leaf, const Wanted& one) {
            size_t k = one.first;
            for (auto voxel = leaf.cbeginValueOn(); voxel; ++voxel) positions[k++] = sampled.centre(voxel.getCoord());
        });
        source(positions, velocities);
        forEachLeaf([&](VelocityLeaf& leaf, const Wanted& one) {
            size_t k = 0;
            for (auto voxel = leaf.beginValueOn(); voxel; ++voxel, ++k) {
                const Vec3f v = velocities[one.first + k] * (one.factors.empty() ? 1.0f : one.factors[k]);
                voxel.setValue({v[0], v[1], v[2]});
            }
            addWall(sampled, leaf);
        });
        if (monitor.report) monitor.report(static_cast<double>(begin + count) / static_cast<double>(leaves.size()));
        monitor.check();
    }
}

void sampleCollocated(const FlowOnVoxels& sampled, VelocityLeaf& leaf) {
    const bool whole = sampled.inBox(leaf.origin()), fades = !sampled.isFar(leaf.origin());
    for (int plane = 0; plane < kLeafEdge; ++plane) {
        PointBatch points = centresOfPlane(leaf.origin(), plane, sampled.voxel);
        Factors factors;
        const uint64_t active = activePoints(sampled, points, whole, fades, factors);
        if (active == 0) continue;
        std::array<uint8_t, kBatch> voxel; // in the plane
        if (active != kAll) compact(active, points, factors, voxel);
        VecBatch<float> v;
        sampled.flow.velocity(points, v);
        if (fades)
            for (auto& axis : v.c)
                for (size_t i = 0; i < kBatch; ++i) axis[i] *= factors[i];
        openvdb::Vec3s* values = leaf.buffer().data() + plane * kBatch;
        for (size_t i = 0; i < static_cast<size_t>(points.size); ++i)
            values[active == kAll ? i : voxel[i]] = {v.c[0][i], v.c[1][i], v.c[2][i]};
        leaf.getValueMask().getWord<uint64_t>(plane) = active;
    }
    addWall(sampled, leaf);
}

} // namespace curlew
