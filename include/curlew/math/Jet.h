#pragma once

#include "curlew/math/Vec.h"

#include <type_traits>

namespace curlew {

/// A symmetric N x N matrix: the diagonal first, then the upper triangle by rows (N = 3: xx yy zz xy xz yz).
template <class T, int N>
struct Sym {
    static constexpr int kSize = N * (N + 1) / 2;
    std::array<T, kSize> c{};

    static constexpr int index(int i, int j) {
        if (i == j) return i;
        if (i > j) return index(j, i);
        return N + i * (2 * N - i - 1) / 2 + (j - i - 1);
    }
    constexpr T& operator()(int i, int j) { return c[static_cast<size_t>(index(i, j))]; }
    constexpr const T& operator()(int i, int j) const { return c[static_cast<size_t>(index(i, j))]; }
};

/// What is known of a scalar function at a point, up to derivatives of the given order: its value, its gradient and its
/// Hessian. The operators below are the rules of differentiation, so a formula written on jets carries its exact
/// derivatives with it.
template <class T, int N, int Order>
struct Jet {
    static_assert(Order >= 0 && Order <= 2);
    template <int>
    struct None {}; // one type for each, or they could not share an address
    static constexpr int kOrder = Order;
    static constexpr int kSize = Order == 0 ? 1 : Order == 1 ? 1 + N : 1 + N + Sym<T, N>::kSize;

    T value{};
    [[no_unique_address]] std::conditional_t<(Order >= 1), Vec<T, N>, None<1>> gradient{};
    [[no_unique_address]] std::conditional_t<(Order >= 2), Sym<T, N>, None<2>> hessian{};

    constexpr Jet() = default;
    constexpr Jet(T constant) : value(constant) {} // NOLINT: a constant is a jet

    /// The coordinate x_i as a function of position.
    static constexpr Jet variable(T x, int i) {
        Jet jet(x);
        if constexpr (Order >= 1) jet.gradient[i] = T(1);
        return jet;
    }

    /// The k-th of value, gradient, Hessian laid out in one row.
    constexpr T& component(int k) {
        if constexpr (Order >= 1) {
            if (k >= 1 && k <= N) return gradient[k - 1];
        }
        if constexpr (Order >= 2) {
            if (k > N) return hessian.c[static_cast<size_t>(k - 1 - N)];
        }
        return value;
    }
    constexpr const T& component(int k) const { return const_cast<Jet*>(this)->component(k); }

    constexpr Jet& operator+=(const Jet& o) {
        for (int k = 0; k < kSize; ++k) component(k) += o.component(k);
        return *this;
    }
    constexpr Jet& operator-=(const Jet& o) {
        for (int k = 0; k < kSize; ++k) component(k) -= o.component(k);
        return *this;
    }
    constexpr Jet& operator*=(T s) {
        for (int k = 0; k < kSize; ++k) component(k) *= s;
        return *this;
    }
    friend constexpr Jet operator+(Jet a, const Jet& b) { return a += b; }
    friend constexpr Jet operator-(Jet a, const Jet& b) { return a -= b; }
    friend constexpr Jet operator-(Jet a) { return a *= T(-1); }
    friend constexpr Jet operator*(Jet a, T s) { return a *= s; }
    friend constexpr Jet operator*(T s, Jet a) { return a *= s; }

