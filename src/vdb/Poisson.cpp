// SPDX-License-Identifier: Apache-2.0
#include "Poisson.h"

#include "curlew/vdb/Interrupter.h"
#include "curlew/vdb/Openvdb.h"

#include <openvdb/tools/PoissonSolver.h>

namespace curlew {

openvdb::DoubleTree::Ptr solvePoisson(const openvdb::DoubleTree& sources, const PoissonBoundary& boundary,
                                      openvdb::math::pcg::State& state, const Monitor& monitor) {
    Interrupter interrupter(monitor);
    auto solution = interruptible(monitor, [&] {
        return openvdb::tools::poisson::solveWithBoundaryConditions(sources, boundary, state, interrupter, true);
    });
    monitor.check();
    return solution;
}

} // namespace curlew
