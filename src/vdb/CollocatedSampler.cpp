// SPDX-License-Identifier: Apache-2.0
#include "FlowSampler.h"
#include "curlew/base/Parallel.h"
#include "curlew/vdb/Openvdb.h"

#include <utility>

namespace curlew {

namespace {

/// The voxels of one plane of a leaf form a batch, and a word of the leaf's active mask.
static_assert(kBatch == kLeafEdge * kLeafEdge);

/// The centres of the voxels of a leaf.
class LeafPoints {
  public:
    LeafPoints(const openvdb::Coord& origin, const Voxels& voxels) {
        for (int axis = 0; axis < 3; ++axis)
            for (int k = 0; k < kLeafEdge; ++k)
                mCoordinates[static_cast<size_t>(axis)][static_cast<size_t>(k)] = voxels.at(axis, origin[axis] + k);
    }
    /// The lattice of those with these numbers; empty: all.
    PointLattice lattice(std::span<const uint32_t> numbers = {}) {
        const auto& [x, y, z] = mCoordinates;
        return {{x, y, z}, numbers, &mMemo};
    }
    Vec3d operator[](uint32_t n) const {
        constexpr uint32_t kEdge = kLeafEdge;
        const auto& [x, y, z] = mCoordinates;
        return {{x[n / (kEdge * kEdge)], y[n / kEdge % kEdge], z[n % kEdge]}};
    }

  private:
    std::array<std::array<double, kLeafEdge>, 3> mCoordinates;
    LatticeMemo mMemo;
};

/// The voxels of a leaf where the velocity is not zero.
class ActiveVoxels {
  public:
    ActiveVoxels(const FlowOnVoxels& sampled, const openvdb::Coord& leaf, LeafPoints& points) {
        if (!sampled.isFar(leaf)) fade(sampled, points.lattice());
        const bool inBox = sampled.inBox(leaf);
        const Box& box = sampled.flow.domain().box;
        if (mFades || !inBox) choose([&](uint32_t n) { return factor(n) > 0 && (inBox || box.contains(points[n])); });
    }

    size_t count() const { return mCount; }
    bool all() const { return mCount == VelocityLeaf::SIZE; }
    /// Their numbers in the leaf; empty if all are active.
    std::span<const uint32_t> numbers() const { return {mNumbers.data(), all() ? 0 : mCount}; }
    uint32_t number(size_t n) const { return all() ? static_cast<uint32_t>(n) : mNumbers[n]; }
    /// Whether the factor differs from 1 somewhere.
    bool fades() const { return mFades; }
    /// The factor of the velocity at the voxel with this number.
    float factor(uint32_t number) const { return mFades ? mFactors[number] : 1; }

  private:
    void fade(const FlowOnVoxels& sampled, const PointLattice& lattice) {
        const ScalarField& distance = sampled.flow.domain().wall->sdf.distance;
        if (sampled.inLevelSet()) {
            const auto distances = distance.onLattice<float, 1>(lattice); // as the flow will need them
            lattice.forEachBatch([&](const LatticeBatch& batch) {
                JetBatch<float, 1> d;
                distances(batch, d);
                setFactors(sampled.fade, batch.first(), d.c[0]);
            });
        } else {
            lattice.forEachBatch([&](const LatticeBatch& batch) {
                JetBatch<float, 0> d;
                distance.eval(batch.points(), d);
                setFactors(sampled.fade, batch.first(), d.c[0]);
            });
        }
        mFades = true;
    }
    void setFactors(const WallFade& fade, size_t first, const std::array<float, kBatch>& distances) {
        const auto factors = std::span(mFactors).subspan(first, kBatch);
        std::copy(distances.begin(), distances.end(), factors.begin());
        fade.replace(factors);
    }
    template <class Wanted>
    void choose(const Wanted& wanted) {
        mCount = 0;
        for (uint32_t n = 0; n < VelocityLeaf::SIZE; ++n)
            if (wanted(n)) mNumbers[mCount++] = n;
    }

    std::array<float, VelocityLeaf::SIZE> mFactors;
    std::array<uint32_t, VelocityLeaf::SIZE> mNumbers;
    size_t mCount = VelocityLeaf::SIZE;
    bool mFades = false;
};

PointBatch centresOfPlane(const openvdb::Coord& origin, int plane, const Voxels& voxels) {
    PointBatch points;
    points.size = kBatch;
    points.c[0].fill(voxels.at(0, origin[0] + plane));
    for (int j = 0; j < kLeafEdge; ++j)
        for (int k = 0; k < kLeafEdge; ++k) {
            const int n = j * kLeafEdge + k;
            points.c[1][static_cast<size_t>(n)] = voxels.at(1, origin[1] + j);
            points.c[2][static_cast<size_t>(n)] = voxels.at(2, origin[2] + k);
        }
    return points;
}

/// Adds the wall's velocity to a plane, and activates those voxels in the box where it is not zero.
void addWall(const FlowOnVoxels& sampled, bool whole, int plane, VelocityLeaf& leaf) {
    const PointBatch points = centresOfPlane(leaf.origin(), plane, sampled.voxels);
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
    LeafPoints points(leaf.origin(), sampled.voxels);
    const ActiveVoxels active(sampled, leaf.origin(), points);
    Wanted wanted{.count = active.count(), .factors = {}};
    for (size_t n = 0; n < wanted.count; ++n) {
        leaf.setValueOn(active.number(n));
        if (active.fades()) wanted.factors.push_back(active.factor(active.number(n)));
    }
    return wanted;
}

/// Stores the velocities of a batch, and activates its voxels.
void store(const LatticeBatch& batch, const VecBatch<float>& velocities, const ActiveVoxels& active,
           VelocityLeaf& leaf) {
    const auto& [x, y, z] = velocities.c;
    openvdb::Vec3s* values = leaf.buffer().data();
    if (active.all() && !active.fades()) {
        for (size_t i = 0; i < kBatch; ++i) values[batch.first() + i] = {x[i], y[i], z[i]};
        return;
    }
    for (size_t i = 0; i < static_cast<size_t>(batch.size()); ++i) {
        const uint32_t number = active.number(batch.first() + i);
        const float factor = active.factor(number);
        values[number] = {x[i] * factor, y[i] * factor, z[i] * factor};
        leaf.setValueOn(number);
    }
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
    LeafPoints points(leaf.origin(), sampled.voxels);
    const ActiveVoxels active(sampled, leaf.origin(), points);
    if (active.count() > 0) {
        const PointLattice lattice = points.lattice(active.numbers());
        // Formulas and noises gain nothing from a lattice.
        const auto onLattice = sampled.inLevelSet() ? sampled.flow.onLattice(lattice) : nullptr;
        lattice.forEachBatch([&](const LatticeBatch& batch) {
            VecBatch<float> velocities;
            if (onLattice)
                onLattice(batch, velocities);
            else
                sampled.flow.velocity(batch.points(), velocities);
            store(batch, velocities, active, leaf);
        });
        if (active.all()) leaf.setValuesOn();
    }
    addWall(sampled, leaf);
}

} // namespace curlew
