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

Lattice<double> LatticePoisson::solve(double tolerance, int& iterations, const Monitor& monitor) {
    // A region without fixed values determines its values up to a constant. This makes the constant unique, and changes
    // the solution by less than the tolerance.
    constexpr double kPin = 1e-9;
    const auto boundary = [&](const openvdb::Coord&, const openvdb::Coord& neighbour, double& source,
                              double& diagonal) {
        double value = 0;
        if (mFixed.probeValue(neighbour, value)) {
            diagonal -= 1;
            source -= value;
            return;
        }
        for (int axis = 0; axis < 3; ++axis)
            if (const int p = neighbour[axis]; mOutside && (p < 0 || p >= mSize[axis]))
                if (const auto outside = mOutside(axis, p >= mSize[axis])) {
                    diagonal -= 1;
                    source -= *outside;
                    return;
                }
        diagonal -= kPin;
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
