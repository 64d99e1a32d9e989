// SPDX-License-Identifier: Apache-2.0
#include "curlew/noise/RadialKernel.h"
#include "support/FiniteDifference.h"

using namespace curlew;
using namespace curlew::test;

namespace {

/// One vertex at 0 that contributes to a noise.
template <int P, int N>
struct Vertex {
    double radius2;
    Vec<double, N> g;
    template <int Order, class T>
    Jet<T, N, Order> at(const Vec<double, N>& p) const {
        Vec<T, N> gradient, d;
        for (int i = 0; i < N; ++i) {
            gradient[i] = static_cast<T>(g[i]);
            d[i] = static_cast<T>(p[i]);
        }
        Jet<T, N, Order> sum;
        addRadialKernel(sum, P, static_cast<T>(radius2), gradient, d);
        return sum;
    }
    /// The same contribution, differentiated by the rules of jets.
    Jet<double, N, 3> byRules(const Vec<double, N>& p) const {
        using J = Jet<double, N, 3>;
        const auto x = J::variables(p);
        J ramp, w(radius2);
        for (int i = 0; i < N; ++i) {
            ramp += x[i] * g[i];
            w -= x[i] * x[i];
        }
        if (w.value <= 0) return {};
        for (int k = 0; k < P; ++k) ramp = ramp * w;
        return ramp;
    }
};

template <int P, int N>
void checkKernel() {
    const Vertex<P, N> vertex{0.5, randomPoint(cube<N>(1), 1, 0)};
    WorstN<N> worst;
    size_t inside = 0, outside = 0;
    for (const auto& p : randomPoints(cube<N>(0.8), 1000, 2)) {
        ++(dot(p, p) < vertex.radius2 ? inside : outside);
        const auto jet = vertex.template at<3, double>(p);
        worst.see(difference(jet, vertex.byRules(p)), p);
        worst.see(difference(vertex.template at<2, double>(p), truncated<2>(jet)), p);
        worst.see(difference(vertex.template at<0, double>(p), truncated<0>(jet)), p);
    }
    CAPTURE(P, N, worst.where);
    CHECK(inside > 10);
    CHECK(outside > 10);
    CHECK(worst.value <= 1e-12); // a few dozen roundings of terms of at most 8 P³ = 512
}

} // namespace

TEST_CASE("addRadialKernel: derivatives follow the formula and vanish beyond the radius", "[noise]") {
    checkKernel<3, 1>();
    checkKernel<3, 2>();
    checkKernel<3, 3>();
    checkKernel<3, 4>();
    checkKernel<4, 1>();
    checkKernel<4, 2>();
    checkKernel<4, 3>();
    checkKernel<4, 5>();
}

TEST_CASE("addRadialKernel: continuous derivatives vanish on the radius", "[noise]") {
    const Vec<double, 2> edge{{3, 4}};
    CHECK(difference(Vertex<3, 2>{25, {{1, 2}}}.at<2, double>(edge), Jet<double, 2, 2>{}) == 0);
    CHECK(difference(Vertex<3, 2>{25, {{1, 2}}}.at<3, double>(edge), Jet<double, 2, 3>{}) ==
          0); // as outside the radius
    CHECK(difference(Vertex<4, 2>{25, {{1, 2}}}.at<3, double>(edge), Jet<double, 2, 3>{}) == 0);
}

TEST_CASE("addRadialKernel: adds to the existing sum", "[noise]") {
    Jet<double, 2, 3> sum;
    for (int k = 0; k < sum.kSize; ++k) sum.component(k) = k;
    const auto before = sum;
    const Vec<double, 2> g{{1, -1}}, d{{0.25, 0.5}};
    addRadialKernel(sum, 3, 0.5, g, d);
    CHECK(difference(sum - before, Vertex<3, 2>{0.5, g}.at<3, double>(d)) <= 1e-13); // roundings of 10
}

TEST_CASE("addRadialKernel: derivatives agree with central differences", "[noise]") {
    std::vector<Vec3d> points;
    for (const Vec3d& p : randomPoints(cube(0.6), 500, 3))
        if (std::abs(length(p) - std::sqrt(0.5)) > 0.01) points.push_back(p * 0.9);
    std::erase_if(points, [](const Vec3d& p) { return dot(p, p) > 0.49; });
    REQUIRE(points.size() > 100);
    constexpr double kStep = 0x1p-10;
    requireThirdDerivatives(Vertex<3, 3>{0.5, {{0.3, -0.8, 0.5}}}, points, kStep);
    requireThirdDerivatives(Vertex<4, 3>{0.5, {{0.3, -0.8, 0.5}}}, points, kStep);
    // The gradient of w³ (g · d) is at most 1, and so on: third derivatives are below 8 · 27.
    requireDerivatives(Vertex<3, 3>{0.5, {{0.3, -0.8, 0.5}}}, points, kStep, 8 * 27);
}
