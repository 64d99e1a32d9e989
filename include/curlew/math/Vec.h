#pragma once

#include <array>
#include <cmath>

namespace curlew {

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
    for (int i = 1; i < N; ++i) sum += a[i] * b[i];
    return sum;
}

template <class T, int N>
T length(const Vec<T, N>& a) {
    using std::sqrt;
    return sqrt(dot(a, a));
}

/// The right-handed cross product: cross(e_x, e_y) = e_z (ICN Eq. 1 for n = 3).
template <class T>
constexpr Vec3<T> cross(const Vec3<T>& a, const Vec3<T>& b) {
    return {{a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]}};
}

/// A 3x3 matrix, by rows.
struct Matrix3 {
    std::array<Vec3d, 3> rows{Vec3d{{1, 0, 0}}, Vec3d{{0, 1, 0}}, Vec3d{{0, 0, 1}}};

    constexpr Vec3d operator*(const Vec3d& v) const { return {{dot(rows[0], v), dot(rows[1], v), dot(rows[2], v)}}; }
    friend constexpr bool operator==(const Matrix3&, const Matrix3&) = default;
};

constexpr Matrix3 transpose(const Matrix3& m) {
    Matrix3 t;
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) t.rows[static_cast<size_t>(i)][j] = m.rows[static_cast<size_t>(j)][i];
    return t;
}

constexpr Matrix3 operator*(const Matrix3& a, const Matrix3& b) {
    Matrix3 product;
    const Matrix3 columns = transpose(b);
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j)
            product.rows[static_cast<size_t>(i)][j] =
                dot(a.rows[static_cast<size_t>(i)], columns.rows[static_cast<size_t>(j)]);
    return product;
}

/// An axis-aligned box, world units. Empty where some lower bound exceeds the upper one.
struct Box {
    Vec3d lower{}, upper{};

    constexpr Vec3d size() const { return upper - lower; }
    constexpr Vec3d center() const { return (lower + upper) * 0.5; }
    constexpr bool contains(const Vec3d& p) const {
        for (int i = 0; i < 3; ++i)
            if (p[i] < lower[i] || p[i] > upper[i]) return false;
        return true;
    }
    constexpr Box padded(double margin) const {
        const Vec3d m{{margin, margin, margin}};
        return {lower - m, upper + m};
    }
    constexpr bool finite() const {
        for (int i = 0; i < 3; ++i)
            if (!(lower[i] > -1e300) || !(upper[i] < 1e300)) return false;
        return true;
    }
};

} // namespace curlew
