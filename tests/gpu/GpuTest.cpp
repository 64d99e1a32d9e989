// SPDX-License-Identifier: Apache-2.0
#include "curlew/gpu/Gpu.h"
#include "gpu/Gpu.h"

using namespace curlew;
using namespace curlew::test;

TEST_CASE("gpus: devices have a name and memory", "[gpu]") {
    if (!gpuOrSkipped()) return;
    for (const GpuInfo& gpu : gpus()) {
        CHECK(!gpu.name.empty());
        CHECK(gpu.memory > size_t{1} << 20);
    }
}

TEST_CASE("preferredGpu: the first device that is not software", "[gpu]") {
    const GpuInfo software{.name = "a", .software = true}, hardware{.name = "b"};
    CHECK(preferredGpu({software, hardware, hardware}) == 1);
    CHECK(preferredGpu({hardware, software}) == 0);
    CHECK(preferredGpu({software}) == 0);
}

TEST_CASE("Gpu::open: returns the open device, and refuses an unknown number", "[gpu]") {
    const auto gpu = gpuOrSkipped();
    if (!gpu) return;
    CHECK(Gpu::open(preferredGpu(gpus())) == gpu);
    CHECK_THROWS_WITH(Gpu::open(99), Catch::ContainsSubstring("there is no GPU number 99; this machine has "));
    CHECK_THROWS_AS(Gpu::open(99), GpuError);
}
