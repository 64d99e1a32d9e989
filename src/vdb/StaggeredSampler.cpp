// SPDX-License-Identifier: Apache-2.0
#include "FlowSampler.h"
#include "curlew/field/Algebra.h"
#include "curlew/flow/Domain.h"
#include "curlew/vdb/Openvdb.h"

#include <algorithm>
#include <cmath>
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

/// Returns the values of a field on a lattice, by the numbers of its combinations; 0 at others.
std::vector<double> valuesOn(const PointLattice& lattice, const ScalarField& field) {
    const auto on = field.onLattice<double, 0>(lattice);
    std::vector<double> values(lattice.combinations());
    lattice.forEachBatch([&](const LatticeBatch& batch) {
        JetBatch<double, 0> jets;
        on(batch, jets);
        const double* from = jets.c[0].data();
        if (batch.chosen.empty())
            std::copy_n(from, batch.points.size, &values[batch.first]);
        else
            for (const uint32_t number : batch.chosen) values[number] = *from++;
    });
    return values;
}

/// Whether each corner has some property.
using Flags = std::vector<uint8_t>;

/// Returns the numbers of the corners whose flag is set.
Numbers numbersOf(const Flags& flags) {
    Numbers numbers(flags.size());
    size_t count = 0;
    for (uint32_t n = 0; n < flags.size(); ++n) {
        numbers[count] = n;
        count += flags[n];
    }
    numbers.resize(count);
    return numbers;
}

