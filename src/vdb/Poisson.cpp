// SPDX-License-Identifier: Apache-2.0
#include "Poisson.h"

#include "curlew/vdb/Interrupter.h"
#include "curlew/vdb/Openvdb.h"

#include <openvdb/tools/PoissonSolver.h>

#include <cmath>
#include <memory>

namespace curlew {

namespace {

constexpr int kMaxStarts = 50; ///< Two were enough in uniform flows of 32³ to 64³ voxels.

} // namespace

openvdb::DoubleTree::Ptr solvePoisson(const openvdb::DoubleTree& sources, const PoissonBoundary& boundary,
                                      openvdb::math::pcg::State& state, const Monitor& monitor) {
    namespace poisson = openvdb::tools::poisson;
    namespace pcg = openvdb::math::pcg;
    using Matrix = poisson::LaplacianMatrix;
    Interrupter interrupter(monitor);
    auto solution = interruptible(monitor, [&] {
        // As poisson::solveWithBoundaryConditions(), which starts once.
        const auto index = poisson::createIndexTree(sources);
        const auto source = poisson::createVectorFromTree<double>(sources, *index);
        openvdb::BoolTree interior(*index, false, openvdb::TopologyCopy());
        openvdb::tools::erodeActiveValues(interior, 1, openvdb::tools::NN_FACE, openvdb::tools::IGNORE_TILES);
        const auto laplacian =
            poisson::createISLaplacianWithBoundaryConditions(*index, interior, boundary, *source, true);
        laplacian->scale(-1); // positive definite
        source->scale(-1);
        std::unique_ptr<pcg::Preconditioner<double>> conditioner =
            std::make_unique<pcg::IncompleteCholeskyPreconditioner<Matrix>>(*laplacian);
        if (!conditioner->isValid()) conditioner = std::make_unique<pcg::JacobiPreconditioner<Matrix>>(*laplacian);
        pcg::Vector<double> values(source->size(), 0);
        // Each iteration makes the error smaller, in the norm of the matrix, but may increase the residual. OpenVDB
        // gives up if it doubles, most often near the beginning. The values are better than before, and a new start
        // goes on.
        pcg::State limits = state;
        int iterations = 0;
        for (int starts = 0; starts < kMaxStarts && limits.iterations > 0; ++starts) {
            state = pcg::solve(*laplacian, *source, values, *conditioner, interrupter, limits);
            iterations += state.iterations;
            limits.iterations -= state.iterations;
            if (state.success || state.iterations == 0 || !std::isfinite(state.absoluteError)) break;
        }
        state.iterations = iterations;
        return poisson::createTreeFromVector<double>(values, *index, 0.0);
    });
    monitor.check();
    return solution;
}

} // namespace curlew
