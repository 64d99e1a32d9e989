// SPDX-License-Identifier: Apache-2.0
#include "EdgePotentials.h"

#include "LatticePoisson.h"
#include "curlew/vdb/Openvdb.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace curlew {

namespace {

using Point = Vec<int, 3>;

/// Calls use(axis, from, to) for the edges between a corner and its neighbours.
template <class Use>
void forEdgesAt(const Point& corner, const Point& corners, const Use& use) {
    for (int axis = 0; axis < 3; ++axis) {
        if (corner[axis] + 1 < corners[axis]) use(axis, corner, next(corner, axis));
        if (corner[axis] > 0) use(axis, next(corner, axis, -1), corner);
    }
}

void subtractGradient(EdgePotentials& potentials, const Lattice<double>& phi) {
    for (int axis = 0; axis < 3; ++axis)
        Lattice<double>::forEach(potentials[axis].size(), [&](const Point& edge) {
            potentials[axis](edge) -= phi(next(edge, axis)) - phi(edge);
        });
}

/// Subtracts the gradient of the solution of Poisson's equation that makes the sum at each corner zero. Corners with a
/// number in `fixed` have that value of the solution.
int smooth(EdgePotentials& potentials, const Lattice<double>& fixed, const Monitor& monitor) {
    const Point& corners = fixed.size();
    LatticePoisson solver(corners, "the gauge of the potentials");
    double most = 0;
    Lattice<double>::forEach(corners, [&](const Point& corner) {
        if (!std::isnan(fixed(corner))) return solver.fix(corner, fixed(corner));
        double sum = 0;
        forEdgesAt(corner, corners, [&](int axis, const Point& from, const Point&) {
            sum += from == corner ? potentials[axis](from) : -potentials[axis](from);
        });
        most = std::max(most, std::abs(sum));
        solver.set(corner, sum);
    });
    // Any solution is a gauge. This accuracy makes it smooth.
    constexpr double kTolerance = 1e-7;
    int iterations = 0;
    subtractGradient(potentials, solver.solve(kTolerance * most, iterations, monitor));
    return iterations;
}

/// Functions on stationary corners whose gradients are the potentials between them.
struct StationaryParts {
    Lattice<double> phi; ///< Average 0 in each connected part; NaN at other corners.
    size_t count = 0;    ///< Parts with such a function.
    size_t channels = 0; ///< Parts without: the potentials around some loop do not add up to zero.
};

StationaryParts integrate(const EdgePotentials& potentials, const Lattice<uint8_t>& stationary) {
    constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
    StationaryParts parts{.phi = Lattice<double>(stationary.size(), kUnknown)};
    auto& phi = parts.phi;
    Lattice<uint8_t> seen(stationary.size(), 0);
    std::vector<Point> part;
    Lattice<double>::forEach(stationary.size(), [&](const Point& seed) {
        if (!stationary(seed) || seen(seed)) return;
        part.assign(1, seed);
        seen(seed) = 1;
        phi(seed) = 0;
        double sum = 0, most = 0, error = 0;
        for (size_t k = 0; k < part.size(); ++k) {
            const Point corner = part[k];
            sum += phi(corner);
            most = std::max(most, std::abs(phi(corner)));
            forEdgesAt(corner, stationary.size(), [&](int axis, const Point& from, const Point& to) {
                const bool forward = from == corner;
                const Point& other = forward ? to : from;
                if (!stationary(other)) return;
                const double there = phi(corner) + (forward ? 1 : -1) * potentials[axis](from);
                if (seen(other)) {
                    error = std::max(error, std::abs(there - phi(other)));
                    return;
                }
                seen(other) = 1;
                phi(other) = there;
                part.push_back(other);
            });
        }
        constexpr double kTolerance = 1e-4; // the solver that made the velocities divergence-free is far better
        const bool channel = error > kTolerance * most;
        ++(channel ? parts.channels : parts.count);
        const double average = sum / static_cast<double>(part.size());
        for (const Point& corner : part) phi(corner) = channel ? kUnknown : phi(corner) - average;
    });
    return parts;
}

} // namespace

double EdgePotentials::curl(int axis, const Point& face) const {
    const int u = (axis + 1) % 3, v = (axis + 2) % 3;
    const auto& p = *this;
    return p[v](next(face, u)) - p[v](face) - (p[u](next(face, v)) - p[u](face));
}

EdgePotentials sweep(const FaceVelocities& velocities) {
    const Point& n = velocities.cells;
    EdgePotentials potentials;
    for (int axis = 0; axis < 3; ++axis)
        potentials[axis] = Lattice<double>(next(next(n, (axis + 1) % 3), (axis + 2) % 3));
    auto &x = potentials[0], &y = potentials[1];
    for (int j = 0; j < n[1]; ++j)
        for (int i = 0; i < n[0]; ++i) y(i + 1, j, 0) = y(i, j, 0) + velocities[2](i, j, 0);
    for (int k = 0; k < n[2]; ++k) {
        for (int i = 0; i < n[0]; ++i)
            for (int j = 0; j <= n[1]; ++j) x(i, j, k + 1) = x(i, j, k) + velocities[1](i, j, k);
        for (int i = 0; i <= n[0]; ++i)
            for (int j = 0; j < n[1]; ++j) y(i, j, k + 1) = y(i, j, k) - velocities[0](i, j, k);
    }
    return potentials;
}

Gauge gauged(const EdgePotentials& potentials, const Lattice<uint8_t>& stationary, const Monitor& monitor) {
    Gauge result{.potentials = potentials};
    StationaryParts parts = integrate(potentials, stationary);
    if (parts.count != 1) { // the parts' constants should not differ more than they must
        result.iterations += smooth(
            result.potentials, Lattice<double>(stationary.size(), std::numeric_limits<double>::quiet_NaN()), monitor);
        parts = integrate(result.potentials, stationary);
    }
    if (parts.count > 0) result.iterations += smooth(result.potentials, parts.phi, monitor);
    result.channels = parts.channels;
    return result;
}

} // namespace curlew
