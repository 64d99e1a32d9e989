// SPDX-License-Identifier: Apache-2.0
#include "FaceVelocities.h"

#include "LatticePoisson.h"
#include "curlew/vdb/Openvdb.h"

#include <algorithm>
#include <cmath>

namespace curlew {

FaceVelocities::FaceVelocities(const Vec<int, 3>& n) : cells(n) {
    for (int axis = 0; axis < 3; ++axis) (*this)[axis] = Lattice<double>(next(n, axis));
}

double FaceVelocities::divergence(const Vec<int, 3>& cell) const {
    double sum = 0;
    for (int axis = 0; axis < 3; ++axis) sum += (*this)[axis](next(cell, axis)) - (*this)[axis](cell);
    return sum;
}

double FaceVelocities::rms() const {
    double squares = 0, count = 0;
    for (const auto& faces : through) {
        for (const double v : faces.values()) squares += v * v;
        count += static_cast<double>(faces.values().size()) / 3;
    }
    return std::sqrt(squares / count);
}

double FaceVelocities::rmsDivergence() const {
    double squares = 0, count = 0;
    Lattice<double>::forEach(cells, [&](const Vec<int, 3>& cell) {
        const double d = divergence(cell);
        squares += d * d;
        ++count;
    });
    return std::sqrt(squares / count);
}

bool FaceVelocities::closed(int axis, bool upper) const {
    constexpr double kRounding = 1e-9;
    double most = 0, here = 0;
    for (const double v : (*this)[axis].values()) most = std::max(most, std::abs(v));
    Vec<int, 3> side = (*this)[axis].size();
    side[axis] = 1;
    Lattice<double>::forEach(side, [&](Vec<int, 3> face) {
        if (upper) face[axis] = cells[axis];
        here = std::max(here, std::abs((*this)[axis](face)));
    });
    return here <= kRounding * most;
}

Projection project(FaceVelocities& velocities, const Lattice<uint8_t>& solid, const Monitor& monitor) {
    const Vec<int, 3>& n = velocities.cells;
    std::array<std::array<bool, 2>, 3> open;
    for (int axis = 0; axis < 3; ++axis)
        for (const bool upper : {false, true})
            open[static_cast<size_t>(axis)][upper ? 1 : 0] = !velocities.closed(axis, upper);
    LatticePoisson solver(n, "the projection of the velocity grid");
    Lattice<double>::forEach(n, [&](const Vec<int, 3>& cell) {
        if (!solid(cell)) solver.set(cell, velocities.divergence(cell));
    });
    solver.setOutside([&](int axis, bool upper) -> std::optional<double> {
        if (open[static_cast<size_t>(axis)][upper ? 1 : 0]) return 0.0;
        return std::nullopt;
    });
    const double scale = velocities.rms();
    Projection result;
    const auto pressure = solver.solve(1e-11 * scale, result.iterations, monitor);
    const auto inBox = [&](const Vec<int, 3>& cell, int axis) { return cell[axis] >= 0 && cell[axis] < n[axis]; };
    for (int axis = 0; axis < 3; ++axis)
        Lattice<double>::forEach(velocities[axis].size(), [&](const Vec<int, 3>& face) {
            const Vec<int, 3> below = next(face, axis, -1);
            std::array<double, 2> p{};
            size_t q = 0;
            for (const auto& cell : {below, face}) {
                if (!inBox(cell, axis)) {
                    if (!open[static_cast<size_t>(axis)][q]) return; // closed
                } else if (solid(cell)) {
                    return;
                } else {
                    p[q] = pressure(cell);
                }
                ++q;
            }
            velocities[axis](face) -= p[1] - p[0];
        });
    result.residual = scale > 0 ? velocities.rmsDivergence() / scale : 0;
    return result;
}

} // namespace curlew