/// Flags the corners of leaves.
Flags cornersOf(std::span<const Coord> leaves, const openvdb::CoordBBox& box, const Corners& corners) {
    constexpr size_t kCorners = kLeafEdge + 1; // along an edge of a leaf
    Flags flags(corners.count());
    for (const Coord& leaf : leaves) {
        const size_t first = corners.numberOf(leaf - box.min());
        for (size_t i = 0; i < kCorners; ++i)
            for (size_t j = 0; j < kCorners; ++j)
                std::fill_n(&flags[first + i * corners.step[0] + j * corners.step[1]], kCorners, uint8_t{1});
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
    const size_t count = values.size();
    Flags flows(count);
    for (size_t n = 0; n < count; ++n) {
        values[n] = fade.at(values[n]);
        flows[n] = values[n] > 0 ? 1 : 0;
    }
    return flows;
}

void keepOnly(const Flags& these, Flags& flags) {
    const size_t count = flags.size();
    const uint8_t* kept = these.data();
    uint8_t* __restrict values = flags.data();
    for (size_t n = 0; n < count; ++n) values[n] &= kept[n];
}

/// The terms of a flow that fades, on a lattice of the corners that are needed. f vanishes where the flow has faded,
/// and g matters only where f does not vanish and one edge from there.
std::vector<StaggeredBrick::Term> fadingTerms(const FlowOnVoxels& sampled, const Corners& corners, const Flags& needed,
                                              const PointLattice& lattice) {
    std::vector<double> fade = valuesOn(lattice, sampled.flow.domain().wall->sdf.distance);
    Flags flows = fadeBy(sampled.fade, fade);
    keepOnly(needed, flows);
    const Numbers ofF = numbersOf(flows);
    if (ofF.empty()) return {};
    Flags near = widened(flows, corners);
    keepOnly(needed, near);
    const Numbers ofG = numbersOf(near);
    std::vector<StaggeredBrick::Term> terms;
    for (const auto& [f, g] : sampled.flow.terms()) {
        terms.push_back(
            {valuesOn(corners.lattice(ofF, *lattice.memo), f), valuesOn(corners.lattice(ofG, *lattice.memo), g)});
        for (size_t n = 0; n < fade.size(); ++n) terms.back().f[n] *= fade[n];
    }
    return terms;
}

/// A potential of a term where the flow fades: its mean, and what the slope of its fade adds to the velocity, as sums
/// over positions, weighted with the squared gradient of the other potential.
class FadingPotential {
  public:
    void add(double value, double weight) {
        if (mWeights == 0) mFirst = value;
        mWeights += weight;
        mSum += weight * (value - mFirst);
        mSquares += weight * (value - mFirst) * (value - mFirst);
    }
    double mean() const { return mWeights > 0 ? mFirst + mSum / mWeights : mFirst; }
    /// Sum of squares, up to a common factor, of what the potential adds if the mean is subtracted from it.
    double added() const { return mWeights > 0 ? std::max(0.0, mSquares - mSum * mSum / mWeights) : 0; }

  private:
    double mFirst = 0; ///< All values are taken relative to the first.
    double mWeights = 0, mSum = 0, mSquares = 0;
};
using FadingTerm = std::array<FadingPotential, 2>;

/// A position in the middle of the fade.
struct InFade {
    Vec3d position;
    double weight;
};

/// Returns positions all around the wall, one for each cell of a lattice that is near the middle of the fade. A cell
/// that comes near it as the wall moves gains its weight smoothly.
std::vector<InFade> positionsInFade(const FlowOnVoxels& sampled) {
    constexpr double kCells = 16; // along the longest edge of the wall's box
    constexpr size_t kMost = 1 << 16;
    const Wall& wall = *sampled.flow.domain().wall;
    const double level = sampled.fade.middle();
    const Domain around{
        .box = (wall.sdf.bounds.finite() ? wall.sdf.bounds : sampled.flow.domain().box).padded(std::abs(level)),
        .wall = wall};
    const Vec3d edges = around.box.size();
    const double size = std::max({edges[0], edges[1], edges[2]}) / kCells;
    std::vector<InFade> positions;
    for (const auto& cell : coveringCells(around, around.box.lower, size, {level - size, level + size}, kMost)) {
        Vec3d p;
        for (int axis = 0; axis < 3; ++axis) p[axis] = around.box.lower[axis] + size * (cell[axis] + 0.5);
        const double weight = 1 - std::abs(wall.sdf.distance.at<0>(p).value - level) / size;
        if (!(weight > 0)) continue;
        constexpr int kSteps = 3; // of Newton's method
        for (int step = 0; step < kSteps; ++step) {
            const auto d = wall.sdf.distance.at<1>(p);
            p = p - d.gradient * ((d.value - level) / std::max(dot(d.gradient, d.gradient), 0.1));
        }
        positions.push_back({p, weight});
    }
    return positions;
}

std::vector<FadingTerm> fadingTermsOf(const FlowOnVoxels& sampled) {
    std::vector<FadingTerm> terms(sampled.flow.terms().size());
    for (const auto& [p, weight] : positionsInFade(sampled)) {
        const double factor = sampled.fade.at(sampled.flow.domain().wall->sdf.distance.at<0>(p).value);
        if (!(factor > 0 && factor < 1)) continue;
        for (size_t term = 0; term < terms.size(); ++term) {
            const auto f = sampled.flow.terms()[term][0].at<1>(p), g = sampled.flow.terms()[term][1].at<1>(p);
            terms[term][0].add(f.value, weight * dot(g.gradient, g.gradient));
            terms[term][1].add(g.value, weight * dot(f.gradient, f.gradient));
        }
    }
    return terms;
}

} // namespace

