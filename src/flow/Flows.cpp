// SPDX-License-Identifier: Apache-2.0
#include "curlew/flow/Flows.h"

#include "curlew/base/Require.h"
#include "curlew/field/Algebra.h"
#include "curlew/field/Formula.h"
#include "curlew/field/Transforms.h"

#include <fmt/format.h>

#include <numbers>
#include <utility>

namespace curlew {

namespace {

Vec3d axis(int i) {
    Vec3d e;
    e[i] = 1;
    return e;
}

/// A partial derivative of a field.
template <int N>
struct PartialDerivative {
    ScalarFieldN<N> field;
    int axis;

    template <int Order, class T>
    void evalBatch(const PointBatchN<N>& points, JetBatchN<T, N, Order>& jets) const {
        if constexpr (Order >= 3) {
            throw ValueError("the third derivatives of a gradient are not known");
        } else if constexpr (Order >= 1 && std::is_same_v<T, float>) { // which second derivatives are not known in
            JetBatchN<double, N, Order> exact;
            evalBatch(points, exact);
            for (size_t k = 0; k < jets.c.size(); ++k)
                for (size_t i = 0; i < kBatch; ++i) jets.c[k][i] = static_cast<float>(exact.c[k][i]);
        } else {
            JetBatchN<T, N, Order + 1> whole;
            field.eval(points, whole);
            for (int i = 0; i < points.size; ++i) jets.set(i, partial(whole[i], axis));
        }
    }
    template <int Order>
    Jet<Symbol<float>, N, Order> symbols(SymbolModule& module, const Vec<Symbol<double>, N>& p) const {
        if constexpr (Order >= 2)
            throw ValueError("a gradient cannot be differentiated twice in a shader");
        else
            return partial(field.template symbols<Order + 1>(module, p), axis);
    }
    double wavelength() const { return field.wavelength(); }
};

/// Returns the matrix that selects two coordinates of a position.
Matrix<2, 3> picking(int first, int second) { return {{axis(first), axis(second)}}; }

} // namespace

Flow curlFlow(const std::array<ScalarField, 3>& psi, const Domain& domain) {
    std::vector<Flow::Potentials> terms;
    const auto ramp = domain.wall ? std::optional(layerRamp(*domain.wall)) : std::nullopt;
    for (int i = 0; i < 3; ++i) {
        const ScalarField& component = psi[static_cast<size_t>(i)];
        terms.push_back({ramp ? component * *ramp : component, rampField(axis(i))});
    }
    return Flow(std::move(terms), domain);
}

Flow curlFlow(const std::array<ScalarFieldN<2>, 3>& psi, const Domain& domain) {
    return curlFlow(std::array{projected(psi[0], picking(2, 1)), projected(psi[1], picking(0, 2)),
                               projected(psi[2], picking(1, 0))},
                    domain);
}

Flow uniformFlow(const Vec3d& velocity, const Domain& domain) {
    const double speed = length(velocity);
    requirePositive(speed, "the speed");
    // u and v span the plane across the velocity, and u × v points along it.
    const Vec3d direction = velocity * (1 / speed);
    int least = 0;
    for (int i = 1; i < 3; ++i)
        if (std::abs(direction[i]) < std::abs(direction[least])) least = i;
    Vec3d u = cross(axis(least), direction);
    u *= 1 / length(u);
    return Flow(rampField(u * speed), rampField(cross(direction, u)), domain);
}

Flow vortexFlow(double turns, double core, const Domain& domain) {
    requirePositive(core, "core");
    if (!std::isfinite(turns) || turns == 0)
        throw ValueError(fmt::format("turns {} must be finite and not zero", turns));
    const double factor = -std::numbers::pi * turns * core * core;
    return Flow(formulaField([=](const auto& x, const auto& k) {
                    return log((x[0] * x[0] + x[2] * x[2]) * k(1 / (core * core)) + k(1)) * k(factor);
                }),
                rampField(axis(1)), domain);
}

Flow updraftFlow(double speed, double height, const Domain& domain) {
    requirePositive(height, "height");
    if (!std::isfinite(speed) || speed == 0)
        throw ValueError(fmt::format("speed {} must be finite and not zero", speed));
    // The vector potential p(y) (z, 0, -x) / 2 with p = speed / (1 + y / height) has the curl (-p' x / 2, p, -p' z /
    // 2).
    const auto component = [=](int along, double sign) {
        return formulaField([=](const auto& x, const auto& k) {
            using T = std::remove_cvref_t<decltype(x[0].value)>;
            const auto t = x[1] * k(1 / height);
            const T r = T(1) / (T(1) + max(t.value, T(0))), s = t.value;
            const auto above = compose(t, Univariate<T>{r, -r * r, T(2) * r * r * r, T(-6) * r * r * r * r});
            const auto below = compose(t, Univariate<T>{T(1) - s + s * s, T(2) * s - T(1), T(2)});
            const auto p = select(s >= T(0), above, below);
            return p * x[along] * k(sign * speed / 2);
        });
    };
    return Flow({{component(2, 1), rampField(axis(0))}, {component(0, -1), rampField(axis(2))}}, domain);
}

Flow placed(const Flow& flow, const Placement& placement) {
    if (flow.terms().empty() || flow.domain().wall || flow.uniformSpeed() > 0 || flow.preservesArea())
        throw ValueError("only a flow that is made of potentials, and has no wall, can be placed");
    if (placement.scale != Placement{}.scale) throw ValueError("a flow cannot be scaled by its placement");
    std::vector<Flow::Potentials> terms;
    for (const Flow::Potentials& term : flow.terms())
        terms.push_back({placed(term[0], placement), placed(term[1], placement)});
    return Flow(std::move(terms), flow.domain());
}

template <int N>
FlowN<N> gradientFlow(const ScalarFieldN<N>& field, const DomainN<N>& domain) {
    return [&]<size_t... K>(std::index_sequence<K...>) {
        return FlowN<N>::ofComponents({ScalarFieldN<N>(PartialDerivative<N>{field, static_cast<int>(K)})...}, domain);
    }
    (std::make_index_sequence<size_t{N}>());
}

template FlowN<2> gradientFlow(const ScalarFieldN<2>&, const DomainN<2>&);
template FlowN<3> gradientFlow(const ScalarFieldN<3>&, const DomainN<3>&);

Flow enrightFlow(double amplitude) {
    // curl (ψ e_z + χ e_y), where ψ yields all of v, χ all of w, and each of them half of u.
    constexpr double kPi = std::numbers::pi;
    const auto potential = [=](int squared, int plain, double sign) {
        return formulaField([=](const auto& x, const auto& k) {
            const auto p = sin(x[0] * k(kPi)), q = sin(x[squared] * k(kPi));
            return p * p * (q * q) * sin(x[plain] * k(2 * kPi)) * k(sign * amplitude / kPi);
        });
    };
    const Domain unit{.box = {{{0, 0, 0}}, {{1, 1, 1}}}, .wall = std::nullopt};
    return Flow({{potential(1, 2, 1), rampField(axis(2))}, {potential(2, 1, -1), rampField(axis(1))}}, unit);
}

FlowInTime enrightFlowInTime(double period) {
    requirePositive(period, "the period");
    return FlowInTime([=](double time) { return enrightFlow(std::cos(std::numbers::pi * time / period)); });
}

} // namespace curlew
