// SPDX-License-Identifier: Apache-2.0
// Warping images along a 2D flow, as in Table 2 of ICN (Bærentzen et al. 2025): frames of 1024 x 576 pixels.

#include "Cases.h"
#include "curlew/base/Parallel.h"
#include "curlew/picture/Warp.h"

#include <fmt/format.h>

namespace curlew::bench {

namespace {

void frame(benchmark::State& state, const WarpOptions& options) {
    const ThreadLimit limit(1);
    constexpr int kWidth = 1024, kHeight = 576;
    const FlowN<2> flow{FlowN<2>::Potentials{noiseField<GradientNoise<2>>({}, {.frequency = 7})}};
    const BoxN<2> box{{{0, 0}}, {{16.0 / 9, 1}}};
    for (auto _ : state) benchmark::DoNotOptimize(warpedPicture(flow, wavePattern, box, kWidth, kHeight, options));
    state.SetItemsProcessed(state.iterations() * kWidth * kHeight);
    state.counters["frames_per_second"] =
        benchmark::Counter(static_cast<double>(state.iterations()), benchmark::Counter::kIsRate);
}

} // namespace

void registerWarp() {
    for (const auto& [name, scheme] : {std::pair("euler", Scheme::euler), std::pair("rk4", Scheme::rk4)})
        for (const int corrections : {0, 1})
            once(add(fmt::format("warp/{}/64steps/{}corrections", name, corrections), [scheme = scheme,
                                                                                       corrections](auto& state) {
                frame(state, {.steps = 64, .scheme = scheme, .corrections = corrections});
            }))->UseRealTime();
}

} // namespace curlew::bench
