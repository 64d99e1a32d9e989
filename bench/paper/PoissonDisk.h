// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "RadialDistribution.h"

#include <boost/random/mersenne_twister.hpp>
#include <boost/random/uniform_01.hpp>
#include <boost/random/uniform_int_distribution.hpp>
#include <boost/random/uniform_on_sphere.hpp>

namespace curlew::paper {

/// Poisson disk sampling of the unit cube (Bridson 2007): points at least `radius` apart, each of which tries 30
/// candidates between one and two radii away. Only used for the comparison.
template <int N>
class PoissonDisk {
  public:
    PoissonDisk(double radius, uint32_t seed)
        : mRadius(radius), mCells(std::max(1, static_cast<int>(1 / radius))), mRandom(seed) {
        size_t cells = 1;
        for (int axis = 0; axis < N; ++axis) cells *= static_cast<size_t>(mCells);
        mHeads.assign(cells, kNone);
    }

    /// Adds points until no point has room beside it.
    Positions<N> fill() {
        boost::random::uniform_01<double> uniform;
        Vec<double, N> first;
        for (double& x : first.c) x = uniform(mRandom);
        add(first);
        while (!mActive.empty()) {
            boost::random::uniform_int_distribution<size_t> pick(0, mActive.size() - 1);
            const size_t k = pick(mRandom);
            const Vec<double, N> center = mPoints[mActive[k]];
            mActive[k] = mActive.back();
            mActive.pop_back();
            for (int i = 0; i < 30; ++i)
                if (const Vec<double, N> p = near(center); inCube(p) && free(p, N - 1, 0, 0)) add(p);
        }
        return std::move(mPoints);
    }

  private:
    static constexpr uint32_t kNone = ~0U;

    int cellOf(double x) const { return std::min(static_cast<int>(x * mCells), mCells - 1); }

    static bool inCube(const Vec<double, N>& p) {
        return std::all_of(p.c.begin(), p.c.end(), [](double x) { return x >= 0 && x < 1; });
    }

    void add(const Vec<double, N>& p) {
        size_t cell = 0;
        for (int axis = N - 1; axis >= 0; --axis)
            cell = cell * static_cast<size_t>(mCells) + static_cast<size_t>(cellOf(p[axis]));
        const auto k = static_cast<uint32_t>(mPoints.size());
        mNext.push_back(std::exchange(mHeads[cell], k));
        mPoints.push_back(p);
        mActive.push_back(k);
    }

    /// Returns a uniformly distributed point in the shell.
    Vec<double, N> near(const Vec<double, N>& center) {
        boost::random::uniform_01<double> uniform;
        const double inner = 1, outer = std::pow(2.0, N);
        const double r = mRadius * std::pow(inner + uniform(mRandom) * (outer - inner), 1.0 / N);
        const auto& u = mDirection(mRandom);
        Vec<double, N> p = center;
        for (int axis = 0; axis < N; ++axis) p[axis] += r * u[static_cast<size_t>(axis)];
        return p;
    }

    /// Returns whether no point in the cells within reach is closer than the radius. The cells along the higher axes
    /// are already chosen: `above` is their index, `squared` the square of their distance.
    bool free(const Vec<double, N>& p, int axis, size_t above, double squared) const {
        if (axis < 0) {
            for (uint32_t k = mHeads[above]; k != kNone; k = mNext[k])
                if (const Vec<double, N> d = mPoints[k] - p; dot(d, d) < mRadius * mRadius) return false;
            return true;
        }
        const int here = cellOf(p[axis]);
        for (const int step : {0, -1, 1}) { // the nearest cell first, since it rejects most candidates
            const int cell = here + step;
            if (cell < 0 || cell >= mCells) continue;
            const double edge = static_cast<double>(step > 0 ? cell : cell + 1) / mCells;
            const double away = step == 0 ? 0 : p[axis] - edge;
            const double sum = squared + away * away;
            if (sum >= mRadius * mRadius) continue;
            if (!free(p, axis - 1, above * static_cast<size_t>(mCells) + static_cast<size_t>(cell), sum)) return false;
        }
        return true;
    }

    double mRadius;
    int mCells;                          // number of cells along each axis; a cell is not shorter than the radius
    std::vector<uint32_t> mHeads, mNext; // the points of each cell as a linked list
    Positions<N> mPoints;
    std::vector<uint32_t> mActive;
    boost::random::mt19937 mRandom;
    boost::random::uniform_on_sphere<double> mDirection{N};
};

} // namespace curlew::paper
