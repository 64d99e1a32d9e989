// SPDX-License-Identifier: Apache-2.0
// Evaluation of noises and flows at positions: pure arithmetic.

#include "Cases.h"
#include "ScalarPorts.h"

#include <fmt/format.h>

namespace curlew::bench {

namespace {

constexpr double kEdge = 20; ///< Edge of the cube of random points, in cells.
constexpr int64_t kPoints = int64_t{kBatches} * kBatch;

template <class T>
void dfvn(benchmark::State& state, const std::vector<PointBatch>& batches) {
    const Flow flow = freeFlow();
    VecBatch<T> velocity;
    for (auto _ : state)
        for (const PointBatch& points : batches) {
            flow.velocity(points, velocity);
            benchmark::DoNotOptimize(velocity);
        }
    state.SetItemsProcessed(state.iterations() * kPoints);
}

template <ports::Gradients G>
void port(benchmark::State& state, const std::vector<PointBatch>& batches) {
    std::vector<std::array<float, 3>> positions;
    for (const PointBatch& points : batches)
        for (int i = 0; i < kBatch; ++i) {
            const Vec3d p = points[i];
            positions.push_back({static_cast<float>(p[0]), static_cast<float>(p[1]), static_cast<float>(p[2])});
        }
    for (auto _ : state)
        for (const auto& p : positions) {
            float velocity[3];
            ports::velocity<G>({p[0], p[1], p[2]}, velocity);
            benchmark::DoNotOptimize(velocity);
        }
    state.SetItemsProcessed(state.iterations() * kPoints);
}

template <class T, int Order, int N>
void evaluate(benchmark::State& state, const ScalarFieldN<N>& field) {
    const auto batches = randomBatches<N>(kEdge);
    JetBatchN<T, N, Order> jets;
    for (auto _ : state)
        for (const auto& points : batches) {
            field.eval(points, jets);
            benchmark::DoNotOptimize(jets);
        }
    state.SetItemsProcessed(state.iterations() * kPoints);
}

template <class T, class Noise>
void addOrders(const std::string& name) {
    const auto field = noiseField<Noise>({.seed = 1});
    add(name + "/order0", [=](auto& state) { evaluate<T, 0>(state, field); });
    add(name + "/order1", [=](auto& state) { evaluate<T, 1>(state, field); });
    if constexpr (std::is_same_v<T, double>) add(name + "/order2", [=](auto& state) { evaluate<T, 2>(state, field); });
}

template <class Noise>
void addNoise(const std::string& name) {
    addOrders<float, Noise>("noise/" + name + "/float");
    addOrders<double, Noise>("noise/" + name + "/double");
}

} // namespace

void registerNoise() {
    const auto random = randomBatches<3>(kEdge), row = rowBatches(1.0 / kVoxelsPerCell);
    add("dfvn/float/random", [=](auto& state) { dfvn<float>(state, random); });
    add("dfvn/float/row", [=](auto& state) { dfvn<float>(state, row); });
    add("dfvn/double/random", [=](auto& state) { dfvn<double>(state, random); });
    add("dfvn/double/row", [=](auto& state) { dfvn<double>(state, row); });
    using ports::Gradients;
    add("port/computed/random", [=](auto& state) { port<Gradients::computed>(state, random); });
    add("port/computed/row", [=](auto& state) { port<Gradients::computed>(state, row); });
    add("port/table/random", [=](auto& state) { port<Gradients::table>(state, random); });
    add("port/table/row", [=](auto& state) { port<Gradients::table>(state, row); });

    addNoise<Psrd2>("psrd2");
    addNoise<Psrd3>("psrd3");
    addNoise<PerlinNoise<3>>("perlin3");
    addNoise<ValueNoise<3>>("value3");
    addNoise<SimplexNoise<3>>("simplex3");
    addNoise<SimplexNoise<4>>("simplex4");
    addNoise<SimplexNoise<5>>("simplex5");
    addNoise<SimplexNoise<7>>("simplex7");
    for (int octaves = 1; octaves <= 8; ++octaves) {
        const auto field = noiseField<Psrd3>({.seed = 1}, {.octaves = octaves});
        add(fmt::format("octaves/{}", octaves), [=](auto& state) { evaluate<float, 1>(state, field); });
    }
}

} // namespace curlew::bench
