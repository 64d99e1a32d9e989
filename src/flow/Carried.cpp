// SPDX-License-Identifier: Apache-2.0
#include "curlew/flow/Carried.h"

#include "curlew/base/Error.h"

#include <fmt/format.h>

#include <utility>

namespace curlew {

namespace {

template <int N>
struct Carried {
    using Term = typename FlowN<N>::Potentials;
    ScalarFieldN<N> field;
    std::vector<Term> terms;
    double dt;
    int steps;

    template <int Order, class T>
    void evalBatch(const PointBatchN<N>& points, JetBatchN<T, N, Order>& jets) const {
        if constexpr (Order >= 3) {
            throw ValueError(
                "a carried field cannot displace or carry another field: its third derivatives are not known");
        } else {
            Positions<Order> y = variables<Order>(points);
            for (int k = 0; k < steps; ++k) y = stepped(points.size, y);
            JetBatchN<T, N, Order> there;
            field.eval(placesOf(points.size, y), there);
            for (int i = 0; i < points.size; ++i) {
                Vec<Jet<T, N, Order>, N> x;
                for (int axis = 0; axis < N; ++axis)
                    for (int c = 0; c < Jet<T, N, Order>::kSize; ++c)
                        x[axis].component(c) = static_cast<T>(y[static_cast<size_t>(i)][axis].component(c));
                jets.set(i, compose(there[i], x));
            }
        }
    }
    /// The same, with displacements in the precision of values.
    template <int Order>
    Jet<Symbol<float>, N, Order> symbols(SymbolModule& module, const Vec<Symbol<double>, N>& p) const {
        if constexpr (Order >= 2) {
            throw ValueError("a carried field cannot displace or carry another field in a shader");
        } else {
            auto y = Vec<Moved, N>();
            for (int axis = 0; axis < N; ++axis) y[axis] = Moved::variable(Symbol<float>(0), axis);
            for (int k = 0; k < steps; ++k) y = stepped(module, p, y);
            return compose(field.template symbols<Order>(module, placeOf(p, y)), y);
        }
    }
    Interval range() const { return field.range(); }

  private:
    /// A displacement with the derivatives of the moved position.
    using Moved = Jet<Symbol<float>, N, 1>;

    static Vec<Symbol<double>, N> placeOf(Vec<Symbol<double>, N> p, const Vec<Moved, N>& y) {
        for (int axis = 0; axis < N; ++axis) p[axis] += convertTo<Symbol<double>>(y[axis].value);
        return p;
    }
    Vec<Moved, N> velocity(SymbolModule& module, const Vec<Symbol<double>, N>& p, const Vec<Moved, N>& y) const {
        const auto place = placeOf(p, y);
        Vec<Moved, N> sum;
        for (const Term& term : terms) {
            std::array<Vec<Moved, N>, FlowN<N>::kPotentials> gradients;
            for (size_t q = 0; q < gradients.size(); ++q) {
                const auto jet = term[q].template symbols<2>(module, place);
                for (int axis = 0; axis < N; ++axis) gradients[q][axis] = partial(jet, axis);
            }
            const auto there = cross(gradients);
            for (int axis = 0; axis < N; ++axis) sum[axis] += compose(there[axis], y);
        }
        return sum;
    }
    Vec<Moved, N> stepped(SymbolModule& module, const Vec<Symbol<double>, N>& p, const Vec<Moved, N>& y) const {
        const auto constant = [](double x) { return Moved(Symbol<float>(x)); };
        const auto k1 = velocity(module, p, y);
        const auto k2 = velocity(module, p, y + k1 * constant(dt / 2));
        const auto k3 = velocity(module, p, y + k2 * constant(dt / 2));
        const auto k4 = velocity(module, p, y + k3 * constant(dt));
        return y + (k1 + (k2 + k3) * constant(2) + k4) * constant(dt / 6);
    }

    /// The current positions of a batch of points, as functions (jets) of their start positions.
    template <int Order>
    using Positions = std::array<Vec<Jet<double, N, Order>, N>, kBatch>;

