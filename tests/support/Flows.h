// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "Catch.h"
#include "curlew/field/NoiseField.h"
#include "curlew/flow/Flow.h"
#include "support/Polynomial.h"

#include <nlohmann/json.hpp>

#include <utility>

namespace curlew::test {

/// A flow of N - 1 noises that differ in their seed.
template <class Noise>
FlowN<Noise::kDimension> flowOf(typename Noise::Options noise, const OctaveOptions& octaves = {}) {
    typename FlowN<Noise::kDimension>::Potentials potentials = [&]<size_t... K>(std::index_sequence<K...>) {
        const auto potential = [&](uint64_t seed) {
            noise.seed = seed;
            return noiseField<Noise>(noise, octaves);
        };
        return typename FlowN<Noise::kDimension>::Potentials{potential(K + 1)...};
    }
    (std::make_index_sequence<FlowN<Noise::kDimension>::kPotentials>());
    return FlowN<Noise::kDimension>(std::move(potentials));
}

/// A flow of polynomials of degree three, whose derivative is not linear.
template <int N>
FlowN<N> cubics() {
    const auto cubic = [](int k) {
        return formula<N>([k](const auto& x) {
            auto sum = x[k] * x[(k + 1) % N] * x[(k + 2) % N];
            for (int i = 0; i < N; ++i) sum += x[i] * x[i] * x[(i + k + 1) % N] * 0.5 + x[i] * (i == k ? 2.0 : 0.25);
            return sum;
        });
    };
    return [&]<size_t... K>(std::index_sequence<K...>) {
        return FlowN<N>(typename FlowN<N>::Potentials{cubic(static_cast<int>(K))...});
    }
    (std::make_index_sequence<size_t{N - 1}>());
}

/// An array of numbers as a vector.
template <int N>
Vec<double, N> vec(const nlohmann::json& a) {
    REQUIRE(a.size() == N);
    Vec<double, N> v;
    for (int i = 0; i < N; ++i) v[i] = a.at(static_cast<size_t>(i)).get<double>();
    return v;
}

/// The flow of a row of a reference file.
template <int N>
FlowN<N> flowOfRow(const nlohmann::json& row) {
    REQUIRE(row.at("f").size() == N - 1);
    return [&]<size_t... K>(std::index_sequence<K...>) {
        return FlowN<N>(typename FlowN<N>::Potentials{polynomial<N>(row["f"][K].template get<std::string>())...});
    }
    (std::make_index_sequence<size_t{N - 1}>());
}

} // namespace curlew::test
