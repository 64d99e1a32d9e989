// SPDX-License-Identifier: Apache-2.0
#include "FlowSampler.h"
#include "curlew/field/Algebra.h"
#include "curlew/field/ForEachBatch.h"
#include "curlew/flow/Domain.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

namespace curlew {

namespace {

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

/// Calls use(batch, of) with their positions; `of` points to the first of a batch.
template <class Some, class Use>
void forBatches(Some& some, const Use& use) {
    const PointsBy positions{some.size(), [&](size_t n) { return some[n].position; }};
    for (size_t first = 0; first < some.size(); first += kBatch)
        use(batchOf(positions, first, std::min(first + kBatch, some.size())), &some[first]);
}

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
    std::vector<InFade> centres, positions;
    for (const auto& cell : coveringCells(around, around.box.lower, size, {level - size, level + size}, kMost)) {
        Vec3d p;
        for (int axis = 0; axis < 3; ++axis) p[axis] = around.box.lower[axis] + size * (cell[axis] + 0.5);
        centres.push_back({p, 0});
    }
    forBatches(centres, [&](const PointBatch& points, const InFade*) {
        JetBatch<double, 0> d;
        wall.sdf.distance.eval(points, d);
        for (int i = 0; i < points.size; ++i)
            if (const double weight = 1 - std::abs(d[i].value - level) / size; weight > 0)
                positions.push_back({points[i], weight});
    });
    constexpr int kSteps = 3; // of Newton's method
    forBatches(positions, [&](const PointBatch& first, InFade* of) {
        PointBatch points = first;
        for (int step = 0; step < kSteps; ++step) {
            JetBatch<double, 1> jets;
            wall.sdf.distance.eval(points, jets);
            for (int i = 0; i < points.size; ++i) {
                const auto d = jets[i];
                points.set(i,
                           points[i] - d.gradient * ((d.value - level) / std::max(dot(d.gradient, d.gradient), 0.1)));
            }
        }
        for (int i = 0; i < points.size; ++i) of[i].position = points[i];
    });
    return positions;
}

std::vector<FadingTerm> fadingTermsOf(const FlowOnVoxels& sampled) {
    std::vector<FadingTerm> terms(sampled.flow.terms().size());
    const std::vector<InFade> positions = positionsInFade(sampled);
    forBatches(positions, [&](const PointBatch& points, const InFade* in) {
        JetBatch<double, 0> d;
        sampled.flow.domain().wall->sdf.distance.eval(points, d);
        for (size_t term = 0; term < terms.size(); ++term) {
            JetBatch<double, 1> jetsOfF, jetsOfG;
            sampled.flow.terms()[term][0].eval(points, jetsOfF);
            sampled.flow.terms()[term][1].eval(points, jetsOfG);
            for (int i = 0; i < points.size; ++i) {
                const double factor = sampled.fade.at(d[i].value), weight = in[i].weight;
                if (!(factor > 0 && factor < 1)) continue;
                const auto f = jetsOfF[i], g = jetsOfG[i];
                terms[term][0].add(f.value, weight * dot(g.gradient, g.gradient));
                terms[term][1].add(g.value, weight * dot(f.gradient, f.gradient));
            }
        }
    });
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

} // namespace curlew
