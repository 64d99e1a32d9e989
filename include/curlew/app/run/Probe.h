// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/base/Monitor.h"
#include "curlew/flow/Flow.h"

#include <filesystem>
#include <string>

namespace curlew::app {

/// Positions of any dimension from 1 to 7, and the names of their coordinates.
struct Positions {
    std::vector<std::string> names;
    std::vector<double> coordinates; ///< All coordinates of the first position, then of the second, …

    int dimension() const { return static_cast<int>(names.size()); }
    size_t size() const { return coordinates.size() / names.size(); }
    template <int N>
    Vec<double, N> at(size_t k) const {
        Vec<double, N> p;
        for (size_t axis = 0; axis < N; ++axis) p[static_cast<int>(axis)] = coordinates[k * N + axis];
        return p;
    }
};

/// Reads positions from a CSV file whose first columns are x or x,y or x,y,z or x0,x1,…, as that of points. Ignores
/// other columns. Throws FileError, naming file and line, if the file has another form.
Positions readPositions(const std::filesystem::path& path);

/// Writes a CSV file with the coordinates, the value and the derivatives up to `order` (0 … 2). They are evaluated as T
/// (float or double) and printed with enough digits to distinguish any two numbers: 9 for float, 17 for double and for
/// the coordinates. Derivatives are named after the coordinates: x,y,value,dx,dy,dxx,dyy,dxy; or
/// x0,…,value,dx0,…,dx0x0,…,dx0x1,…. Throws ValueError if the field and the positions differ in dimension.
template <class T, int N>
void probeField(const ScalarFieldN<N>& field, const Positions& positions, int order, const std::filesystem::path& path,
                const Monitor& monitor = {});

/// Writes the coordinates, the velocity and, if the flow has tracks, its potentials in the same way:
/// x,y,z,vx,vy,vz,f,g, or x,y,vx,vy,f, or x0,…,v0,…,f0,…. If order is 2, also writes the velocity's Jacobian by rows,
/// dvx_dx … dvz_dz, computed in double.
template <class T, int N>
void probeFlow(const FlowN<N>& flow, const Positions& positions, int order, const std::filesystem::path& path,
               const Monitor& monitor = {});

} // namespace curlew::app
