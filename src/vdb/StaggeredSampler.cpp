// SPDX-License-Identifier: Apache-2.0
#include "FlowSampler.h"
#include "curlew/vdb/Openvdb.h"

#include <algorithm>
#include <utility>

namespace curlew {

using openvdb::Coord;

StaggeredBrick::StaggeredBrick(const FlowOnVoxels& sampled, const Coord& origin)
    : mSampled(sampled),
      mOrigin(origin),
      mWallTerms(sampled.moving ? sampled.moving->terms() : std::vector<Flow::Potentials>{}),
      mTerms(sampled.flow.terms().size() + mWallTerms.size()) {
    for (int axis = 0; axis < 3; ++axis)
        for (int k = 0; k < kEdge; ++k)
            mCorners[static_cast<size_t>(axis)][static_cast<size_t>(k)] = (mOrigin[axis] + k - 0.5) * mSampled.voxel;
}

void StaggeredBrick::evaluateAll() {
    const auto& [x, y, z] = mCorners;
    const PointLattice all{{x, y, z}};
    const Parts parts = partsIn(mOrigin, kLeaves * kLeafEdge);
    const std::vector<double> fade = fadeOn(all, parts);
    for (size_t t = 0; t < mTerms.size(); ++t) evaluate(t, all, parts, fade, *mTerms[t].f, *mTerms[t].g);
    mKnown.set();
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

void StaggeredBrick::sample(VelocityLeaf& leaf) {
    if (!mKnown.all()) evaluateCornersOf(leaf.origin());
    Edges edges;
    integrate(leaf.origin(), edges);
    const auto& [x, y, z] = edges;
    const double perArea = 1 / (mSampled.voxel * mSampled.voxel);
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
                    p[axis] -= 0.5 * mSampled.voxel;
                    points.push(p);
                }
            VecBatch<double> w;
            mSampled.moving->eval(points, w);
            openvdb::Vec3s* values = leaf.buffer().data() + plane * kBatch;
            for (int i = 0; i < kBatch; ++i) values[i][axis] += static_cast<float>(w[i][axis]);
        }
}

/// Computes the potentials at the corners of a leaf, except on its lower sides if these are known.
void StaggeredBrick::evaluateCornersOf(const Coord& leaf) {
    constexpr size_t kCorners = kLeafEdge + 1;
    const Coord lower = leaf - mOrigin;
    std::array<size_t, 3> first{};
    PointLattice corners;
    for (size_t axis = 0; axis < 3; ++axis) {
        first[axis] = sideKnown(lower, axis);
        const auto begin = static_cast<size_t>(lower[static_cast<int>(axis)]) + first[axis];
        corners.coordinates[axis] = std::span(mCorners[axis]).subspan(begin, kCorners - first[axis]);
    }
    // Corners that are known keep their values, which the velocities of other leaves were computed from.
    std::vector<std::pair<size_t, size_t>> places; // in the lattice, and in the brick
    places.reserve(corners.size());
    size_t n = 0;
    for (size_t i = first[0]; i < kCorners; ++i)
        for (size_t j = first[1]; j < kCorners; ++j)
            for (size_t k = first[2]; k < kCorners; ++k, ++n)
                if (const size_t to = cornerAt(lower) + (i * kEdge + j) * kEdge + k; !mKnown[to])
                    places.emplace_back(n, to);
    const Parts parts = partsIn(leaf, kLeafEdge);
    const std::vector<double> fade = fadeOn(corners, parts);
    std::vector<double> f(corners.size()), g(corners.size());
    for (size_t t = 0; t < mTerms.size(); ++t) {
        evaluate(t, corners, parts, fade, f, g);
        for (const auto& [from, to] : places) {
            (*mTerms[t].f)[to] = f[from];
            (*mTerms[t].g)[to] = g[from];
        }
    }
    for (const auto& place : places) mKnown[place.second] = true;
}

/// Returns whether all corners are known that are lowest along an axis among those of the leaf that begins at `lower`.
bool StaggeredBrick::sideKnown(const Coord& lower, size_t axis) const {
    for (int i = 0; i <= kLeafEdge; ++i)
        for (int j = 0; j <= kLeafEdge; ++j) {
            const Coord offset = axis == 0 ? Coord(0, i, j) : axis == 1 ? Coord(i, 0, j) : Coord(i, j, 0);
            if (!mKnown[cornerAt(lower + offset)]) return false;
        }
    return true;
}

/// Returns the factors by which the flow fades, or nothing if it does not.
std::vector<double> StaggeredBrick::fadeOn(const PointLattice& corners, const Parts& parts) const {
    const auto& wall = mSampled.flow.domain().wall;
    if (!parts.fades || !wall) return {};
    std::vector<double> factors(corners.size());
    wall->sdf.distance.eval(corners, factors);
    for (double& value : factors) value = mSampled.fade.at(value);
    return factors;
}

/// Computes the potentials of a term. f of the flow's terms is faded beyond the wall.
void StaggeredBrick::evaluate(size_t term, const PointLattice& corners, const Parts& parts,
                              const std::vector<double>& fade, std::span<double> f, std::span<double> g) const {
    const auto& terms = mSampled.flow.terms();
    const bool ofWall = term >= terms.size();
    const Flow::Potentials& potentials = ofWall ? mWallTerms[term - terms.size()] : terms[term];
    potentials[1].eval(corners, g);
    if (ofWall && parts.rests) {
        std::fill(f.begin(), f.end(), 0);
        return;
    }
    potentials[0].eval(corners, f);
    if (ofWall) return;
    for (size_t n = 0; n < fade.size(); ++n) f[n] *= fade[n];
}

/// Integrates f dg over every edge in the direction of its axis, so that all faces that share the edge use the same
/// bits.
void StaggeredBrick::integrate(const Coord& leaf, Edges& edges) const {
    constexpr std::array<size_t, 3> kStep{size_t{kEdge} * kEdge, kEdge, 1};
    constexpr size_t kCorners = kLeafEdge + 1; // along an edge of the leaf
    const size_t first = cornerAt(leaf - mOrigin);
    for (auto& sums : edges) sums.fill(0);
    for (const Term& t : mTerms)
        for (size_t axis = 0; axis < 3; ++axis) {
            // No edge begins at the last corner along the axis.
            const size_t endI = kCorners - (axis == 0), endJ = kCorners - (axis == 1), step = kStep[axis];
            for (size_t i = 0; i < endI; ++i)
                for (size_t j = 0; j < endJ; ++j) {
                    const size_t from = first + i * kStep[0] + j * kStep[1];
                    const double *f = &(*t.f)[from], *g = &(*t.g)[from];
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
