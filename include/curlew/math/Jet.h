// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/math/Vec.h"

#include <type_traits>

namespace curlew {

/// A symmetric N x N matrix. Stores the diagonal first, then the upper triangle row by row (N = 3: xx yy zz xy xz yz).
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

/// A symmetric N x N x N tensor. Stores each component once: (i, j, k) with i <= j <= k, sorted by k, then j, then i.
template <class T, int N>
struct Sym3 {
    static constexpr int kSize = N * (N + 1) * (N + 2) / 6;
    std::array<T, kSize> c{};

    static constexpr int index(int i, int j, int k) {
        if (i > j) return index(j, i, k);
        if (j > k) return index(i, k, j);
        return k * (k + 1) * (k + 2) / 6 + j * (j + 1) / 2 + i;
    }
    constexpr T& operator()(int i, int j, int k) { return c[static_cast<size_t>(index(i, j, k))]; }
    constexpr const T& operator()(int i, int j, int k) const { return c[static_cast<size_t>(index(i, j, k))]; }
};

/// A function of one variable and its derivatives at one point.
template <class T>
struct Univariate {
    T value{}, first{}, second{}, third{};
};

/// The value and derivatives of a scalar function at a point, up to the given order: value, gradient, Hessian and third
/// derivatives. (Only the domain warp of one field by the gradient of another needs third derivatives.) The operators
/// below implement the rules of differentiation, so a formula written with jets computes its exact derivatives: this is
/// automatic differentiation in forward mode, a generalisation of dual numbers.
template <class T, int N, int Order>
struct Jet {
    static_assert(Order >= 0 && Order <= 3);
    template <int>
    struct None {}; // a type per member: two empty members of the same type could not share an address
    static constexpr int kOrder = Order;
    static constexpr int kHessian = 1 + N, kThird = kHessian + Sym<T, N>::kSize;
    static constexpr int kSize = Order == 0   ? 1
                                 : Order == 1 ? kHessian
                                 : Order == 2 ? kThird
                                              : kThird + Sym3<T, N>::kSize;

    T value{};
    [[no_unique_address]] std::conditional_t<(Order >= 1), Vec<T, N>, None<1>> gradient{};
    [[no_unique_address]] std::conditional_t<(Order >= 2), Sym<T, N>, None<2>> hessian{};
    [[no_unique_address]] std::conditional_t<(Order >= 3), Sym3<T, N>, None<3>> third{};

    constexpr Jet() = default;
    constexpr Jet(T constant) : value(constant) {} // NOLINT: a constant is a jet

    /// The coordinate x_i as a function of position.
    static constexpr Jet variable(T x, int i) {
        Jet jet(x);
        if constexpr (Order >= 1) jet.gradient[i] = T(1);
        return jet;
    }
    /// Returns all coordinates of a position as jets.
    static constexpr Vec<Jet, N> variables(const Vec<T, N>& x) {
        Vec<Jet, N> all;
        for (int i = 0; i < N; ++i) all[i] = variable(x[i], i);
        return all;
    }

