// SPDX-License-Identifier: Apache-2.0
#include "FlowSampler.h"

#include <algorithm>

namespace curlew {

using openvdb::Coord;

StaggeredBrick::StaggeredBrick(const FlowOnVoxels& sampled, const Coord& origin)
    : mSampled(sampled), mOrigin(origin), mTerms(sampled.flow.terms().size()) {
    for (Term& t : mTerms) {
        t.f.resize(kCount);
        t.g.resize(kCount);
    }
}

/// The lowest corner of a voxel.
Vec3d StaggeredBrick::cornerOf(const Coord& ijk) const {
    const double h = mSampled.voxel;
    return {{(ijk[0] - 0.5) * h, (ijk[1] - 0.5) * h, (ijk[2] - 0.5) * h}};
}

void StaggeredBrick::evaluateAll() {
    const bool fades = !mSampled.isFar(mOrigin, kLeaves * kLeafEdge);
    PointBatch points;
    size_t done = 0;
    const auto flush = [&] {
        evaluate(points, fades, [&](size_t t, const Values& f, const Values& g) {
            std::copy_n(f.begin(), points.size, mTerms[t].f.begin() + static_cast<std::ptrdiff_t>(done));
            std::copy_n(g.begin(), points.size, mTerms[t].g.begin() + static_cast<std::ptrdiff_t>(done));
        });
        done += static_cast<size_t>(points.size);
        points.size = 0;
    };
    for (int i = 0; i < kEdge; ++i)
        for (int j = 0; j < kEdge; ++j)
            for (int k = 0; k < kEdge; ++k) {
                points.push(cornerOf(mOrigin.offsetBy(i, j, k)));
                if (points.full()) flush();
            }
    flush();
    mKnown.set();
}

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
            for (size_t k = 0; k < kLeafEdge; ++k) {
                const size_t n = i * kEdgeX + j * kEdgeY + k;
                v[0][k] = static_cast<float>((y[n] + z[n + kEdgeY] - y[n + 1] - z[n]) * perArea);
                v[1][k] = static_cast<float>((z[n] + x[n + 1] - z[n + kEdgeX] - x[n]) * perArea);
                v[2][k] = static_cast<float>((x[n] + y[n + kEdgeX] - x[n + kEdgeY] - y[n]) * perArea);
            }
            for (size_t k = 0; k < kLeafEdge; ++k) *values++ = {v[0][k], v[1][k], v[2][k]};
        }
    activate(leaf);
}

/// Computes the potentials at those corners of a leaf where they are not known yet.
void StaggeredBrick::evaluateCornersOf(const Coord& leaf) {
    const Coord lower = leaf - mOrigin;
    const bool fades = !mSampled.isFar(leaf);
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
                points.push(cornerOf(mOrigin + c));
                if (points.full()) store(points, fades, corner);
            }
    if (points.size > 0) store(points, fades, corner);
}

/// Evaluates the potentials at the points, stores them at their corners and empties the batch.
void StaggeredBrick::store(PointBatch& points, bool fades, const std::array<size_t, kBatch>& corner) {
    evaluate(points, fades, [&](size_t t, const Values& f, const Values& g) {
        for (size_t n = 0; n < static_cast<size_t>(points.size); ++n) {
            mTerms[t].f[corner[n]] = f[n];
            mTerms[t].g[corner[n]] = g[n];
        }
    });
    points.size = 0;
}

/// Calls use(term, f, g) with the potentials of each term; f is faded beyond the wall.
template <class Use>
void StaggeredBrick::evaluate(const PointBatch& points, bool fades, const Use& use) const {
    JetBatch<double, 0> d, f, g;
    if (fades) {
        wallDistances(mSampled.flow.domain(), points, d);
        for (double& value : d.c[0]) value = mSampled.fade.at(value);
    }
    for (size_t t = 0; t < mTerms.size(); ++t) {
        mSampled.flow.terms()[t][0].eval(points, f);
        mSampled.flow.terms()[t][1].eval(points, g);
        if (fades)
            for (size_t n = 0; n < kBatch; ++n) f.c[0][n] *= d.c[0][n];
        use(t, f.c[0], g.c[0]);
    }
}

/// Integrates f dg over every edge in the direction of its axis, so that the faces that share it use the same bits.
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
                    const double *f = &t.f[from], *g = &t.g[from];
                    double* sum = &edges[axis][i * kEdgeX + j * kEdgeY];
                    for (size_t k = 0; k < kLeafEdge; ++k) sum[k] += 0.5 * (f[k] + f[k + step]) * (g[k + step] - g[k]);
                    if (axis != 2) {
                        constexpr size_t k = kLeafEdge;
                        sum[k] += 0.5 * (f[k] + f[k + step]) * (g[k + step] - g[k]);
                    }
                }
        }
}

/// Activates the voxels in the box; with a wall, only those with a velocity. A flow inside a wall ends at the wall, so
/// its box does not count.
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