    template <int Order>
    static Positions<Order> variables(const PointBatchN<N>& points) {
        Positions<Order> y;
        for (int i = 0; i < points.size; ++i) y[static_cast<size_t>(i)] = Jet<double, N, Order>::variables(points[i]);
        return y;
    }

    template <int Order>
    static PointBatchN<N> placesOf(int size, const Positions<Order>& y) {
        PointBatchN<N> places;
        for (int i = 0; i < size; ++i) {
            Vec<double, N> p;
            for (int axis = 0; axis < N; ++axis) p[axis] = y[static_cast<size_t>(i)][axis].value;
            places.push(p);
        }
        return places;
    }

    /// Returns a + s b.
    template <int Order>
    static Positions<Order> moved(int size, Positions<Order> a, const Positions<Order>& b, double s) {
        for (size_t i = 0; i < static_cast<size_t>(size); ++i)
            for (int axis = 0; axis < N; ++axis) a[i][axis] += b[i][axis] * s;
        return a;
    }

    /// Returns the velocity at y as a function of the start positions, by the chain rule.
    template <int Order>
    Positions<Order> velocity(int size, const Positions<Order>& y) const {
        const PointBatchN<N> places = placesOf(size, y);
        Positions<Order> sum;
        for (const Term& term : terms) {
            std::array<JetBatchN<double, N, Order + 1>, FlowN<N>::kPotentials> potentials;
            for (size_t q = 0; q < potentials.size(); ++q) term[q].eval(places, potentials[q]);
            for (int i = 0; i < size; ++i) {
                std::array<Vec<Jet<double, N, Order>, N>, FlowN<N>::kPotentials> gradients;
                for (size_t q = 0; q < potentials.size(); ++q) {
                    const auto jet = potentials[q][i];
                    for (int axis = 0; axis < N; ++axis) gradients[q][axis] = partial(jet, axis);
                }
                const auto there = cross(gradients);
                const auto k = static_cast<size_t>(i);
                for (int axis = 0; axis < N; ++axis) sum[k][axis] += compose(there[axis], y[k]);
            }
        }
        return sum;
    }

    /// One step of the classical Runge-Kutta method (RK4).
    template <int Order>
    Positions<Order> stepped(int size, const Positions<Order>& y) const {
        const auto k1 = velocity(size, y);
        const auto k2 = velocity(size, moved(size, y, k1, dt / 2));
        const auto k3 = velocity(size, moved(size, y, k2, dt / 2));
        const auto k4 = velocity(size, moved(size, y, k3, dt));
        auto end = moved(size, y, k1, dt / 6);
        end = moved(size, end, k2, dt / 3);
        end = moved(size, end, k3, dt / 3);
        return moved(size, end, k4, dt / 6);
    }
};

} // namespace

template <int N>
ScalarFieldN<N> carried(const ScalarFieldN<N>& field, const FlowN<N>& flow, const CarryOptions& options) {
    constexpr int kMaxSteps = 1000;
    if (!std::isfinite(options.time)) throw ValueError("the time must be finite");
    if (options.steps < 1 || options.steps > kMaxSteps)
        throw ValueError(fmt::format("{} steps; give 1 to {}", options.steps, kMaxSteps));
    if (flow.uniformSpeed() > 0)
        throw ValueError("a normalised flow cannot carry a field: its direction is discontinuous at stagnation points");
    if (flow.preservesArea())
        throw ValueError("a flow that preserves area on level sets cannot carry a field; use its divergence-free form");
    if (!flow.components().empty())
        throw ValueError("a flow without potentials (a velocity grid, a gradient) cannot carry a field");
    for (const auto& term : flow.terms())
        for (const auto& potential : term) potential.template at<3>({}); // throws if there are no third derivatives
    return ScalarFieldN<N>(Carried<N>{field, flow.terms(), -options.time / options.steps, options.steps});
}

template ScalarFieldN<2> carried(const ScalarFieldN<2>&, const FlowN<2>&, const CarryOptions&);
template ScalarFieldN<3> carried(const ScalarFieldN<3>&, const FlowN<3>&, const CarryOptions&);

} // namespace curlew
