// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/math/Arithmetic.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace curlew {

// Naming: a type that exists in every dimension is called SomethingN<N>, and Something is its alias for N = 3.

/// A vector of N components.
template <class T, int N>
struct Vec {
    std::array<T, N> c{};

    constexpr T& operator[](int i) { return c[static_cast<size_t>(i)]; }
    constexpr const T& operator[](int i) const { return c[static_cast<size_t>(i)]; }

    constexpr Vec& operator+=(const Vec& o) {
        for (int i = 0; i < N; ++i) (*this)[i] += o[i];
        return *this;
    }
    constexpr Vec& operator-=(const Vec& o) {
        for (int i = 0; i < N; ++i) (*this)[i] -= o[i];
        return *this;
    }
    constexpr Vec& operator*=(const T& s) {
        for (int i = 0; i < N; ++i) (*this)[i] *= s;
        return *this;
    }
    friend constexpr Vec operator+(Vec a, const Vec& b) { return a += b; }
    friend constexpr Vec operator-(Vec a, const Vec& b) { return a -= b; }
    friend constexpr Vec operator*(Vec a, const T& s) { return a *= s; }
    friend constexpr Vec operator*(const T& s, Vec a) { return a *= s; }
    friend constexpr Vec operator-(Vec a) { return a *= T(-1); }
    friend constexpr bool operator==(const Vec&, const Vec&) = default;
};

template <class T>
using Vec3 = Vec<T, 3>;
using Vec3d = Vec<double, 3>;
using Vec3f = Vec<float, 3>;

template <class T, int N>
constexpr T dot(const Vec<T, N>& a, const Vec<T, N>& b) {
    T sum = a[0] * b[0];
    for (int i = 1; i < N; ++i) sum = mulAdd(a[i], b[i], sum);
    return sum;
}

template <class T, int N>
T length(const Vec<T, N>& a) {
    return sqrt(dot(a, a));
}

/// The unit vector in the direction of a, which must not be 0.
template <class T, int N>
Vec<T, N> normalized(const Vec<T, N>& a) {
    return a * (1 / length(a));
}

/// The right-handed cross product: cross(e_x, e_y) = e_z (ICN Eq. 1 for n = 3). Not fused, so cross(a, a) = 0 and
/// cross(b, a) = -cross(a, b) hold exactly.
template <class T>
constexpr Vec3<T> cross(const Vec3<T>& a, const Vec3<T>& b) {
    return {{a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]}};
}

/// A matrix of R rows and C columns, stored by rows. The default is the identity.
template <int R, int C>
struct Matrix {
    std::array<Vec<double, C>, R> rows = identity();

    constexpr Vec<double, C>& operator[](int i) { return rows[static_cast<size_t>(i)]; }
    constexpr const Vec<double, C>& operator[](int i) const { return rows[static_cast<size_t>(i)]; }

    constexpr Vec<double, R> operator*(const Vec<double, C>& v) const {
        Vec<double, R> product;
        for (int i = 0; i < R; ++i) product[i] = dot((*this)[i], v);
        return product;
    }
    friend constexpr bool operator==(const Matrix&, const Matrix&) = default;

  private:
    static constexpr std::array<Vec<double, C>, R> identity() {
        std::array<Vec<double, C>, R> rows{};
        for (int i = 0; i < std::min(R, C); ++i) rows[static_cast<size_t>(i)][i] = 1;
        return rows;
    }
};
using Matrix3 = Matrix<3, 3>;

template <int R, int C>
constexpr Matrix<C, R> transpose(const Matrix<R, C>& m) {
    Matrix<C, R> t;
    for (int i = 0; i < C; ++i)
        for (int j = 0; j < R; ++j) t[i][j] = m[j][i];
    return t;
}

template <int R, int K, int C>
constexpr Matrix<R, C> operator*(const Matrix<R, K>& a, const Matrix<K, C>& b) {
    Matrix<R, C> product;
    const Matrix<C, K> columns = transpose(b);
    for (int i = 0; i < R; ++i)
        for (int j = 0; j < C; ++j) product[i][j] = dot(a[i], columns[j]);
    return product;
}

/// An axis-aligned box in world units. Empty if a lower bound exceeds its upper bound.
template <int N>
struct BoxN {
    Vec<double, N> lower{}, upper{};

    constexpr Vec<double, N> size() const { return upper - lower; }
    constexpr Vec<double, N> center() const { return (lower + upper) * 0.5; }
    constexpr bool contains(const Vec<double, N>& p) const {
        for (int i = 0; i < N; ++i)
            if (!(p[i] >= lower[i] && p[i] <= upper[i])) return false; // false for NaN
        return true;
    }
    constexpr BoxN padded(double margin) const {
        Vec<double, N> m;
        m.c.fill(margin);
        return {lower - m, upper + m};
    }
    constexpr bool finite() const {
        for (int i = 0; i < N; ++i)
            if (!(lower[i] > -1e300) || !(upper[i] < 1e300)) return false;
        return true;
    }
};
using Box = BoxN<3>;

} // namespace curlew
