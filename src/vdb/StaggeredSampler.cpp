// SPDX-License-Identifier: Apache-2.0
#include "FlowSampler.h"
#include "curlew/vdb/Openvdb.h"

#include <algorithm>

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
    const Parts parts = partsIn(mOrigin, kLeaves * kLeafEdge);
    PointBatch points;
    size_t done = 0;
    const auto flush = [&] {
        evaluate(points, parts, [&](size_t t, const Values& f, const Values& g) {
            std::copy_n(f.begin(), points.size, &(*mTerms[t].f)[done]);
            std::copy_n(g.begin(), points.size, &(*mTerms[t].g)[done]);
        });
        done += static_cast<size_t>(points.size);
        points.size = 0;
    };
    for (const double x : mCorners[0])
        for (const double y : mCorners[1])
            for (auto z = mCorners[2].begin(); z != mCorners[2].end();) {
                const auto count = std::min(mCorners[2].end() - z, std::ptrdiff_t{kBatch - points.size});
                std::fill_n(points.c[0].begin() + points.size, count, x);
                std::fill_n(points.c[1].begin() + points.size, count, y);
                std::copy_n(z, count, points.c[2].begin() + points.size);
                points.size += static_cast<int>(count);
                z += count;
                if (points.full()) flush();
            }
    flush();
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

/// Computes the potentials at the corners of a leaf where they are not known yet.
void StaggeredBrick::evaluateCornersOf(const Coord& leaf) {
    const Coord lower = leaf - mOrigin;
    const Parts parts = partsIn(leaf, kLeafEdge);
    PointBatch points;
    std::array<size_t, kBatch> corner;
    for (int i = 0; i <= kLeafEdge; ++i)
        for (int j = 0; j <= kLeafEdge; ++j)
            for (int k = 0; k <= kLeafEdge; ++k) {
                const Coord c = lower.offsetBy(i, j, k);
                const size_t n = cornerAt(c);
                if (mKnown[n]) continue;
                mKnown[n] = true;
                corner[static_cast<size_t>(points.size)] = n;
                Vec3d p;
                for (int axis = 0; axis < 3; ++axis)
                    p[axis] = mCorners[static_cast<size_t>(axis)][static_cast<size_t>(c[axis])];
                points.push(p);
                if (points.full()) store(points, parts, corner);
            }
    if (points.size > 0) store(points, parts, corner);
}

/// Evaluates the potentials at the points, stores them at their corners and empties the batch.
void StaggeredBrick::store(PointBatch& points, const Parts& parts, const std::array<size_t, kBatch>& corner) {
    evaluate(points, parts, [&](size_t t, const Values& f, const Values& g) {
        for (size_t n = 0; n < static_cast<size_t>(points.size); ++n) {
            (*mTerms[t].f)[corner[n]] = f[n];
            (*mTerms[t].g)[corner[n]] = g[n];
        }
    });
    points.size = 0;
}

/// Calls use(term, f, g) with the potentials of each term. f of the flow's terms is faded beyond the wall.
template <class Use>
void StaggeredBrick::evaluate(const PointBatch& points, const Parts& parts, const Use& use) const {
    JetBatch<double, 0> d, f, g;
    if (parts.fades) {
        wallDistances(mSampled.flow.domain(), points, d);
        for (double& value : d.c[0]) value = mSampled.fade.at(value);
    }
    const auto& terms = mSampled.flow.terms();
    for (size_t t = 0; t < terms.size(); ++t) {
        terms[t][0].eval(points, f);
        terms[t][1].eval(points, g);
        if (parts.fades)
            for (size_t n = 0; n < kBatch; ++n) f.c[0][n] *= d.c[0][n];
        use(t, f.c[0], g.c[0]);
    }
    for (size_t t = 0; t < mWallTerms.size(); ++t) {
        f.c[0].fill(0);
        if (!parts.rests) mWallTerms[t][0].eval(points, f);
        mWallTerms[t][1].eval(points, g);
        use(terms.size() + t, f.c[0], g.c[0]);
    }
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
