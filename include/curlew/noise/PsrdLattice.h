// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/math/Vec.h"

namespace curlew {

// The lattices of psrdnoise (Gustavson and McEwan 2021, "the paper" below). A vertex is a position whose simplex
// coordinates u are integers. Each lattice has
//   kRepeat      the shortest steps along the axes from one vertex to another,
//   toSimplex    maps a position to u; exact for multiples of kRepeat,
//   units        maps u to the position times kUnits; vertices become integers, so it is exact for them,
//   cornerUnits  does so for a corner of the unit cube, k of whose coordinates are 1 and the others 0,
//   vertexAt     the inverse of `units` for vertices. If a period wraps a vertex to a position without one, it
//                returns the vertex with the nearest u, as published; halves are rounded up.

/// The plane's lattice of triangles with base 1 and height 1. Every other row of vertices is shifted by 1/2 (the paper,
/// Fig. 2).
struct PsrdLattice2 {
    static constexpr int kUnits = 2;
    static constexpr Vec<int, 2> kRepeat{{1, 2}};

    template <class T>
    static Vec<T, 2> toSimplex(const Vec<T, 2>& x) {
        return {{mulAdd(T(0.5), x[1], x[0]), x[1]}};
    }
    template <class T>
    static Vec<T, 2> units(const Vec<T, 2>& u) {
        return {{T(2) * u[0] - u[1], T(2) * u[1]}};
    }
    template <class T>
    static Vec<T, 2> cornerUnits(const Vec<T, 2>& u, int) {
        return units(u);
    }
    template <class T>
    static Vec<T, 2> vertexAt(const Vec<T, 2>& k) {
        return {{floor(T(0.5) * k[0] + T(0.25) * k[1] + T(0.5)), T(0.5) * k[1]}};
    }
};

/// The paper's own lattice in 3D: the corners and centres of unit cubes (Fig. 3).
struct PsrdLattice3 {
    static constexpr int kUnits = 2;
    static constexpr Vec<int, 3> kRepeat{{1, 1, 1}};

    template <class T>
    static Vec3<T> toSimplex(const Vec3<T>& x) {
        return {{x[1] + x[2], x[0] + x[2], x[0] + x[1]}};
    }
    template <class T>
    static Vec3<T> units(const Vec3<T>& u) {
        return {{u[1] + u[2] - u[0], u[0] + u[2] - u[1], u[0] + u[1] - u[2]}};
    }
    template <class T>
    static Vec3<T> cornerUnits(const Vec3<T>& u, int k) {
        return {{mulAdd(u[0], T(-2), T(k)), mulAdd(u[1], T(-2), T(k)), mulAdd(u[2], T(-2), T(k))}};
    }
    template <class T>
    static Vec3<T> vertexAt(const Vec3<T>& k) {
        return toSimplex(k) * T(0.5);
    }
};

/// The same lattice in Perlin's orientation (2002): its long diagonal is that of the unit cube, and few vertices have
/// integer coordinates.
struct PsrdPerlinLattice3 {
    static constexpr int kUnits = 6;
    static constexpr Vec<int, 3> kRepeat{{3, 3, 3}};

    template <class T>
    static Vec3<T> toSimplex(const Vec3<T>& x) {
        const T third = (x[0] + x[1] + x[2]) / T(3);
        return {{x[0] + third, x[1] + third, x[2] + third}};
    }
    template <class T>
    static Vec3<T> units(const Vec3<T>& u) {
        const T sum = u[0] + u[1] + u[2];
        return {{T(6) * u[0] - sum, T(6) * u[1] - sum, T(6) * u[2] - sum}};
    }
    template <class T>
    static Vec3<T> cornerUnits(const Vec3<T>& u, int k) {
        return {{mulAdd(u[0], T(6), T(-k)), mulAdd(u[1], T(6), T(-k)), mulAdd(u[2], T(6), T(-k))}};
    }
    template <class T>
    static Vec3<T> vertexAt(const Vec3<T>& k) {
        // All numbers are integers up to the division, which yields multiples of 1/3 after a period was subtracted:
        // never halves.
        const T sum = k[0] + k[1] + k[2];
        const auto nearest = [&sum](const T& a) { return floor((T(3) * a + sum) / T(18) + T(0.5)); };
        return {{nearest(k[0]), nearest(k[1]), nearest(k[2])}};
    }
};

} // namespace curlew
