// SPDX-License-Identifier: Apache-2.0
#include "Cases.h"
#include "ScalarPorts.h"
#include "curlew/base/Error.h"
#include "curlew/base/HugePages.h"
#include "curlew/vdb/Openvdb.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>

namespace {

using namespace curlew;

/// Returns the largest difference between a port and Psrd3 in value and gradient.
template <ports::Gradients G>
double disagreement() {
    const Psrd3 psrd;
    double largest = 0;
    for (const PointBatch& points : bench::randomBatches<3>(20))
        for (int i = 0; i < kBatch; ++i) {
            float p[3];
            for (int axis = 0; axis < 3; ++axis) p[axis] = static_cast<float>(points[i][axis] - 10);
            const auto jet = psrd.at<1, double>({{double{p[0]}, double{p[1]}, double{p[2]}}});
            const ports::Sample sample = ports::noise<G>(p);
            largest = std::max(largest, std::abs(jet.value - double{sample.value}));
            for (int axis = 0; axis < 3; ++axis)
                largest = std::max(largest, std::abs(jet.gradient[axis] - double{sample.gradient[axis]}));
        }
    return largest;
}

/// Throws if a port does not agree with the library.
template <ports::Gradients G>
void requireAgreement(const char* name, double tolerance) {
    const double largest = disagreement<G>();
    if (!(largest <= tolerance))
        throw Error(fmt::format("the scalar port '{}' is off Psrd3 by {:.3g}, more than {:.0e}; see ScalarPorts.cpp",
                                name, largest, tolerance));
}

void requireAgreement() {
    // In float, the angle of a gradient (up to 1118 radians) has a rounding error of up to 2^-14, and the weight of a
    // gradient is up to 39.5 / 8. The table does not have this error, only that of a few float operations.
    requireAgreement<ports::Gradients::computed>("computed", 3.1e-4);
    requireAgreement<ports::Gradients::table>("table", 2e-5);
}

void run(int argc, char** argv) {
    benchmark::Initialize(&argc, argv);
    if (benchmark::ReportUnrecognizedArguments(argc, argv)) throw Error("see --help");
    requireAgreement();
    openvdb::initialize();
    bench::registerRoofline();
    bench::registerNoise();
    bench::registerGrid();
    bench::registerAdvect();
    bench::registerEnright();
    bench::registerWarp();
    bench::registerMesh();
    bench::registerWait();
    bench::registerGpu();
    benchmark::RunSpecifiedBenchmarks();
    benchmark::Shutdown();
}

} // namespace

int main(int argc, char** argv) {
    try {
        allowHugePages();
        run(argc, argv);
        return 0;
    } catch (const std::exception& e) {
        fmt::print(stderr, "curlew_bench: {}\n", e.what());
        return 1;
    }
}
