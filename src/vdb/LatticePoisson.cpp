// SPDX-License-Identifier: Apache-2.0
#include "LatticePoisson.h"

#include "Poisson.h"
#include "curlew/base/Error.h"
#include "curlew/base/Memory.h"
#include "curlew/vdb/Openvdb.h"

#include <fmt/format.h>

namespace curlew {

namespace {

openvdb::Coord coordOf(const Vec<int, 3>& p) { return {p[0], p[1], p[2]}; }

} // namespace

LatticePoisson::LatticePoisson(const Vec<int, 3>& size, std::string what) : mSize(size), mWhat(std::move(what)) {
    constexpr double kBytesEach = 350; // of the solver
    requireMemory(kBytesEach * size[0] * size[1] * size[2], mWhat, "use a grid with fewer voxels");
}

void LatticePoisson::set(const Vec<int, 3>& point, double source) { mSetSource.setValueOn(coordOf(point), source); }
void LatticePoisson::fix(const Vec<int, 3>& point, double value) { mSetFixed.setValueOn(coordOf(point), value); }

/// Returns the value of a neighbour that is not unknown; nullopt if it is none.
std::optional<double> LatticePoisson::given(const openvdb::Coord& neighbour) const {
    double value = 0;
    if (mFixed.probeValue(neighbour, value)) return value;
    for (int axis = 0; axis < 3; ++axis)
        if (const int p = neighbour[axis]; mOutside && (p < 0 || p >= mSize[axis]))
            return mOutside(axis, p >= mSize[axis]);
    return {};
}

/// Subtracts the mean of the sources in each region without fixed values. Its matrix is singular then, but conjugate
/// gradients solve that. (With a weak bond to 0 at a point, or at all points of the sides, an eigenvalue is nearly 0.
/// Conjugate gradients find it last, and the residual grows meanwhile.)
void LatticePoisson::closeRegions() {
    Lattice<uint8_t> seen(mSize);
    std::vector<openvdb::Coord> region;
    const auto visit = [&](const openvdb::Coord& p) {
        uint8_t& mark = seen(p[0], p[1], p[2]);
        if (!mark) region.push_back(p);
        mark = 1;
    };
    Lattice<double>::forEach(mSize, [&](const Vec<int, 3>& point) {
        const openvdb::Coord first = coordOf(point);
        if (!mSetSource.isValueOn(first) || seen(point)) return;
        region.clear();
        visit(first);
        bool fixed = false;
        double sum = 0;
        // NOLINTNEXTLINE(modernize-loop-convert): visit() adds to the region
        for (size_t k = 0; k < region.size(); ++k) {
            const openvdb::Coord p = region[k];
            sum += mSetSource.getValue(p);
            for (int axis = 0; axis < 3; ++axis)
                for (const int step : {-1, 1}) {
                    openvdb::Coord neighbour = p;
                    neighbour[axis] += step;
                    if (mSetSource.isValueOn(neighbour))
                        visit(neighbour);
                    else
                        fixed = fixed || given(neighbour);
                }
        }
        if (fixed) return;
        const double mean = sum / static_cast<double>(region.size());
        for (const openvdb::Coord& p : region) mSetSource.setValueOn(p, mSetSource.getValue(p) - mean);
    });
}

Lattice<double> LatticePoisson::solve(double tolerance, int& iterations, const Monitor& monitor) {
    closeRegions();
    const auto boundary = [&](const openvdb::Coord&, const openvdb::Coord& neighbour, double& source,
                              double& diagonal) {
        if (const auto value = given(neighbour)) {
            diagonal -= 1;
            source -= *value;
        }
    };
    Lattice<double> values(mSize);
    for (auto fixed = mFixed.cbeginValueOn(); fixed; ++fixed)
        values(fixed.getCoord()[0], fixed.getCoord()[1], fixed.getCoord()[2]) = *fixed;
    iterations = 0;
    if (mSources.activeVoxelCount() == 0) return values;
    constexpr int kMaxIterations = 3000;
    openvdb::math::pcg::State state{
        .success = false, .iterations = kMaxIterations, .relativeError = 0, .absoluteError = tolerance};
    const auto solution = solvePoisson(mSources, boundary, state, monitor);
    // Close to the tolerance, rounding may stop the residual from falling.
    constexpr double kRounding = 100;
    if (!state.success && !(state.absoluteError <= kRounding * tolerance))
        throw ValueError(
            fmt::format("{} has not converged: its residual is {:.2g} after {} iterations; check that the "
                        "wall is not inside out and encloses no part of the flow",
                        mWhat, state.absoluteError, state.iterations));
    iterations = state.iterations;
    for (auto value = solution->cbeginValueOn(); value; ++value)
        values(value.getCoord()[0], value.getCoord()[1], value.getCoord()[2]) = *value;
    return values;
}

} // namespace curlew
