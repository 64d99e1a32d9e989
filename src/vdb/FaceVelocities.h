// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/base/Monitor.h"
#include "curlew/math/Vec.h"
#include "curlew/vdb/Openvdb.h"

#include <array>
#include <cstdint>
#include <vector>

namespace curlew {

/// Numbers at the points of a lattice, the last index fastest.
template <class T>
class Lattice {
  public:
    Lattice() = default;
    explicit Lattice(const Vec<int, 3>& size, T value = T{}) : mSize(size), mValues(count(size), value) {}

    const Vec<int, 3>& size() const { return mSize; }
    T& operator()(int i, int j, int k) { return mValues[at(i, j, k)]; }
    const T& operator()(int i, int j, int k) const { return mValues[at(i, j, k)]; }
    T& operator()(const Vec<int, 3>& p) { return mValues[at(p[0], p[1], p[2])]; }
    const T& operator()(const Vec<int, 3>& p) const { return mValues[at(p[0], p[1], p[2])]; }
    const std::vector<T>& values() const { return mValues; }

    /// Calls use(p) for all points p.
    template <class Use>
    static void forEach(const Vec<int, 3>& size, const Use& use) {
        Vec<int, 3> p;
        for (p[0] = 0; p[0] < size[0]; ++p[0])
            for (p[1] = 0; p[1] < size[1]; ++p[1])
                for (p[2] = 0; p[2] < size[2]; ++p[2]) use(static_cast<const Vec<int, 3>&>(p));
    }

  private:
    static size_t count(const Vec<int, 3>& n) {
        return static_cast<size_t>(n[0]) * static_cast<size_t>(n[1]) * static_cast<size_t>(n[2]);
    }
    size_t at(int i, int j, int k) const {
        return (static_cast<size_t>(i) * static_cast<size_t>(mSize[1]) + static_cast<size_t>(j)) *
                   static_cast<size_t>(mSize[2]) +
               static_cast<size_t>(k);
    }
    Vec<int, 3> mSize;
    std::vector<T> mValues;
};

/// The next point of a lattice along an axis.
inline Vec<int, 3> next(Vec<int, 3> p, int axis, int by = 1) {
    p[axis] += by;
    return p;
}

/// Velocities through the faces of the cells of a box (MAC), in the frame of the grid: component k of face (i, j, k) is
/// that through the lower face of the cell along axis k. One face more than cells along that axis.
struct FaceVelocities {
    Vec<int, 3> cells;
    std::array<Lattice<double>, 3> through;

    explicit FaceVelocities(const Vec<int, 3>& n);
    Lattice<double>& operator[](int axis) { return through[static_cast<size_t>(axis)]; }
    const Lattice<double>& operator[](int axis) const { return through[static_cast<size_t>(axis)]; }

    /// Returns the net flux out of a cell, in units of velocity times the area of a face.
    double divergence(const Vec<int, 3>& cell) const;
    /// Root mean square of all faces.
    double rms() const;
    /// Root mean square of the divergences of the cells.
    double rmsDivergence() const;
    /// Whether nothing flows through a side of the box: the lower (false) or the upper one along an axis.
    bool closed(int axis, bool upper) const;
};

/// What projected() did.
struct Projection {
    int iterations = 0;
    double residual = 0; ///< Rms divergence that is left, relative to the rms velocity.
};

/// Makes the velocities divergence-free by subtracting the gradient of a pressure, which is 0 beyond the sides of the
/// box that are open. Nothing flows through the faces of solid cells and the closed sides of the box. Throws ValueError
/// if the solver does not converge.
Projection project(FaceVelocities& velocities, const Lattice<uint8_t>& solid, const Monitor& monitor);

} // namespace curlew