    /// Returns the k-th number of value, gradient, Hessian and third derivatives, in this order.
    constexpr T& component(int k) {
        if constexpr (Order >= 1) {
            if (k >= 1 && k < kHessian) return gradient[k - 1];
        }
        if constexpr (Order >= 2) {
            if (k >= kHessian && k < kThird) return hessian.c[static_cast<size_t>(k - kHessian)];
        }
        if constexpr (Order >= 3) {
            if (k >= kThird) return third.c[static_cast<size_t>(k - kThird)];
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
    constexpr Jet& operator*=(const Jet& o) { return *this = *this * o; }
    friend constexpr Jet operator+(Jet a, const Jet& b) { return a += b; }
    friend constexpr Jet operator-(Jet a, const Jet& b) { return a -= b; }
    friend constexpr Jet operator-(Jet a) { return a *= T(-1); }
    friend constexpr Jet operator*(Jet a, T s) { return a *= s; }
    friend constexpr Jet operator*(T s, Jet a) { return a *= s; }

    /// The product rule.
    friend constexpr Jet operator*(const Jet& a, const Jet& b) {
        Jet p(a.value * b.value);
        if constexpr (Order >= 1)
            for (int i = 0; i < N; ++i) p.gradient[i] = mulAdd(a.gradient[i], b.value, a.value * b.gradient[i]);
        if constexpr (Order >= 2)
            for (int i = 0; i < N; ++i)
                for (int j = i; j < N; ++j)
                    p.hessian(i, j) = mulAdd(a.hessian(i, j), b.value, a.value * b.hessian(i, j)) +
                                      mulAdd(a.gradient[i], b.gradient[j], a.gradient[j] * b.gradient[i]);
        if constexpr (Order >= 3)
            forTriples([&](int i, int j, int k) {
                p.third(i, j, k) = a.third(i, j, k) * b.value + a.value * b.third(i, j, k) +
                                   overSplits(a.hessian, b.gradient, i, j, k) +
                                   overSplits(b.hessian, a.gradient, i, j, k);
            });
        return p;
    }

    /// Returns a b + c with the value rounded once, as for numbers.
    friend constexpr Jet mulAdd(const Jet& a, const Jet& b, const Jet& c) {
        Jet sum = a * b + c;
        sum.value = mulAdd(a.value, b.value, c.value);
        return sum;
    }

    /// Calls f(i, j, k) for i <= j <= k.
    template <class F>
    static constexpr void forTriples(const F& f) {
        for (int k = 0; k < N; ++k)
            for (int j = 0; j <= k; ++j)
                for (int i = 0; i <= j; ++i) f(i, j, k);
    }
    /// Returns the sum of h(two of i, j, k) v(the third) over the three splits.
    static constexpr T overSplits(const Sym<T, N>& h, const Vec<T, N>& v, int i, int j, int k) {
        return mulAdd(h(i, j), v[k], mulAdd(h(i, k), v[j], h(j, k) * v[i]));
    }
};

/// Returns the jet of a lower order, without the higher derivatives.
template <int Lower, class T, int N, int Order>
constexpr Jet<T, N, Lower> truncated(const Jet<T, N, Order>& a) {
    static_assert(Lower <= Order);
    Jet<T, N, Lower> r;
    for (int k = 0; k < r.kSize; ++k) r.component(k) = a.component(k);
    return r;
}

/// Returns the partial derivative along axis i, a jet of one order less.
template <class T, int N, int Order>
constexpr Jet<T, N, Order - 1> partial(const Jet<T, N, Order>& a, int i) {
    Jet<T, N, Order - 1> r(a.gradient[i]);
    if constexpr (Order >= 2)
        for (int j = 0; j < N; ++j) r.gradient[j] = a.hessian(i, j);
    if constexpr (Order >= 3)
        for (int j = 0; j < N; ++j)
            for (int k = j; k < N; ++k) r.hessian(j, k) = a.third(i, j, k);
    return r;
}

/// The chain rule: returns the jet of h(a). `h` holds a function of one variable and its derivatives at a.value.
template <class T, int N, int Order>
constexpr Jet<T, N, Order> compose(const Jet<T, N, Order>& a, const Univariate<T>& h) {
    using J = Jet<T, N, Order>;
    J r(h.value);
    if constexpr (Order >= 1)
        for (int i = 0; i < N; ++i) r.gradient[i] = h.first * a.gradient[i];
    if constexpr (Order >= 2)
        for (int i = 0; i < N; ++i)
            for (int j = i; j < N; ++j)
                r.hessian(i, j) = mulAdd(h.first, a.hessian(i, j), h.second * (a.gradient[i] * a.gradient[j]));
    if constexpr (Order >= 3)
        J::forTriples([&](int i, int j, int k) {
            r.third(i, j, k) = h.first * a.third(i, j, k) + h.second * J::overSplits(a.hessian, a.gradient, i, j, k) +
                               h.third * (a.gradient[i] * a.gradient[j] * a.gradient[k]);
        });
    return r;
}

template <class T, int N, int Order>
Jet<T, N, Order> sqrt(const Jet<T, N, Order>& a) {
    const T root = sqrt(a.value), inverse = T(1) / a.value;
    const T first = T(0.5) / root, second = T(-0.5) * first * inverse;
    return compose(a, Univariate<T>{root, first, second, T(-1.5) * second * inverse});
}
template <class T, int N, int Order>
Jet<T, N, Order> sin(const Jet<T, N, Order>& a) {
    const T s = sin(a.value), c = cos(a.value);
    return compose(a, Univariate<T>{s, c, -s, -c});
}
template <class T, int N, int Order>
Jet<T, N, Order> cos(const Jet<T, N, Order>& a) {
    const T s = sin(a.value), c = cos(a.value);
    return compose(a, Univariate<T>{c, -s, -c, s});
}
/// 1 / a.
template <class T, int N, int Order>
Jet<T, N, Order> reciprocal(const Jet<T, N, Order>& a) {
    const T r = T(1) / a.value;
    return compose(a, Univariate<T>{r, -r * r, T(2) * r * r * r, T(-6) * r * r * r * r});
}
template <class T, int N, int Order>
Jet<T, N, Order> log(const Jet<T, N, Order>& a) {
    const T r = T(1) / a.value;
    return compose(a, Univariate<T>{log(a.value), r, -r * r, T(2) * r * r * r});
}
/// Selects between two jets per lane.
template <class Mask, class T, int N, int Order>
Jet<T, N, Order> select(const Mask& condition, const Jet<T, N, Order>& yes, const Jet<T, N, Order>& no) {
    Jet<T, N, Order> r;
    for (int k = 0; k < r.kSize; ++k) r.component(k) = select(condition, yes.component(k), no.component(k));
    return r;
}
/// |a|; derivatives are exact where a is not zero.
template <class T, int N, int Order>
Jet<T, N, Order> abs(const Jet<T, N, Order>& a) {
    return select(a.value < T(0), -a, a);
}
/// max(a, b); derivatives are exact where a and b differ.
template <class T, int N, int Order>
Jet<T, N, Order> max(const Jet<T, N, Order>& a, const Jet<T, N, Order>& b) {
    return select(a.value < b.value, b, a);
}

/// The chain rule in several variables: returns the jet of f(y(x)) in the variables x. `f` is the jet of f in the
/// variables y; `y` holds the jets of all y in the variables x.
template <class T, int N, int M, int Order>
constexpr Jet<T, M, Order> compose(const Jet<T, N, Order>& f, const Vec<Jet<T, M, Order>, N>& y) {
    using J = Jet<T, M, Order>;
    J r(f.value);
    if constexpr (Order >= 1)
        for (int a = 0; a < N; ++a) r.gradient += y[a].gradient * f.gradient[a];
    if constexpr (Order >= 2)
        for (int i = 0; i < M; ++i)
            for (int j = i; j < M; ++j)
                for (int a = 0; a < N; ++a) {
                    T h = f.gradient[a] * y[a].hessian(i, j);
                    for (int b = 0; b < N; ++b) h = mulAdd(f.hessian(a, b), y[a].gradient[i] * y[b].gradient[j], h);
                    r.hessian(i, j) += h;
                }
    if constexpr (Order >= 3)
        J::forTriples([&](int i, int j, int k) {
            T sum{};
            for (int a = 0; a < N; ++a) {
                sum += f.gradient[a] * y[a].third(i, j, k);
                for (int b = 0; b < N; ++b) {
                    sum += f.hessian(a, b) * J::overSplits(y[a].hessian, y[b].gradient, i, j, k);
                    for (int c = 0; c < N; ++c)
                        sum += f.third(a, b, c) * (y[a].gradient[i] * y[b].gradient[j] * y[c].gradient[k]);
                }
            }
            r.third(i, j, k) = sum;
        });
    return r;
}

/// Returns the jet of f(A x + b) in x, given the jet of f at A x + b.
template <class T, int N, int M, int Order>
constexpr Jet<T, M, Order> pullBack(const Jet<T, N, Order>& f, const Matrix<N, M>& A) {
    using J = Jet<T, M, Order>;
    J r(f.value);
    std::array<Vec<T, M>, N> a;
    for (int i = 0; i < N; ++i)
        for (int j = 0; j < M; ++j) a[static_cast<size_t>(i)][j] = static_cast<T>(A[i][j]);
    const auto sum = [&](const auto& weight) { // weighted sum of A's rows
        Vec<T, M> s = a[0] * weight(0);
        for (int k = 1; k < N; ++k)
            for (int j = 0; j < M; ++j) s[j] = mulAdd(a[static_cast<size_t>(k)][j], weight(k), s[j]);
        return s;
    };
    if constexpr (Order >= 1) r.gradient = sum([&](int k) { return f.gradient[k]; });
    if constexpr (Order >= 2) {
        std::array<Vec<T, M>, N> ha; // rows of H A
        for (int i = 0; i < N; ++i) ha[static_cast<size_t>(i)] = sum([&](int k) { return f.hessian(i, k); });
        for (int i = 0; i < M; ++i)
            for (int j = i; j < M; ++j) {
                T h = a[0][i] * ha[0][j];
                for (size_t k = 1; k < N; ++k) h = mulAdd(a[k][i], ha[k][j], h);
                r.hessian(i, j) = h;
            }
    }
    if constexpr (Order >= 3)
        for (int p = 0; p < N; ++p)
            for (int q = 0; q < N; ++q) {
                const Vec<T, M> row = sum([&](int k) { return f.third(p, q, k); });
                J::forTriples([&](int i, int j, int k) {
                    r.third(i, j, k) += a[static_cast<size_t>(p)][i] * a[static_cast<size_t>(q)][j] * row[k];
                });
            }
    return r;
}

} // namespace curlew