Flow potentialsToFade(const FlowOnVoxels& sampled) {
    if (!sampled.fade.oneSided()) return sampled.flow;
    const std::vector<FadingTerm> fading = fadingTermsOf(sampled);
    std::vector<Flow::Potentials> terms;
    for (size_t term = 0; term < fading.size(); ++term) {
        const auto& [f, g] = sampled.flow.terms()[term];
        const auto& [ofF, ofG] = fading[term];
        const double ofBoth = ofF.added() + ofG.added();
        // From 0 to 1 where the squares are between half and twice of each other.
        const double share = ofBoth > 0 ? quinticFade(3 * ofG.added() / ofBoth - 1).value : 1;
        const auto part = [](double weight, const ScalarField& field) { return weight == 1 ? field : weight * field; };
        if (share > 0) terms.push_back({part(share, f - constantField<3>(ofF.mean())), g});
        if (share < 1) terms.push_back({part(1 - share, constantField<3>(ofG.mean()) - g), f});
    }
    return Flow(std::move(terms), sampled.flow.domain());
}

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
    if (sampled.isFar(mOrigin, edge))
        for (const auto& [f, g] : sampled.flow.terms()) mTerms.push_back({valuesOn(all, f), valuesOn(all, g)});
    else
        mTerms = fadingTerms(sampled, corners, needed, all);
    if (!sampled.moving || sampled.rests(mOrigin, edge)) return;
    for (const auto& [f, g] : sampled.moving->terms()) mTerms.push_back({valuesOn(all, f), valuesOn(all, g)});
}

namespace {

// Rows along z. Not inline: GCC would unroll the loops for a known count, and then not vectorise them.

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

} // namespace

void StaggeredBrick::sample(VelocityLeaf& leaf) const {
    Edges edges;
    integrate(leaf.origin(), edges);
    const auto& [x, y, z] = edges;
    const double perArea = 1 / (mSampled.voxels.size * mSampled.voxels.size);
    openvdb::Vec3s* values = leaf.buffer().data();
    for (size_t i = 0; i < kLeafEdge; ++i)
        for (size_t j = 0; j < kLeafEdge; ++j) {
            std::array<std::array<float, kLeafEdge>, 3> v;
            const size_t n = i * kEdgeX + j * kEdgeY;
            faceVelocities(&y[n], &z[n], &y[n + 1], &z[n + kEdgeY], perArea, kLeafEdge, v[0].data());
            faceVelocities(&z[n], &x[n], &z[n + kEdgeX], &x[n + 1], perArea, kLeafEdge, v[1].data());
            faceVelocities(&x[n], &y[n], &x[n + kEdgeY], &y[n + kEdgeX], perArea, kLeafEdge, v[2].data());
            for (size_t k = 0; k < kLeafEdge; ++k) *values++ = {v[0][k], v[1][k], v[2][k]};
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
/// bits.
void StaggeredBrick::integrate(const Coord& leaf, Edges& edges) const {
    constexpr size_t kCorners = kLeafEdge + 1; // along an edge of the leaf
    const Coord lowest = leaf - mOrigin;
    size_t first = 0;
    for (size_t axis = 0; axis < 3; ++axis) first += static_cast<size_t>(lowest[static_cast<int>(axis)]) * mStep[axis];
    for (auto& sums : edges) sums.fill(0);
    for (const Term& t : mTerms)
        for (size_t axis = 0; axis < 3; ++axis) {
            // No edge begins at the last corner along the axis.
            const size_t endI = kCorners - (axis == 0), endJ = kCorners - (axis == 1), step = mStep[axis];
            for (size_t i = 0; i < endI; ++i)
                for (size_t j = 0; j < endJ; ++j) {
                    const size_t from = first + i * mStep[0] + j * mStep[1];
                    const double *f = &t.f[from], *g = &t.g[from];
                    double* sums = &edges[axis][i * kEdgeX + j * kEdgeY];
                    addIntegrals(f, g, step, kCorners - (axis == 2), sums);
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
    for (openvdb::Index n = 0; n < VelocityLeaf::SIZE; ++n) {
        openvdb::Vec3s& v = leaf.buffer().data()[n];
        const bool flows = !domain.wall || v != openvdb::Vec3s(0);
        if (flows && (whole || domain.box.contains(mSampled.centre(leaf.offsetToGlobalCoord(n)))))
            leaf.setValueOn(n);
        else
            v = openvdb::Vec3s(0);
    }
}

} // namespace curlew
