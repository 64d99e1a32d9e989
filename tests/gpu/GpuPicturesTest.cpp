// SPDX-License-Identifier: Apache-2.0
#include "curlew/gpu/GpuPictures.h"
#include "gpu/Gpu.h"

using namespace curlew;
using namespace curlew::test;

namespace {

FlowN<2> planeFlow() {
    return FlowN<2>({noiseField<Psrd2>({}, {.frequency = 2})}, {.box = {{{0, 0}}, {{2, 1}}}, .wall = {}});
}

} // namespace

TEST_CASE("warperOn: moves positions as warp() does", "[gpu]") {
    const auto gpu = gpuOrSkipped();
    if (!gpu) return;
    const FlowN<2> flow = planeFlow();
    const auto start = positionsIn(flow, 2000);
    for (const WarpOptions& options : {WarpOptions{.time = 0.2}, WarpOptions{.time = -0.2, .steps = 40},
                                       WarpOptions{.time = 0.2, .steps = 40, .corrections = 0}}) {
        CAPTURE(options.time, options.steps, options.corrections);
        auto expected = start, found = start;
        warp(flow, expected, options);
        warperOn(gpu)(flow, found, options, {});
        std::vector<double> apart;
        for (size_t k = 0; k < start.size(); ++k) apart.push_back(length(expected[k] - found[k]));
        CHECK(medianOf(apart) < 2e-6);
    }
    auto positions = start;
    CHECK_THROWS_AS(warperOn(gpu)(flow + flow, positions, {.corrections = 1}, {}), ValueError);
    CHECK(positions == start);
}

TEST_CASE("convolutionOn: averages noise as convolved() does", "[gpu]") {
    const auto gpu = gpuOrSkipped();
    if (!gpu) return;
    Image vectors = filledImage(90, 61, {"right", "up"});
    for (int y = 0; y < vectors.height; ++y)
        for (int x = 0; x < vectors.width; ++x) {
            const double u = x - 44.3, v = 30.2 - y;
            vectors.at(x, y, 0) = static_cast<float>(-v);
            vectors.at(x, y, 1) = static_cast<float>(u);
            if (u * u + v * v < 40) vectors.at(x, y, 0) = std::numeric_limits<float>::quiet_NaN();
            if (x > 80) vectors.at(x, y, 0) = vectors.at(x, y, 1) = 0;
        }
    for (const LicKernel kernel : {LicKernel::hann, LicKernel::box}) {
        const LicOptions options{.length = 20, .kernel = kernel, .grain = 1.3};
        const Image expected = lic(vectors, options), found = lic(vectors, options, {}, convolutionOn(gpu));
        const ImageDifference difference = differenceOf(expected, found);
        CHECK(difference.unmatched == 0);
        CHECK(difference.rms < 2e-3);
    }
    const Monitor cancelled{.report = {}, .cancelled = [] { return true; }};
    CHECK_THROWS_AS(lic(vectors, {}, cancelled, convolutionOn(gpu)), Interrupted);
}