    /// The product rule.
    friend constexpr Jet operator*(const Jet& a, const Jet& b) {
        Jet p(a.value * b.value);
        if constexpr (Order >= 1)
            for (int i = 0; i < N; ++i) p.gradient[i] = a.gradient[i] * b.value + a.value * b.gradient[i];
        if constexpr (Order >= 2)
            for (int i = 0; i < N; ++i)
                for (int j = i; j < N; ++j)
                    p.hessian(i, j) = a.hessian(i, j) * b.value + a.value * b.hessian(i, j) +
                                      (a.gradient[i] * b.gradient[j] + a.gradient[j] * b.gradient[i]);
        return p;
    }
};

/// The chain rule: h(a) for a function h of one variable, given h, h' and h'' at a.value.
template <class T, int N, int Order>
constexpr Jet<T, N, Order> compose(const Jet<T, N, Order>& a, T h, T dh, T ddh) {
    Jet<T, N, Order> r(h);
    if constexpr (Order >= 1)
        for (int i = 0; i < N; ++i) r.gradient[i] = dh * a.gradient[i];
    if constexpr (Order >= 2)
        for (int i = 0; i < N; ++i)
            for (int j = i; j < N; ++j) r.hessian(i, j) = dh * a.hessian(i, j) + ddh * (a.gradient[i] * a.gradient[j]);
    return r;
}

template <class T, int N, int Order>
Jet<T, N, Order> sqrt(const Jet<T, N, Order>& a) {
    const T root = std::sqrt(a.value);
    return compose(a, root, T(0.5) / root, T(-0.25) / (root * a.value));
}
template <class T, int N, int Order>
Jet<T, N, Order> sin(const Jet<T, N, Order>& a) {
    const T s = std::sin(a.value);
    return compose(a, s, std::cos(a.value), -s);
}
template <class T, int N, int Order>
Jet<T, N, Order> cos(const Jet<T, N, Order>& a) {
    const T c = std::cos(a.value);
    return compose(a, c, -std::sin(a.value), -c);
}
/// |a|, exact where a is not zero.
template <class T, int N, int Order>
Jet<T, N, Order> abs(const Jet<T, N, Order>& a) {
    return a.value < T(0) ? -a : a;
}
/// max(a, b), exact where a and b differ.
template <class T, int N, int Order>
Jet<T, N, Order> max(const Jet<T, N, Order>& a, const Jet<T, N, Order>& b) {
    return a.value < b.value ? b : a;
}

/// The derivatives of f(A x + b) with respect to x, given those of f at A x + b.
template <class T, int N, int M, int Order>
Jet<T, M, Order> pullBack(const Jet<T, N, Order>& f, const Matrix<N, M>& A) {
    Jet<T, M, Order> r(f.value);
    if constexpr (Order >= 1) {
        std::array<Vec<T, M>, N> a;
        for (int i = 0; i < N; ++i)
            for (int j = 0; j < M; ++j) a[static_cast<size_t>(i)][j] = static_cast<T>(A[i][j]);
        const auto sum = [&](const auto& weight) { // of the rows of A
            Vec<T, M> s = a[0] * weight(0);
            for (int k = 1; k < N; ++k) s += a[static_cast<size_t>(k)] * weight(k);
            return s;
        };
        r.gradient = sum([&](int k) { return f.gradient[k]; });
        if constexpr (Order >= 2) {
            std::array<Vec<T, M>, N> ha; // H A, by rows
            for (int i = 0; i < N; ++i) ha[static_cast<size_t>(i)] = sum([&](int k) { return f.hessian(i, k); });
            for (int i = 0; i < M; ++i)
                for (int j = i; j < M; ++j) {
                    T h = a[0][i] * ha[0][j];
                    for (size_t k = 1; k < N; ++k) h += a[k][i] * ha[k][j];
                    r.hessian(i, j) = h;
                }
        }
    }
    return r;
}

/// The chain rule in several variables: f(y(x)), given the jet of f at y in the variables y, and those of all y in the
/// variables x.
template <class T, int N, int M, int Order>
Jet<T, M, Order> compose(const Jet<T, N, Order>& f, const Vec<Jet<T, M, Order>, N>& y) {
    Jet<T, M, Order> r(f.value);
    if constexpr (Order >= 1)
        for (int a = 0; a < N; ++a) r.gradient += y[a].gradient * f.gradient[a];
    if constexpr (Order >= 2)
        for (int i = 0; i < M; ++i)
            for (int j = i; j < M; ++j)
                for (int a = 0; a < N; ++a) {
                    T h = f.gradient[a] * y[a].hessian(i, j);
                    for (int b = 0; b < N; ++b) h += f.hessian(a, b) * (y[a].gradient[i] * y[b].gradient[j]);
                    r.hessian(i, j) += h;
                }
    return r;
}

} // namespace curlew
