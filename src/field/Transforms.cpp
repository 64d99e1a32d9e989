// SPDX-License-Identifier: Apache-2.0
#include "curlew/field/Transforms.h"

#include "MapModels.h"
#include "curlew/base/Error.h"
#include "curlew/field/Algebra.h"
#include "curlew/field/Dimensions.h"

#include <fmt/format.h>

#include <algorithm>
#include <numbers>

namespace curlew {

using namespace detail;

namespace {

template <int N, int M>
struct Lifted {
    static constexpr size_t kGraph{M - N};
    ScalarFieldN<M> field;
    std::array<ScalarFieldN<N>, kGraph> graph;
    template <int Order, class T>
    void evalBatch(const PointBatchN<N>& points, JetBatchN<T, N, Order>& jets) const {
        // Heights are coordinates, so they are computed in double.
        std::array<JetBatchN<double, N, Order>, kGraph> heights;
        for (size_t k = 0; k < kGraph; ++k) graph[k].eval(points, heights[k]);
        PointBatchN<M> above;
        above.size = points.size;
        for (size_t axis = 0; axis < N; ++axis) above.c[axis] = points.c[axis];
        for (size_t k = 0; k < kGraph; ++k) above.c[N + k] = heights[k].c[0];
        JetBatchN<T, M, Order> there;
        field.eval(above, there);
        for (int i = 0; i < points.size; ++i) {
            Vec<Jet<T, N, Order>, M> y;
            for (int axis = 0; axis < N; ++axis) y[axis] = Jet<T, N, Order>::variable(T(0), axis);
            for (int axis = N; axis < M; ++axis) {
                const auto height = heights[static_cast<size_t>(axis - N)][i];
                for (int c = 0; c < height.kSize; ++c) y[axis].component(c) = static_cast<T>(height.component(c));
            }
            jets.set(i, compose(there[i], y));
        }
    }
    template <int Order>
    Jet<Symbol<float>, N, Order> symbols(SymbolModule& module, const Vec<Symbol<double>, N>& p) const {
        using J = Jet<Symbol<float>, N, Order>;
        Vec<Symbol<double>, M> above;
        Vec<J, M> y;
        for (int axis = 0; axis < N; ++axis) {
            above[axis] = p[axis];
            y[axis] = J::variable(Symbol<float>(0), axis);
        }
        for (size_t k = 0; k < kGraph; ++k) {
            const int axis = N + static_cast<int>(k);
            y[axis] = graph[k].template symbols<Order>(module, p);
            above[axis] = convertTo<Symbol<double>>(y[axis].value);
        }
        return compose(field.template symbols<Order>(module, above), y);
    }
    Interval range() const { return field.range(); }
    double wavelength() const { return field.wavelength(); }
};

template <int N>
struct Displaced {
    ScalarFieldN<N> field, by;
    double amount;
    template <int Order, class T>
    void evalBatch(const PointBatchN<N>& points, JetBatchN<T, N, Order>& jets) const {
        if constexpr (Order >= 3) {
            throw ValueError("a displaced field cannot displace another field: its third derivatives are not known");
        } else {
            JetBatchN<double, N, Order + 1> pull;
            by.eval(points, pull);
            PointBatchN<N> moved;
            for (int i = 0; i < points.size; ++i) moved.push(points[i] + pull[i].gradient * amount);
            JetBatchN<T, N, Order> there;
            field.eval(moved, there);
            for (int i = 0; i < points.size; ++i) {
                const auto pulling = pull[i];
                Vec<Jet<T, N, Order>, N> y;
                for (int axis = 0; axis < N; ++axis) {
                    const auto move = partial(pulling, axis) * amount;
                    for (int c = 0; c < move.kSize; ++c) y[axis].component(c) = static_cast<T>(move.component(c));
                    y[axis] += Jet<T, N, Order>::variable(T(0), axis);
                }
                jets.set(i, compose(there[i], y));
            }
        }
    }
    template <int Order>
    Jet<Symbol<float>, N, Order> symbols(SymbolModule& module, const Vec<Symbol<double>, N>& p) const {
        using S = Symbol<float>;
        if constexpr (Order >= 2) {
            throw ValueError("a displaced field cannot displace another field in a shader");
        } else {
            const auto pull = by.template symbols<Order + 1>(module, p);
            Vec<Jet<S, N, Order>, N> y; // its value is the displacement only
            Vec<Symbol<double>, N> moved = p;
            for (int axis = 0; axis < N; ++axis) {
                y[axis] = partial(pull, axis) * S(amount);
                moved[axis] += convertTo<Symbol<double>>(y[axis].value);
                y[axis] += Jet<S, N, Order>::variable(S(0), axis);
            }
            return compose(field.template symbols<Order>(module, moved), y);
        }
    }
    Interval range() const { return field.range(); }
    double wavelength() const { return field.wavelength(); }
};

Matrix3 rotation(const Vec3d& degrees) {
    Matrix3 product;
    for (int axis = 0; axis < 3; ++axis) {
        const double angle = degrees[axis] * std::numbers::pi / 180, c = std::cos(angle), s = std::sin(angle);
        const int u = (axis + 1) % 3, v = (axis + 2) % 3;
        Matrix3 turn;
        turn[u][u] = turn[v][v] = c;
        turn[u][v] = -s;
        turn[v][u] = s;
        product = turn * product;
    }
    return product;
}

} // namespace

template <int N>
Matrix<N, N> rotationOf(const PlacementN<N>& placement) {
    const Vec3d& degrees = placement.rotate;
    Matrix<N, N> turn;
    if (degrees == Vec3d{}) return turn;
    if constexpr (N == 3) return rotation(degrees);
    if (N != 2 || degrees[0] != 0 || degrees[1] != 0)
        throw ValueError(fmt::format("a field with {} dimensions cannot be rotated about these axes; {}", N,
                                     N == 2 ? "in 2D give 0,0,degrees" : "only 2D and 3D fields can be rotated"));
    for (int i = 0; i < std::min(N, 2); ++i)
        for (int j = 0; j < std::min(N, 2); ++j) turn[i][j] = rotation(degrees)[i][j];
    return turn;
}

template <int N>
ScalarFieldN<N> placed(const ScalarFieldN<N>& field, const PlacementN<N>& placement) {
    if (placement == PlacementN<N>{}) return field;
    Matrix<N, N> inverse = transpose(rotationOf(placement));
    for (int i = 0; i < N; ++i) {
        if (placement.scale[i] == 0) throw ValueError("a field cannot be scaled by zero");
        inverse[i] *= 1 / placement.scale[i];
    }
    return ScalarFieldN<N>(Affine<N, N>{field, inverse, placement.offset});
}

template <int N>
BoxN<N> placed(const BoxN<N>& box, const PlacementN<N>& placement) {
    if (!box.finite()) return box;
    BoxN<N> scaled;
    for (int i = 0; i < N; ++i) {
        const double a = box.lower[i] * placement.scale[i], b = box.upper[i] * placement.scale[i];
        scaled.lower[i] = std::min(a, b);
        scaled.upper[i] = std::max(a, b);
    }
    if (placement.rotate != Vec3d{}) // about the origin
        scaled = BoxN<N>{}.padded(length(scaled.center()) + length(scaled.size()) / 2);
    return {scaled.lower + placement.offset, scaled.upper + placement.offset};
}

template <int M, int N>
ScalarFieldN<N> projected(const ScalarFieldN<M>& field, const Matrix<M, N>& A) {
    return ScalarFieldN<N>(Affine<M, N>{field, A, {}});
}

template <int N, int M>
ScalarFieldN<N> lifted(const ScalarFieldN<M>& field, const std::array<ScalarFieldN<N>, size_t{M - N}>& graph) {
    return ScalarFieldN<N>(Lifted<N, M>{field, graph});
}

template <int N>
ScalarFieldN<N> heightField(const ScalarFieldN<N - 1>& height) {
    Vec<double, N> up;
    up[N - 1] = 1;
    return rampField(up) - projected(height, Matrix<N - 1, N>{});
}

template <int N>
ScalarFieldN<N> displaced(const ScalarFieldN<N>& field, const ScalarFieldN<N>& by, double amount) {
    if (!std::isfinite(amount)) throw ValueError("the amount must be finite");
    by.template at<3>({}); // throws if there are no third derivatives
    return ScalarFieldN<N>(Displaced<N>{field, by, amount});
}

// NOLINTBEGIN(bugprone-macro-parentheses): the arguments are template arguments
#define CURLEW_INSTANTIATE(N)                                                      \
    template Matrix<N, N> rotationOf(const PlacementN<N>&);                        \
    template ScalarFieldN<N> placed(const ScalarFieldN<N>&, const PlacementN<N>&); \
    template BoxN<N> placed(const BoxN<N>&, const PlacementN<N>&);                 \
    template ScalarFieldN<N> displaced(const ScalarFieldN<N>&, const ScalarFieldN<N>&, double);
CURLEW_FOR_DIMENSIONS(CURLEW_INSTANTIATE)
#undef CURLEW_INSTANTIATE

#define CURLEW_INSTANTIATE(M, N) template ScalarFieldN<N> projected(const ScalarFieldN<M>&, const Matrix<M, N>&);
CURLEW_INSTANTIATE(1, 2)
CURLEW_INSTANTIATE(1, 3)
CURLEW_INSTANTIATE(2, 2)
CURLEW_INSTANTIATE(2, 3)
CURLEW_INSTANTIATE(3, 3)
CURLEW_INSTANTIATE(3, 4)
CURLEW_INSTANTIATE(4, 5)
CURLEW_INSTANTIATE(5, 6)
CURLEW_INSTANTIATE(6, 7)
#undef CURLEW_INSTANTIATE

#define CURLEW_INSTANTIATE(N, M) \
    template ScalarFieldN<N> lifted<N, M>(const ScalarFieldN<M>&, const std::array<ScalarFieldN<N>, size_t{M - N}>&);
CURLEW_INSTANTIATE(1, 2)
CURLEW_INSTANTIATE(1, 3)
CURLEW_INSTANTIATE(2, 3)
CURLEW_INSTANTIATE(2, 4)
CURLEW_INSTANTIATE(3, 4)
CURLEW_INSTANTIATE(3, 5)
CURLEW_INSTANTIATE(4, 5)
CURLEW_INSTANTIATE(4, 6)
CURLEW_INSTANTIATE(5, 6)
CURLEW_INSTANTIATE(5, 7)
CURLEW_INSTANTIATE(6, 7)
#undef CURLEW_INSTANTIATE

#define CURLEW_INSTANTIATE(N) template ScalarFieldN<N> heightField<N>(const ScalarFieldN<N - 1>&);
CURLEW_INSTANTIATE(2)
CURLEW_INSTANTIATE(3)
CURLEW_INSTANTIATE(4)
CURLEW_INSTANTIATE(5)
CURLEW_INSTANTIATE(6)
CURLEW_INSTANTIATE(7)
#undef CURLEW_INSTANTIATE
// NOLINTEND(bugprone-macro-parentheses)

} // namespace curlew
