// SPDX-License-Identifier: Apache-2.0
#include "FlowSampler.h"
#include "curlew/vdb/Openvdb.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numeric>
#include <utility>

namespace curlew {

using openvdb::Coord;

namespace {

using Numbers = std::vector<uint32_t>;

/// The corners of the voxels in a box.
struct Corners {
    std::array<std::vector<double>, 3> coordinates;
    std::array<size_t, 3> step; ///< From a corner to the next one along each axis.

    Corners(const openvdb::CoordBBox& box, const Voxels& voxels) {
        for (int axis = 0; axis < 3; ++axis)
            for (int k = box.min()[axis]; k <= box.max()[axis] + 1; ++k)
                coordinates[static_cast<size_t>(axis)].push_back(voxels.at(axis, k - 0.5));
        step = {coordinates[1].size() * coordinates[2].size(), coordinates[2].size(), 1};
    }
    /// The lattice of those with these numbers; empty: all.
    PointLattice lattice(const Numbers& numbers, LatticeMemo& memo) const {
        const auto& [x, y, z] = coordinates;
        return {{x, y, z}, numbers, &memo};
    }
    size_t count() const { return coordinates[0].size() * step[0]; }
    size_t numberOf(const Coord& corner) const {
        return static_cast<size_t>(corner[0]) * step[0] + static_cast<size_t>(corner[1]) * step[1] +
               static_cast<size_t>(corner[2]);
    }
};

/// Values of a field on a lattice, by the numbers of its combinations; 0 at others.
using Values = std::vector<double>;

/// Returns the values of some fields on a lattice.
template <size_t Count>
std::array<Values, Count> valuesOn(const PointLattice& lattice, const std::array<ScalarField, Count>& fields) {
    std::array<OnLattice<double, 0>, Count> on;
    std::array<Values, Count> values;
    for (size_t k = 0; k < Count; ++k) {
        const ScalarField& field = fields[k];
        on[k] = field.onLattice<double, 0>(lattice);
        values[k].resize(lattice.combinations());
    }
    lattice.forEachBatch([&](const LatticeBatch& batch) {
        for (size_t k = 0; k < Count; ++k) {
            JetBatch<double, 0> jets;
            on[k](batch, jets);
            const double* from = jets.c[0].data();
            double* to = values[k].data();
            batch.forEachRun(
                [&](size_t first, size_t number, size_t length) { std::copy_n(from + first, length, to + number); });
        }
    });
    return values;
}

StaggeredBrick::Term termOn(const PointLattice& lattice, const Flow::Potentials& potentials) {
    auto [f, g] = valuesOn(lattice, potentials);
    return {std::move(f), std::move(g)};
}

/// Whether each corner has some property: 1 or 0.
using Flags = std::vector<uint8_t>;

/// Returns the numbers of the corners whose flag is set.
Numbers numbersOf(const Flags& flags) {
    constexpr size_t kAtOnce = 8; // mostly, all of these are set or none is
    constexpr uint64_t kAllSet = 0x0101010101010101;
    Numbers numbers(flags.size() + 1); // and a place for the number of a corner that does not count
    uint32_t* next = numbers.data();
    const auto one = [&](size_t n) {
        *next = static_cast<uint32_t>(n);
        next += flags[n];
    };
    size_t n = 0;
    for (; n + kAtOnce <= flags.size(); n += kAtOnce) {
        uint64_t word;
        std::memcpy(&word, &flags[n], kAtOnce);
        if (word == 0) continue;
        if (word == kAllSet) {
            std::iota(next, next + kAtOnce, static_cast<uint32_t>(n));
            next += kAtOnce;
        } else {
            for (size_t k = n; k < n + kAtOnce; ++k) one(k);
        }
    }
    for (; n < flags.size(); ++n) one(n);
    numbers.resize(static_cast<size_t>(next - numbers.data()));
    return numbers;
}

/// Flags the corners of leaves.
Flags cornersOf(std::span<const Coord> leaves, const openvdb::CoordBBox& box, const Corners& corners) {
    Flags flags(corners.count());
    for (const Coord& leaf : leaves) {
        const size_t first = corners.numberOf(leaf - box.min());
        for (size_t i = 0; i < kLeafCorners; ++i)
            for (size_t j = 0; j < kLeafCorners; ++j)
                std::fill_n(&flags[first + i * corners.step[0] + j * corners.step[1]], kLeafCorners, uint8_t{1});
    }
    return flags;
}

/// Sets flags that are set in `from` too.
void addFlags(const uint8_t* from, size_t count, uint8_t* __restrict flags) {
    for (size_t n = 0; n < count; ++n) flags[n] |= from[n];
}

/// Flags also the next corners along each axis, and at the ends of lines some others.
Flags widened(const Flags& flags, const Corners& corners) {
    Flags wider = flags;
    for (const size_t step : corners.step) {
        addFlags(flags.data(), flags.size() - step, wider.data() + step);
        addFlags(flags.data() + step, flags.size() - step, wider.data());
    }
    return wider;
}

/// Replaces distances from the wall by the factors of the flow there, and returns where they are not zero.
Flags fadeBy(const WallFade& fade, std::vector<double>& values) {
    fade.replace(std::span(values));
    const size_t count = values.size();
    Flags flows(count);
    const double* factors = values.data();
    uint8_t* __restrict flags = flows.data();
    for (size_t n = 0; n < count; ++n) flags[n] = factors[n] > 0 ? 1 : 0;
    return flows;
}

void keepOnly(const Flags& these, Flags& flags) {
    const size_t count = flags.size();
    const uint8_t* kept = these.data();
    uint8_t* __restrict values = flags.data();
    for (size_t n = 0; n < count; ++n) values[n] &= kept[n];
}

/// The terms of a flow that fades, on a lattice of the corners that are needed. f vanishes where the flow has faded,
/// and g matters only where f does not vanish and one edge from there. There, both are computed, in the same batches.
std::vector<StaggeredBrick::Term> fadingTerms(const FlowOnVoxels& sampled, const Corners& corners, const Flags& needed,
                                              const PointLattice& lattice) {
    auto [fade] = valuesOn(lattice, std::array{sampled.flow.domain().wall->sdf.distance});
    Flags flows = fadeBy(sampled.fade, fade);
    keepOnly(needed, flows);
    Flags near = widened(flows, corners);
    keepOnly(needed, near);
    const Numbers numbers = numbersOf(near);
    std::vector<StaggeredBrick::Term> terms;
    if (numbers.empty()) return terms;
    for (const auto& potentials : sampled.flow.terms()) {
        terms.push_back(termOn(corners.lattice(numbers, *lattice.memo), potentials));
        const double* factors = fade.data();
        double* __restrict f = terms.back().f.data();
        // A product would not be 0 where f is not finite.
        for (size_t n = 0; n < fade.size(); ++n) f[n] = factors[n] > 0 ? factors[n] * f[n] : 0;
    }
    return terms;
}

} // namespace

StaggeredBrick::StaggeredBrick(const FlowOnVoxels& sampled, std::span<const Coord> leaves) : mSampled(sampled) {
    openvdb::CoordBBox box;
    for (const Coord& leaf : leaves) box.expand(openvdb::CoordBBox::createCube(leaf, kLeafEdge));
    const Corners corners(box, sampled.voxels);
    mOrigin = box.min();
    mStep = corners.step;
    LatticeMemo memo;
    Flags needed(corners.count(), 1);
    Numbers numbers; // empty: all
    if (leaves.size() * VelocityLeaf::SIZE < box.volume()) {
        needed = cornersOf(leaves, box, corners);
        numbers = numbersOf(needed);
    }
    const PointLattice all = corners.lattice(numbers, memo);
    const int edge = box.dim()[box.maxExtent()];
    mFar = sampled.isFar(mOrigin, edge);
    if (mFar)
        for (const auto& potentials : sampled.flow.terms()) mTerms.push_back(termOn(all, potentials));
    else
        mTerms = fadingTerms(sampled, corners, needed, all);
    if (!sampled.moving || sampled.rests(mOrigin, edge)) return;
    for (const auto& potentials : sampled.moving->terms()) mTerms.push_back(termOn(all, potentials));
}

namespace {

// Rows along z. Not inline: GCC would unroll the loops for a known count, and then not vectorise them.

[[gnu::noinline]] bool anyNonzero(const double* values, size_t count) {
    int64_t nonzero = 0;
    for (size_t k = 0; k < count; ++k) nonzero += static_cast<int64_t>(values[k] != 0);
    return nonzero != 0;
}

/// Integrates f dg from each of `count` corners to the one that is `step` further, and adds that to the sums.
[[gnu::noinline]] void addIntegrals(const double* f, const double* g, size_t step, size_t count,
                                    double* __restrict sums) {
    for (size_t k = 0; k < count; ++k) sums[k] += 0.5 * (f[k] + f[k + step]) * (g[k + step] - g[k]);
}

/// Computes the velocities through `count` faces from the integrals over the edges around them: a and b begin at the
/// lowest corner of a face, nextA and nextB at the other end of the edge of b and a.
[[gnu::noinline]] void faceVelocities(const double* a, const double* b, const double* nextA, const double* nextB,
                                      double perArea, size_t count, float* __restrict velocities) {
    for (size_t k = 0; k < count; ++k)
        velocities[k] = static_cast<float>((a[k] + nextB[k] - nextA[k] - b[k]) * perArea);
}

/// Returns which voxels of a row have a velocity other than zero: a bit for each.
unsigned flowingIn(const openvdb::Vec3s* row) {
    constexpr int kNumbers = 3 * kLeafEdge;
    const float* numbers = row->asPointer();
    int count = 0; // all or none, in most rows
    for (int k = 0; k < kNumbers; ++k) count += static_cast<int>(numbers[k] != 0);
    if (count == 0) return 0;
    if (count == kNumbers) return 0xff;
    unsigned bits = 0;
    for (unsigned k = 0; k < kLeafEdge; ++k) bits |= static_cast<unsigned>(row[k] != openvdb::Vec3s(0)) << k;
    return bits;
}

} // namespace

void StaggeredBrick::sample(VelocityLeaf& leaf) const {
    Edges edges;
    Rows flowing;
    integrate(leaf.origin(), edges, flowing);
    const auto& [x, y, z] = edges;
    const double perArea = 1 / (mSampled.voxels.size * mSampled.voxels.size);
    openvdb::Vec3s* values = leaf.buffer().data();
    for (size_t i = 0; i < kLeafEdge; ++i)
        for (size_t j = 0; j < kLeafEdge; ++j, values += kLeafEdge) {
            if (!(flowing[i][j] || flowing[i + 1][j] || flowing[i][j + 1] || flowing[i + 1][j + 1])) {
                std::fill_n(values, kLeafEdge, openvdb::Vec3s(0));
                continue;
            }
            std::array<std::array<float, kLeafEdge>, 3> v;
            const size_t n = i * kEdgeX + j * kEdgeY;
            faceVelocities(&y[n], &z[n], &y[n + 1], &z[n + kEdgeY], perArea, kLeafEdge, v[0].data());
            faceVelocities(&z[n], &x[n], &z[n + kEdgeX], &x[n + 1], perArea, kLeafEdge, v[1].data());
            faceVelocities(&x[n], &y[n], &x[n + kEdgeY], &y[n + kEdgeX], perArea, kLeafEdge, v[2].data());
            for (size_t k = 0; k < kLeafEdge; ++k) values[k] = {v[0][k], v[1][k], v[2][k]};
        }
    if (mSampled.moving && !mSampled.moving->rigid()) addPointValues(leaf);
    activate(leaf);
}

/// Adds the velocity of a deforming wall, which has no potentials, at the centres of the faces.
void StaggeredBrick::addPointValues(VelocityLeaf& leaf) const {
    if (mSampled.rests(leaf.origin())) return;
    for (int axis = 0; axis < 3; ++axis)
        for (int plane = 0; plane < kLeafEdge; ++plane) {
            PointBatch points;
            for (int j = 0; j < kLeafEdge; ++j)
                for (int k = 0; k < kLeafEdge; ++k) {
                    Vec3d p = mSampled.centre(leaf.origin().offsetBy(plane, j, k));
                    p[axis] -= 0.5 * mSampled.voxels.size;
                    points.push(p);
                }
            VecBatch<double> w;
            mSampled.moving->eval(points, w);
            openvdb::Vec3s* values = leaf.buffer().data() + plane * kBatch;
            for (int i = 0; i < kBatch; ++i) values[i][axis] += static_cast<float>(w[i][axis]);
        }
}

/// Integrates f dg over every edge in the direction of its axis, so that all faces that share the edge use the same
/// bits. `flowing`: the rows of corners where the f of any term may not be zero: all, if it fades nowhere.
void StaggeredBrick::integrate(const Coord& leaf, Edges& edges, Rows& flowing) const {
    const auto step = mStep;
    const Coord lowest = leaf - mOrigin;
    size_t first = 0;
    for (size_t axis = 0; axis < 3; ++axis) first += static_cast<size_t>(lowest[static_cast<int>(axis)]) * step[axis];
    for (auto& sums : edges) sums.fill(0);
    flowing = {};
    for (const Term& t : mTerms) {
        const double *f = &t.f[first], *g = &t.g[first];
        Rows own;
        for (size_t i = 0; i < kLeafCorners; ++i)
            for (size_t j = 0; j < kLeafCorners; ++j) {
                own[i][j] = mFar || anyNonzero(f + i * step[0] + j * step[1], kLeafCorners);
                flowing[i][j] |= own[i][j];
            }
        for (size_t axis = 0; axis < 3; ++axis) {
            // No edge begins at the last corner along the axis.
            const size_t alongX = axis == 0, alongY = axis == 1, alongZ = axis == 2;
            for (size_t i = 0; i < kLeafCorners - alongX; ++i)
                for (size_t j = 0; j < kLeafCorners - alongY; ++j) {
                    if (!own[i][j] && !own[i + alongX][j + alongY]) continue;
                    const size_t from = i * step[0] + j * step[1];
                    double* sums = &edges[axis][i * kEdgeX + j * kEdgeY];
                    addIntegrals(f + from, g + from, step[axis], kLeafCorners - alongZ, sums);
                }
        }
    }
}

/// Activates the voxels in the box; if there is a wall, only those with a velocity. A flow inside a wall ends at the
/// wall, so its box is ignored.
void StaggeredBrick::activate(VelocityLeaf& leaf) const {
    const Domain& domain = mSampled.flow.domain();
    const bool contained = domain.wall && domain.wall->side == Side::inside;
    const bool whole = contained || mSampled.inBox(leaf.origin());
    if (whole && !domain.wall) return leaf.setValuesOn();
    for (openvdb::Index row = 0; row < VelocityLeaf::SIZE / kLeafEdge; ++row) {
        openvdb::Vec3s* values = leaf.buffer().data() + row * kLeafEdge;
        unsigned active = domain.wall ? flowingIn(values) : 0xff;
        for (unsigned k = 0; k < kLeafEdge && !whole; ++k)
            if (!domain.box.contains(mSampled.centre(leaf.offsetToGlobalCoord(row * kLeafEdge + k))))
                active &= ~(1U << k);
        for (unsigned k = 0; k < kLeafEdge && active != 0xff; ++k)
            if ((active >> k & 1U) == 0) values[k] = openvdb::Vec3s(0);
        leaf.getValueMask().getWord<openvdb::Byte>(row) = static_cast<openvdb::Byte>(active);
    }
}

} // namespace curlew
